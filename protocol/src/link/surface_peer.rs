//! What the surface keeps for one vehicle.

use super::{DropReason, Inbound, LinkStats, Pair, SurfaceEvent, Transmit};
use crate::directive::{Slot, SlotId, SlotOutbox, SlotProgress};
use crate::mac::{Master, MasterConfig, ModemProfile};
use crate::map::Replica;
use crate::object::{ObjectReceiver, Part, Received};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, ChunkKind, FrameBuilder, MissionId, SessionId, VehicleStatus, room_for_payload};
use std::collections::VecDeque;
use std::time::Duration;

/// Bytes of acknowledgement that every frame of the surface has room for.
pub(super) const SHORT_ACK: usize = 6;

/// What a frame to a vehicle carried: versions of slots.
type Carried = Vec<(SlotId, u16, usize)>;

/// A vehicle as the surface knows it.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) pair: Pair<Carried>,
    pub(super) master: Master,
    pub(super) outbox: SlotOutbox,
    replica: Replica,
    objects: ObjectReceiver,
    status: Option<(VehicleStatus, Instant)>,
    heard: Option<Instant>,
    /// Smoothed time between two answered turns.
    interval: Option<Duration>,
    answered: Option<Instant>,
    /// Number of the first frame of the last turn: an answer has judged it.
    turn_began: u64,
    /// Whether the last turn was a hello, which has no number that an answer could name.
    greeted: bool,
    /// The two ends were found to differ: a new session is to be begun.
    pub(super) out_of_step: bool,
}

/// A read-only view of a vehicle for the host.
#[derive(Debug, Clone, Copy)]
pub struct PeerView<'a>(pub(super) &'a Peer);

impl<'a> PeerView<'a> {
    /// The operator's map of this vehicle.
    pub fn replica(&self) -> &'a Replica {
        &self.0.replica
    }

    /// The last status and when it came in.
    pub fn status(&self) -> Option<&'a (VehicleStatus, Instant)> {
        self.0.status.as_ref()
    }

    /// When a frame was last taken.
    pub fn heard(&self) -> Option<Instant> {
        self.0.heard
    }

    /// Time between two answered turns, smoothed.
    pub fn expected_interval(&self) -> Option<Duration> {
        self.0.interval
    }

    /// When the next turn will be granted at the latest; `now` if that is due.
    pub fn next_contact(&self, now: Instant) -> Option<Instant> {
        self.0.master.next_wakeup().map(|at| at.max(now))
    }

    /// Two-way propagation.
    pub fn round_trip(&self) -> Option<Duration> {
        self.0.master.round_trip()
    }

    /// The slots that were issued and how far they have come.
    pub fn slots(&self) -> impl Iterator<Item = &'a SlotProgress> + use<'a> {
        self.0.outbox.progress()
    }

    /// Counters.
    pub fn stats(&self) -> &'a LinkStats {
        &self.0.pair.stats
    }
}

impl Peer {
    pub(super) fn new(
        mission: MissionId,
        vehicle: Address,
        own: SessionId,
        series: u16,
        config: MasterConfig,
        now: Instant,
    ) -> Self {
        Self {
            pair: Pair::new(mission, Address::SURFACE, vehicle, own),
            master: Master::new(config, now),
            outbox: SlotOutbox::new(series),
            replica: Replica::default(),
            objects: ObjectReceiver::default(),
            status: None,
            heard: None,
            interval: None,
            answered: None,
            turn_began: 0,
            greeted: false,
            out_of_step: false,
        }
    }

    /// Takes a frame of this vehicle.
    pub(super) fn handle_frame(
        &mut self,
        bytes: &[u8],
        modem: &ModemProfile,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) {
        let inbound = match self.pair.handle_frame(bytes) {
            Ok(inbound) => inbound,
            Err(reason) => {
                // The vehicle builds on what we never acknowledged: it took us for another run in between.
                self.out_of_step |= reason == DropReason::NoBase;
                return;
            }
        };
        let vehicle = self.pair.peer();
        if inbound.restarted {
            self.replica.clear();
            self.objects.clear();
            self.status = None;
            self.outbox.handle_peer_restart(now);
            events.push_back(SurfaceEvent::VehicleRestarted(vehicle));
        }
        let Inbound { header, fates, number, base, chunks, .. } = inbound;
        for ((id, version, bytes), delivered) in fates.into_iter().flat_map(|(c, d)| c.into_iter().map(move |x| (x, d)))
        {
            if delivered {
                *self.pair.stats.delivered_by_class.entry(Class::Directive).or_default() += bytes as u64;
                self.outbox.mark_heard(id, version, now);
            }
        }
        let Some(number) = number else { return };
        self.heard = Some(now);
        self.measure_interval(now);
        if self.greeted || self.pair.horizon() >= self.turn_began {
            self.master.handle_answer(bytes.len(), header.remaining, header.turn, modem, now);
        }
        self.replica.advance_base(base);
        let version = self.replica.version();
        let mut overhead = bytes.len();
        for chunk in chunks {
            overhead -= chunk.payload.len();
            self.pair.stats.hear(class_of(chunk.kind), chunk.payload.len());
            let sound = match chunk.kind {
                ChunkKind::Map => self.replica.apply(number, chunk.payload, now).is_ok(),
                ChunkKind::Status => self.handle_status(chunk.payload, now, events),
                ChunkKind::Object => self.handle_object(chunk.payload, events),
                ChunkKind::Slot => false,
            };
            if !sound {
                self.pair.stats.drop(DropReason::Malformed);
                self.out_of_step |= chunk.kind == ChunkKind::Map;
            }
        }
        self.pair.stats.hear(Class::Overhead, overhead);
        if self.replica.version() != version {
            events.push_back(SurfaceEvent::MapChanged(vehicle));
        }
    }

