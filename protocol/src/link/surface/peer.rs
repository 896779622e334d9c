//! What the surface keeps for one vehicle.

use super::backlog::Told;
use super::planes::{Heard, Planes};
use crate::directive::{Slot, SlotId, SlotOutbox};
use crate::link::{Authenticity, DropReason, FrameNumber, Pair, SurfaceEvent};
use crate::mac::{Access, ClockMap, Master, MasterConfig, ModemProfile};
use crate::map::{PlaneChunk, StateReplica};
use crate::object::{ObjectReceiver, Part, Received};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{
    Address, Chunk, ChunkKind, Envelope, Header, MissionId, PlannedPath, SlotReport, SlotState, Stamp, VehicleStatus,
};
use std::collections::VecDeque;
use std::time::Duration;

/// What a frame to a vehicle carried: versions of slots, each with its bytes.
pub(super) type Carried = Vec<(SlotId, u16, usize)>;

/// The two chunks of a status, of which one may be here before the other.
#[derive(Debug, Default)]
pub(super) struct StatusParts {
    status: VehicleStatus,
    /// When the pose came in, and in which frame.
    pose: Option<(Instant, FrameNumber)>,
    report: Option<Instant>,
    /// Both are here.
    pub(super) whole: Option<(VehicleStatus, Instant)>,
}

/// A vehicle as the surface knows it.
#[derive(Debug)]
pub(super) struct Peer<R> {
    pub(super) pair: Pair<Carried>,
    pub(super) master: Master,
    pub(super) outbox: SlotOutbox,
    pub(super) replica: R,
    pub(super) planes: Planes,
    objects: ObjectReceiver,
    pub(super) status: StatusParts,
    /// What it had still to send.
    pub(super) told: Option<Told>,
    /// When a frame was last taken.
    pub(super) heard: Option<Instant>,
    pub(super) clock: Option<ClockMap>,
    /// Number of the first frame of the last turn: an answer has judged it.
    pub(super) turn_began: FrameNumber,
    /// Whether the last turn was a hello, which has no number that an answer could name.
    pub(super) greeted: bool,
    /// When frames left the modem, by number: what a stamp of the vehicle refers to.
    sent: VecDeque<(FrameNumber, Instant)>,
    /// Where the modem decides when to speak: when the vehicle is to have our acknowledgement, or our hello.
    pub(super) answer_due: Option<Instant>,
    pub(super) hello_due: Instant,
    pub(super) hellos: u32,
    /// The two ends were found to differ: a new run is to be begun.
    pub(super) out_of_step: bool,
}

impl<R: StateReplica> Peer<R> {
    /// Frames of ours whose end is remembered.
    const SENT: usize = 64;

    pub(super) fn new(
        mission: MissionId,
        vehicle: Address,
        authenticity: Option<Authenticity>,
        seed: u64,
        series: u16,
        config: MasterConfig,
        now: Instant,
    ) -> Self {
        Self {
            pair: Pair::new(mission, Address::SURFACE, vehicle, authenticity, seed),
            master: Master::new(config, now),
            outbox: SlotOutbox::new(series),
            replica: R::default(),
            planes: Planes::default(),
            objects: ObjectReceiver::default(),
            status: StatusParts::default(),
            told: None,
            heard: None,
            clock: None,
            turn_began: 0,
            greeted: false,
            sent: VecDeque::new(),
            answer_due: None,
            hello_due: now,
            hellos: 0,
            out_of_step: false,
        }
    }

