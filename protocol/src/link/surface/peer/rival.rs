//! Another surface that holds the vehicle, or calls it.

use crate::directive::Series;
use crate::link::HOLDER_SILENCE;
use crate::time::Instant;
use crate::wire::{Introduction, SurfaceName};
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

    /// The vehicle uses a run of this surface; returns whether another one held it before.
    pub(super) fn handle_contact(&mut self) -> bool {
        self.next_call = None;
        let was_held = self.holder.take().is_some();
        if was_held {
            self.caller = None;
        }
        was_held
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