    fn measure_interval(&mut self, now: Instant) {
        if let Some(last) = self.answered {
            let gap = now.since(last);
            self.interval =
                Some(self.interval.map_or(gap, |old| if gap > old { (old + gap) / 2 } else { (old * 15 + gap) / 16 }));
        }
        self.answered = Some(now);
    }

    fn handle_status(&mut self, payload: &[u8], now: Instant, events: &mut VecDeque<SurfaceEvent>) -> bool {
        let Ok(status) = VehicleStatus::decode(payload) else { return false };
        if status.base_digest != self.replica.base_digest() {
            self.out_of_step = true;
        }
        let vehicle = self.pair.peer();
        for id in self.outbox.handle_report(&status, now) {
            events.push_back(SurfaceEvent::SlotSettled(vehicle, id));
        }
        self.status = Some((status, now));
        events.push_back(SurfaceEvent::Status(vehicle));
        true
    }

    fn handle_object(&mut self, payload: &[u8], events: &mut VecDeque<SurfaceEvent>) -> bool {
        let Ok(part) = Part::decode(payload) else { return false };
        let vehicle = self.pair.peer();
        events.push_back(match self.objects.handle_part(&part) {
            Received::Complete(_, bytes) => SurfaceEvent::Object(vehicle, bytes),
            Received::Nothing => return true,
            Received::Progress(id, held, total) => {
                let head = self.objects.head(id, SurfaceEvent::OBJECT_HEAD).map(<[u8]>::to_vec);
                SurfaceEvent::ObjectProgress { vehicle, head, held, total }
            }
        });
        true
    }

    /// Issues a new version of a slot.
    pub(super) fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        self.outbox.issue(slot, now)
    }

    /// Bits on air that the next frame of a turn will take at most.
    pub(super) fn next_frame_bits(&self, modem: &ModemProfile, now: Instant) -> u64 {
        let slots = self.outbox.next(modem.frame_bytes, now).is_some() && self.pair.is_met();
        modem.bits_on_air(if slots { modem.frame_bytes } else { modem.frame_bytes.min(40) })
    }

    /// A turn of the surface begins.
    pub(super) fn begin_turn(&mut self, grant: u8, now: Instant) {
        self.outbox.begin_turn();
        self.master.begin(grant, now);
        self.turn_began = self.pair.next_number();
    }

    /// The next frame of the surface's turn and whether it is the last.
    pub(super) fn write_frame(
        &mut self,
        modem: &ModemProfile,
        grant: u8,
        hello: bool,
        now: Instant,
    ) -> (Transmit, bool) {
        let waiting = self.outbox.next(modem.frame_bytes, now).map(|(.., slot)| slot.len());
        let ack_room = waiting.map_or(modem.frame_bytes / 2, |slot| {
            modem.frame_bytes.saturating_sub(slot + 18).clamp(SHORT_ACK, modem.frame_bytes / 2)
        });
        let (mut builder, hello) = self.pair.begin_frame(modem.frame_bytes, ack_room, 0, Some(grant), hello);
        self.greeted = hello;
        let mut carried = Carried::new();
        if !hello {
            self.fill(&mut builder, &mut carried, now);
        }
        let more = !carried.is_empty() && self.outbox.next(modem.frame_bytes, now).is_some();
        builder.set_remaining(u8::from(more));
        let payload: usize = carried.iter().map(|(_, _, n)| n).sum();
        self.pair.stats.count(Class::Directive, payload);
        let kind = if carried.is_empty() { "grant" } else { "directive" };
        let bytes = self.pair.finish_frame(builder, carried, hello, true);
        self.pair.stats.count(Class::Overhead, bytes.len() - payload);
        (Transmit { to: self.pair.peer(), bytes, kind }, !more)
    }

    fn fill(&mut self, builder: &mut FrameBuilder, carried: &mut Carried, now: Instant) {
        while let Some((id, version, bytes)) = self.outbox.next(room_for_payload(builder.room()), now) {
            if !builder.push(ChunkKind::Slot, &bytes) {
                return;
            }
            self.outbox.mark_on_air(id, version, now);
            carried.push((id, version, bytes.len()));
        }
    }

    /// Begins a new run toward the vehicle.
    pub(super) fn resync(&mut self, own: SessionId, now: Instant) {
        self.out_of_step = false;
        self.pair.renew(own);
        self.replica.clear();
        self.objects.clear();
        self.outbox.handle_peer_restart(now);
    }
}

fn class_of(kind: ChunkKind) -> Class {
    match kind {
        ChunkKind::Map => Class::Map,
        ChunkKind::Status => Class::Status,
        ChunkKind::Slot => Class::Directive,
        ChunkKind::Object => Class::Exemplar,
    }
}