    /// Takes a frame of this vehicle.
    pub(super) fn handle_frame(
        &mut self,
        envelope: &Envelope<'_>,
        bytes: usize,
        modem: &ModemProfile,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) {
        let inbound = match self.pair.handle_frame(envelope) {
            Ok(inbound) => inbound,
            Err(reason) => {
                // The vehicle builds on what we never acknowledged, or means another run of ours than we do.
                let silent = matches!(modem.access, Access::ModemOwned { .. }) || self.master.unanswered() >= 2;
                let strays = self.pair.has_lost_touch() && silent;
                self.out_of_step |= reason == DropReason::NoBase || strays;
                return;
            }
        };
        let vehicle = self.pair.peer();
        if inbound.restarted {
            self.forget_peer(now);
            events.push_back(SurfaceEvent::VehicleRestarted(vehicle));
        }
        let header = inbound.header().clone();
        for ((id, version, n), delivered) in
            inbound.fates.iter().flat_map(|(carried, d)| carried.iter().map(move |x| (*x, *d)))
        {
            if delivered {
                self.pair.stats.deliver(id.class(), n, now);
                self.outbox.mark_heard(id, version, now);
            }
        }
        self.out_of_step |= inbound.lacks_base;
        if header.hello {
            self.heard = Some(now);
            self.handle_turn(&header, bytes, modem, now);
            return;
        }
        let Some(number) = inbound.number else { return };
        self.heard = Some(now);
        if inbound.is_latest {
            self.handle_stamp(&header, bytes, modem, now);
            self.handle_turn(&header, bytes, modem, now);
        }
        self.replica.advance_base(inbound.base);
        self.planes.advance_base(inbound.base);
        let version = self.map_version();
        let mut overhead = bytes;
        for chunk in inbound.chunks() {
            overhead = overhead.saturating_sub(chunk.payload.len());
            self.pair.stats.hear(class_of(&chunk), chunk.payload.len(), now);
            let sound = match chunk.kind {
                ChunkKind::Map => self.replica.apply(number, chunk.payload, now),
                ChunkKind::Pose | ChunkKind::Report => {
                    self.status.read(chunk.kind, chunk.payload, number, now)
                        && Self::settle(&mut self.status, &mut self.outbox, vehicle, chunk.kind, now, events)
                }
                ChunkKind::Object => handle_object(&mut self.objects, vehicle, chunk.payload, events),
                ChunkKind::Plane => {
                    let heard = self.planes.handle_chunk(number, chunk.payload, now);
                    self.out_of_step |= heard == Heard::OutOfStep;
                    heard == Heard::Taken
                }
                ChunkKind::Slot => false,
            };
            if !sound {
                self.pair.stats.drop(DropReason::Malformed);
                self.out_of_step |= chunk.kind == ChunkKind::Map;
            }
            if sound && chunk.kind == ChunkKind::Report {
                self.told = Some(Told::new(self.status.status.backlog, &self.pair.stats, now));
                self.out_of_step |= self.status.status.base_digest != self.replica.base_digest();
            }
        }
        self.pair.stats.hear(Class::Overhead, overhead, now);
        if self.map_version() != version {
            events.push_back(SurfaceEvent::MapChanged(vehicle));
        }
    }

    /// Counts changes of the map and its planes.
    pub(super) fn map_version(&self) -> u64 {
        self.replica.version() + self.planes.version()
    }

    fn handle_turn(&mut self, header: &Header, bytes: usize, modem: &ModemProfile, now: Instant) {
        if self.greeted || self.pair.horizon() >= self.turn_began {
            self.master.handle_answer(bytes, header.remaining, header.turn, modem, now);
            self.hellos = 0;
        }
    }

    fn handle_stamp(&mut self, header: &Header, bytes: usize, modem: &ModemProfile, now: Instant) {
        let Some(Stamp::Vehicle { clock_ms, heard, held }) = header.stamp else { return };
        let began = now - modem.airtime(bytes);
        let sent = self.sent.iter().rev().find(|(number, _)| *number as u8 == heard).map(|(_, at)| *at);
        let is_told = held < Stamp::LONGEST_HELD;
        if let Some(sent) = sent.filter(|&at| is_told && at + held <= began) {
            self.master.handle_round_trip(began.since(sent).saturating_sub(held));
        }
        let one_way = self.master.round_trip().unwrap_or_default() / 2;
        self.clock.get_or_insert_default().measure(clock_ms, modem.airtime(bytes) + one_way, now);
    }

    /// A frame of ours has left the modem.
    pub(super) fn handle_sent(&mut self, number: Option<FrameNumber>, now: Instant) {
        let Some(number) = number else { return };
        self.sent.push_back((number, now));
        if self.sent.len() > Self::SENT {
            self.sent.pop_front();
        }
    }

