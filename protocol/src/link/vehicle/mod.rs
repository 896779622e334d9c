//! The vehicle's end of the link.

mod fill;

use super::{DropReason, Inbound, LinkStats, Pair, SlotInbox, SlotInboxState, Transmit, Wakeup};
use crate::directive::{Slot, SlotId, VersionedSlot};
use crate::mac::{Grant, ModemProfile};
use crate::map::{Cell, LabelGrid, MapSource, UNEXPLORED};
use crate::map_codec::Codec;
use crate::object::{ObjectId, ObjectSender, SymbolRun};
use crate::schedule::{BitBudget, Class, ClassShares};
use crate::time::Instant;
use crate::wire::{Address, ChunkKind, MissionId, SessionId, SlotState, VehicleStatus};
use std::collections::VecDeque;
use std::time::Duration;

/// Settings of the vehicle's end.
#[derive(Debug, Clone)]
pub struct VehicleConfig {
    /// Own address.
    pub address: Address,
    /// Mission.
    pub mission: MissionId,
    /// The modem.
    pub modem: ModemProfile,
    /// Bits a second on air.
    pub budget_bps: u32,
    /// Window of the budget.
    pub budget_window: Duration,
    /// Map codec.
    pub codec: Codec,
    /// Whether the map is replicated cell by cell; if not, the host sends it otherwise.
    pub replicate_map: bool,
    /// Share of exemplars against the map while both have something to send.
    pub exemplar_share: f64,
    /// Time between two statuses; longer where the budget is small, so that they take at most a tenth of it.
    pub status_period: Duration,
}

/// What the link tells its host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleEvent {
    /// A new version of a slot came in. The host decides about it ([`VehicleLink::decide`]), makes the decision durable, and
    /// confirms that with [`VehicleLink::handle_persisted`]; only then is it acknowledged.
    Slot {
        /// Which slot.
        id: SlotId,
        /// Its version in the surface's series.
        version: u16,
        /// What it says; `None` if it is unreadable and can only be refused.
        content: Option<Slot>,
    },
    /// The surface has all of an object.
    ObjectDelivered(ObjectId),
    /// The surface began a new run; it gets everything afresh.
    SurfaceRestarted,
}

#[derive(Debug)]
enum Part {
    Map(Vec<(Cell, u8)>),
    Object(ObjectId, SymbolRun),
    Status,
}

impl Part {
    fn class(&self) -> Class {
        match self {
            Self::Map(_) => Class::Map,
            Self::Object(..) => Class::Exemplar,
            Self::Status => Class::Status,
        }
    }
}

/// What a frame carried, each with its bytes.
type Carried = Vec<(Part, usize)>;

/// The vehicle's end of the link: replicates the map and status upward, receives the directive.
#[derive(Debug)]
pub struct VehicleLink {
    config: VehicleConfig,
    pair: Pair<Carried>,
    budget: BitBudget,
    map: MapSource,
    worth: [f64; 256],
    objects: ObjectSender,
    shares: ClassShares,
    inbox: SlotInbox,
    status: Option<VehicleStatus>,
    status_due: Instant,
    grant: Option<Grant>,
    on_air: bool,
    /// Learned size of the map stream, bytes a changed cell.
    bytes_per_cell: f64,
    events: VecDeque<VehicleEvent>,
}

impl VehicleLink {
    /// An end that has met nobody; `session` is random for each run, `restored` is what survived the last one.
    pub fn new(config: VehicleConfig, session: SessionId, restored: SlotInboxState, now: Instant) -> Self {
        Self {
            pair: Pair::new(config.mission, config.address, Address::SURFACE, session),
            budget: BitBudget::new(config.budget_bps, config.budget_window, now),
            shares: ClassShares::new(config.exemplar_share),
            config,
            map: MapSource::default(),
            worth: [0.0; 256],
            objects: ObjectSender::default(),
            inbox: SlotInbox::restore(restored),
            status: None,
            status_due: now,
            grant: None,
            on_air: false,
            bytes_per_cell: 1.0,
            events: VecDeque::new(),
        }
    }

    /// Sets labels of cells; what the surface does not hold yet is sent when there is room.
    pub fn set_map(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        self.map.set(cells, now)
    }

    /// Begins a new run toward the surface, which then forgets the map it has: label ids start afresh.
    pub fn renew(&mut self, session: SessionId, now: Instant) {
        self.pair.renew(session);
        let labelled: Vec<Cell> = self.map.target().iter().map(|(cell, _)| cell).collect();
        self.map.set(labelled.into_iter().map(|cell| (cell, UNEXPLORED)), now);
        self.map.handle_peer_restart(now);
        self.objects = ObjectSender::default();
    }

    /// The map as the vehicle sees it.
    pub fn map(&self) -> &LabelGrid {
        self.map.target()
    }

    /// Versions of the map so far.
    pub fn map_version(&self) -> u64 {
        self.map.version()
    }

    /// Whether the surface is known to hold the map, and every object.
    pub fn is_settled(&self) -> bool {
        (self.map.is_settled() || !self.config.replicate_map) && self.objects.is_empty()
    }

    /// What each label is worth to the operator, 0..=1; what differs from his picture goes out in that order.
    pub fn set_interest(&mut self, weight: impl Fn(u8) -> f64) {
        for (label, worth) in self.worth.iter_mut().enumerate() {
            *worth = weight(label as u8).abs().min(1.0);
        }
    }

