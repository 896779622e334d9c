//! Who is not the vehicle's present run: another surface that holds it, a second vehicle with its address, the run before.

use crate::directive::Series;
use crate::link::HOLDER_SILENCE;
use crate::link::surface::layers::Layers;
use crate::map::{LayerId, LayerReplica, LayerSet, Replica};
use crate::time::Instant;
use crate::wire::{Introduction, SurfaceName, VehicleStatus};
use std::time::Duration;

/// Another surface, by its hello to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherSurface {
    /// The series of its orders, which no other surface has.
    pub series: Series,
    /// Its name for people; empty if it has none.
    pub name: SurfaceName,
    /// When the vehicle last heard it, as far as this surface knows.
    pub heard: Instant,
}

impl OtherSurface {
    /// Whether the vehicle has not heard it for so long that it leaves it.
    pub fn is_silent(&self, now: Instant) -> bool {
        now.since(self.heard) >= HOLDER_SILENCE
    }

    /// The surface that an introduction names, `silence` after the vehicle heard it.
    fn of(introduction: &Introduction, silence: Duration, now: Instant) -> Option<Self> {
        let Introduction { series, name, .. } = *introduction;
        series.map(|series| Self { series, name, heard: now - silence })
    }
}

/// What this surface knows about others.
#[derive(Debug, Default)]
pub(super) struct Rivals {
    /// The surface for which the vehicle refuses this one.
    holder: Option<OtherSurface>,
    /// The surface that last called the vehicle that this one holds.
    caller: Option<OtherSurface>,
    /// When the vehicle is called again.
    next_call: Option<Instant>,
}

impl Rivals {
    /// The time between two calls to a vehicle that another surface holds: the holder may be gone by then.
    const MIN_INTERVAL: Duration = Duration::from_secs(10);
    const MAX_INTERVAL: Duration = Duration::from_secs(60);
    /// A caller is forgotten after this time.
    const CALLER_LIFETIME: Duration = Duration::from_secs(300);

    /// The surface that holds the vehicle.
    pub(super) fn holder(&self) -> Option<OtherSurface> {
        self.holder
    }

    /// Another surface that has called the vehicle in the last minutes.
    pub(super) fn caller(&self, now: Instant) -> Option<OtherSurface> {
        self.caller.filter(|caller| now.since(caller.heard) < Self::CALLER_LIFETIME)
    }

    /// The vehicle has refused this surface; returns whether the holder is another one than before.
    pub(super) fn handle_refusal(&mut self, refusal: &Introduction, now: Instant) -> bool {
        let silence = Duration::from_secs(refusal.silence_s.into());
        let holder = OtherSurface::of(refusal, silence, now);
        let wait = (HOLDER_SILENCE + Duration::from_secs(2)).saturating_sub(silence);
        self.next_call = Some(now + wait.clamp(Self::MIN_INTERVAL, Self::MAX_INTERVAL));
        let before = std::mem::replace(&mut self.holder, holder).map(|before| before.series);
        before != holder.map(|holder| holder.series)
    }

    /// The vehicle names a surface that has called it; returns whether it is another one than before.
    pub(super) fn handle_caller(&mut self, caller: &Introduction, now: Instant) -> bool {
        let is_known = self.caller(now).map(|before| before.series) == caller.series;
        self.caller = OtherSurface::of(caller, Duration::ZERO, now).or(self.caller);
        !is_known
    }

    /// The vehicle uses a run of this surface; returns whether another one held it before. That one is known still, unless it is gone.
    pub(super) fn handle_contact(&mut self, now: Instant) -> bool {
        self.next_call = None;
        let Some(holder) = self.holder.take() else { return false };
        self.caller = Some(holder).filter(|holder| !holder.is_silent(now));
        true
    }

    /// Calls the vehicle at once.
    pub(super) fn hurry(&mut self) {
        self.next_call = None;
    }

    /// Until when the vehicle is left alone, because another surface holds it.
    pub(super) fn quiet_until(&self) -> Option<Instant> {
        self.next_call
    }
}

/// The sign of a second vehicle: a hello of another run than the current one, and yet the current one goes on. A vehicle that has begun
/// another run sends nothing more in the one before.
#[derive(Debug, Default)]
pub(super) struct TwinWatch {
    /// The contact with the current run: since when without a gap, and its last new frame.
    contact: Option<(Instant, Instant)>,
    /// When another run said hello, or answered a call.
    stranger: Option<Instant>,
    /// When a vehicle first answered the present run of this surface by a hello.
    answered: Option<Instant>,
    /// When both were last heard.
    found: Option<Instant>,
}