    fn settle(
        parts: &mut StatusParts,
        outbox: &mut SlotOutbox,
        vehicle: Address,
        kind: ChunkKind,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) -> bool {
        if kind == ChunkKind::Report {
            for id in outbox.handle_report(&parts.status, now) {
                events.push_back(SurfaceEvent::SlotSettled(vehicle, id));
            }
        }
        if parts.whole.is_some() {
            events.push_back(SurfaceEvent::Status(vehicle));
        }
        true
    }

    /// Issues a new version of a slot.
    pub(super) fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        self.outbox.issue(slot, now)
    }

    /// Begins a new run toward the vehicle.
    pub(super) fn resync(&mut self, now: Instant) {
        self.out_of_step = false;
        self.pair.renew();
        self.forget_peer(now);
    }

    /// Nothing is known of what the vehicle has or had.
    fn forget_peer(&mut self, now: Instant) {
        self.replica.clear();
        self.planes.clear();
        self.objects.clear();
        self.status = StatusParts::default();
        self.told = None;
        self.sent.clear();
        self.clock = None;
        self.turn_began = 0;
        self.outbox.handle_peer_restart(now);
        self.hello_due = now;
    }

    /// Time after which a slot that was not acknowledged goes out again where the modem decides when to speak.
    pub(super) fn patience(&self) -> Duration {
        self.master.round_trip().unwrap_or(Duration::from_secs(4)) * 2 + Duration::from_secs(4)
    }
}

impl StatusParts {
    fn read(&mut self, kind: ChunkKind, payload: &[u8], number: FrameNumber, now: Instant) -> bool {
        let is_read = match kind {
            ChunkKind::Pose => self.read_pose(payload, number, now),
            _ => self.read_report(payload, now),
        };
        if let (Some((pose, _)), Some(_)) = (self.pose, self.report) {
            self.whole = Some((self.status.clone(), pose));
        }
        is_read
    }

    /// A pose that a newer one has overtaken is of no use.
    fn read_pose(&mut self, payload: &[u8], number: FrameNumber, now: Instant) -> bool {
        let mut read = self.status.clone();
        let is_read = read.read_pose(payload).is_ok();
        if is_read && self.pose.is_none_or(|(_, before)| before < number) {
            (self.status, self.pose) = (read, Some((now, number)));
        }
        is_read
    }

    fn read_report(&mut self, payload: &[u8], now: Instant) -> bool {
        let before = self.status.slots;
        let is_read = self.status.read_report(payload).is_ok();
        if is_read {
            self.report = Some(now);
        }
        let newly = |(id, before): (SlotId, SlotReport)| {
            let slot = self.status.slot(id);
            id.steers() && slot != before && slot.state == SlotState::Applied
        };
        if SlotId::ALL.into_iter().zip(before).any(newly) {
            // The way was chosen before that; the pose that tells the new one is still to come.
            (self.status.waypoint, self.status.path) = (None, PlannedPath::default());
        }
        is_read
    }
}

fn handle_object(
    objects: &mut ObjectReceiver,
    vehicle: Address,
    payload: &[u8],
    events: &mut VecDeque<SurfaceEvent>,
) -> bool {
    let Ok(part) = Part::decode(payload) else { return false };
    events.push_back(match objects.handle_part(&part) {
        Received::Nothing => return true,
        Received::Complete(_, bytes) => SurfaceEvent::Object(vehicle, bytes),
        Received::Progress(id, held, total) => {
            let head = objects.head(id, SurfaceEvent::OBJECT_HEAD).map(<[u8]>::to_vec);
            SurfaceEvent::ObjectProgress { vehicle, head, held, total }
        }
    });
    true
}

fn class_of(chunk: &Chunk<'_>) -> Class {
    match chunk.kind {
        ChunkKind::Map => Class::Map,
        ChunkKind::Pose | ChunkKind::Report => Class::Status,
        ChunkKind::Slot => Class::Directive,
        ChunkKind::Object => Class::Exemplar,
        ChunkKind::Plane => PlaneChunk::decode(chunk.payload).map_or(Class::Overhead, |c| c.kind().into()),
    }
}