    /// The status to tell next; position and time are the host's at the moment of the call.
    pub fn set_status(&mut self, status: VehicleStatus) {
        self.status = Some(status);
    }

    /// Whether a status would go into a frame written now, so that the host may bring it up to date.
    pub fn wants_status(&self, now: Instant) -> bool {
        now >= self.status_due
    }

    /// Queues an object for the surface.
    pub fn push_object(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.objects.push(bytes)
    }

    /// Stops sending every object.
    pub fn cancel_objects(&mut self) {
        self.objects.cancel_all();
    }

    /// Stops sending an object.
    pub fn cancel_object(&mut self, id: ObjectId) {
        self.objects.cancel(id);
    }

    /// Changes the bit budget.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
    }

    /// The bit budget.
    pub fn budget_bps(&self) -> u32 {
        self.budget.bits_per_s()
    }

    /// The host's decision about the latest version of a slot.
    pub fn decide(&mut self, id: SlotId, state: SlotState, now: Instant) {
        self.inbox.decide(id, state);
        self.status_due = now;
    }

    /// What must survive a restart.
    pub fn persistent_state(&self) -> &SlotInboxState {
        self.inbox.state()
    }

    /// The host has made [`Self::persistent_state`] durable.
    pub fn handle_persisted(&mut self) {
        if let Some(window) = self.pair.window_mut() {
            window.handle_persisted();
        }
    }

    /// Counters.
    pub fn stats(&self) -> &LinkStats {
        &self.pair.stats
    }

    /// The next thing to tell the host.
    pub fn poll_event(&mut self) -> Option<VehicleEvent> {
        self.events.pop_front()
    }

    /// Takes received bytes.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let inbound = match self.pair.handle_frame(bytes) {
            Ok(inbound) => inbound,
            Err(reason) => {
                // The surface builds on what we never acknowledged: it took us for another run in between.
                if reason == DropReason::NoBase {
                    self.start_afresh(now);
                }
                return;
            }
        };
        if inbound.restarted {
            self.map.handle_peer_restart(now);
            self.objects.handle_peer_restart();
            self.status_due = now;
            self.events.push_back(VehicleEvent::SurfaceRestarted);
        }
        let Inbound { header, fates, number, chunks, .. } = inbound;
        self.handle_fates(fates, now);
        for chunk in chunks {
            match (chunk.kind, number) {
                (ChunkKind::Slot, Some(number)) => self.handle_slot(chunk.payload, number),
                _ => self.pair.stats.drop(DropReason::Malformed),
            }
        }
        if let Some(quarters) = header.turn
            && (number.is_some() || header.hello)
        {
            self.grant = (quarters > 0).then(|| Grant::heard(quarters, header.remaining, &self.config.modem, now));
        }
    }

    fn handle_fates(&mut self, fates: Vec<(Carried, bool)>, now: Instant) {
        for (part, bytes, delivered) in fates.into_iter().flat_map(|(c, d)| c.into_iter().map(move |(p, b)| (p, b, d)))
        {
            if delivered {
                *self.pair.stats.delivered_by_class.entry(part.class()).or_default() += bytes as u64;
            }
            match part {
                Part::Map(changes) => self.map.handle_fate(&changes, delivered, now),
                Part::Object(id, range) => {
                    if self.objects.handle_fate(id, &range, delivered) {
                        self.events.push_back(VehicleEvent::ObjectDelivered(id));
                    }
                }
                Part::Status if !delivered => self.status_due = now,
                Part::Status => {}
            }
        }
    }

    fn handle_slot(&mut self, payload: &[u8], number: u64) {
        match VersionedSlot::decode(payload) {
            Ok(slot) if self.inbox.admit(&slot) => {
                if let Some(window) = self.pair.window_mut() {
                    window.hold_back(number);
                }
                self.events.push_back(VehicleEvent::Slot { id: slot.id, version: slot.version, content: slot.content });
            }
            Ok(_) => {}
            Err(_) => self.pair.stats.drop(DropReason::Malformed),
        }
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self) {
        self.on_air = false;
    }

    /// When [`Self::poll_transmit`] next may have a frame, if the link is not waiting for the surface.
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        let grant = self.grant.filter(|_| !self.on_air)?;
        Some((grant.begins, Wakeup::Turn))
    }

    /// The next frame of the turn, if there is a turn and the budget allows it.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        let grant = self.grant.filter(|g| !self.on_air && now >= g.begins)?;
        let modem = self.config.modem;
        let frame_bits = modem.bits_on_air(modem.frame_bytes);
        let fitting = grant.frames_left(&modem, now);
        let wanted = self.frames_wanted().clamp(1, u32::from(u8::MAX));
        let frames = self.budget.affordable(frame_bits, fitting.min(wanted), now);
        if frames == 0 {
            self.grant = None;
            return None;
        }
        if self.pair.is_full() {
            // The surface has heard nothing for so long that numbers run out.
            self.start_afresh(now);
        }
        let (bytes, last) = self.write_frame(frames, now);
        if last {
            self.grant = None;
        }
        self.on_air = true;
        self.budget.spend(modem.bits_on_air(bytes.bytes.len()), now);
        Some(bytes)
    }

    /// Begins a session that differs from every recent one; the surface gets everything anew.
    fn start_afresh(&mut self, now: Instant) {
        let session = self.pair.own_session().get().wrapping_mul(0x6255).wrapping_add(0x3619);
        self.pair.renew(SessionId::from_random(session));
        self.map.handle_peer_restart(now);
        self.objects.handle_peer_restart();
    }
}