impl TwinWatch {
    /// Time in which several vehicles answer one hello, shorter than a restart takes.
    const ANSWERS: Duration = Duration::from_secs(5);
    /// Longer than a frame of the run before may take.
    const LATE: Duration = Duration::from_secs(10);
    /// A vehicle answers a call once it has had no frame of its run for a minute, as after a silence. One that has taken turns for
    /// longer without a gap does not.
    const CALLABLE: Duration = Duration::from_secs(90);
    const GAP: Duration = Duration::from_secs(30);
    /// A sign of a second vehicle counts for this time: it may have got another address since.
    const LIFETIME: Duration = Duration::from_secs(600);

    /// Another run than the current one is heard.
    fn handle_stranger(&mut self, now: Instant) {
        self.stranger.get_or_insert(now);
    }

    /// A hello of another run than the current one, sealed to the present run of this surface; returns whether a second vehicle is
    /// found by it: one vehicle does not answer one hello by two runs.
    pub(super) fn handle_other_hello(&mut self, now: Instant) -> bool {
        self.handle_stranger(now);
        self.answered.is_some_and(|at| now.since(at) < Self::ANSWERS) && self.find(now)
    }

    /// A call was answered: by a second vehicle, if the first one was in contact all the time.
    pub(super) fn handle_call_answer(&mut self, now: Instant) {
        let is_in_contact =
            |(since, last): (Instant, Instant)| now.since(last) < Self::GAP && now.since(since) >= Self::CALLABLE;
        if self.contact.is_some_and(is_in_contact) {
            self.handle_stranger(now);
        }
    }

    /// A new frame of the current run came in; returns whether a second vehicle is found by it.
    pub(super) fn handle_frame(&mut self, now: Instant) -> bool {
        let since = self.contact.filter(|(_, last)| now.since(*last) < Self::GAP).map_or(now, |(since, _)| since);
        self.contact = Some((since, now));
        if self.stranger.take_if(|at| now.since(*at) >= Self::LATE).is_none() {
            return false;
        }
        self.find(now)
    }

    /// A second vehicle is heard; returns whether it was not known before.
    fn find(&mut self, now: Instant) -> bool {
        let was_found = self.is_found(now);
        self.found = Some(now);
        !was_found
    }

    /// Another run has become the current one, perhaps the one that was heard: by a hello, the first vehicle has answered.
    pub(super) fn handle_new_run(&mut self, is_by_hello: bool, now: Instant) {
        (self.contact, self.stranger) = (None, None);
        self.answered = is_by_hello.then_some(now).or(self.answered);
    }

    /// This surface begins a run of its own, which no vehicle has answered.
    pub(super) fn handle_own_run(&mut self) {
        self.answered = None;
    }

    /// Whether two vehicles have this address, as far as is known.
    pub(super) fn is_found(&self, now: Instant) -> bool {
        self.found.is_some_and(|at| now.since(at) < Self::LIFETIME)
    }
}

/// The surface's copy of a vehicle's state at the end of a run, until the copy of a later run has as many cells.
#[derive(Debug)]
pub struct EndedRun<R = Replica> {
    pub(super) replica: R,
    pub(super) layers: Layers,
    pub(super) status: Option<(VehicleStatus, Instant)>,
    pub(super) epoch: Option<u8>,
    pub(super) ended: Instant,
}

impl<R> EndedRun<R> {
    /// The replicated state at its end.
    pub fn replica(&self) -> &R {
        &self.replica
    }

    /// The layers of its map.
    pub fn layers(&self) -> &LayerSet {
        self.layers.set()
    }

    /// A layer of its map, if the vehicle had announced it.
    pub fn layer(&self, id: LayerId) -> Option<&LayerReplica> {
        self.layers.get(id)
    }

    /// The last status of the run, and when its pose came in.
    pub fn status(&self) -> Option<&(VehicleStatus, Instant)> {
        self.status.as_ref()
    }

    /// The epoch of its label ids; `None` if no report had come in.
    pub fn epoch(&self) -> Option<u8> {
        self.epoch
    }

    /// When the surface noticed its end.
    pub fn ended(&self) -> Instant {
        self.ended
    }
}
