//! The surface's end of the link.

use super::surface_peer::{Peer, SHORT_ACK};
use super::{PeerView, Transmit, Wakeup};
use crate::directive::{Slot, SlotId, VersionedSlot};
use crate::mac::{MasterConfig, ModemProfile};
use crate::schedule::BitBudget;
use crate::time::Instant;
use crate::wire::{Address, MissionId, SessionId};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Settings of the surface's end.
#[derive(Debug, Clone)]
pub struct SurfaceConfig {
    /// Mission.
    pub mission: MissionId,
    /// The modem.
    pub modem: ModemProfile,
    /// Bits a second on air.
    pub budget_bps: u32,
    /// Window of the budget.
    pub budget_window: Duration,
    /// How turns are granted.
    pub master: MasterConfig,
    /// The vehicles to speak with.
    pub vehicles: Vec<Address>,
}

/// Bytes of a frame that a slot can not have: header, turn, a short acknowledgement, chunk header, CRC.
const SLOT_OVERHEAD: usize = 10 + 1 + SHORT_ACK + 3 + 4;

/// Why a slot cannot be issued.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum IssueError {
    /// There is no such vehicle.
    #[error("no such vehicle")]
    NoVehicle,
    /// It does not fit a frame.
    #[error("it takes {bytes} bytes, and a frame has room for {room}: set a larger link.frame_bytes or say less")]
    TooLarge {
        /// Bytes of the slot.
        bytes: usize,
        /// Bytes that fit.
        room: usize,
    },
}

/// What the link tells its host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SurfaceEvent {
    /// The operator's map of a vehicle has changed.
    MapChanged(Address),
    /// A status came in.
    Status(Address),
    /// A vehicle has applied or refused a slot.
    SlotSettled(Address, SlotId),
    /// All of an object came in.
    Object(Address, Vec<u8>),
    /// More of an object came in.
    ObjectProgress {
        /// From whom.
        vehicle: Address,
        /// Its first bytes, once they are held.
        head: Option<Vec<u8>>,
        /// Bytes held.
        held: usize,
        /// Bytes of the whole object.
        total: usize,
    },
    /// A vehicle began a new run; its map starts empty.
    VehicleRestarted(Address),
}

impl SurfaceEvent {
    /// Bytes of an object that [`Self::ObjectProgress`] shows.
    pub const OBJECT_HEAD: usize = 3;
}

/// The surface's end of the link: grants turns, holds a replica a vehicle, sends each its directive.
#[derive(Debug)]
pub struct SurfaceLink {
    config: SurfaceConfig,
    peers: BTreeMap<Address, Peer>,
    budget: BitBudget,
    /// Whose turn it is; the surface speaks with one vehicle at a time.
    current: Option<Address>,
    grant: u8,
    hello: bool,
    on_air: Option<bool>,
    random: u64,
    events: VecDeque<SurfaceEvent>,
}

impl SurfaceLink {
    /// An end that has met nobody; `seed` is random for each run.
    pub fn new(config: SurfaceConfig, seed: u64, now: Instant) -> Self {
        let budget = BitBudget::new(config.budget_bps, config.budget_window, now);
        let mut link = Self {
            peers: BTreeMap::new(),
            budget,
            current: None,
            grant: 0,
            hello: false,
            on_air: None,
            random: seed,
            events: VecDeque::new(),
            config,
        };
        let series = link.draw();
        for vehicle in link.config.vehicles.clone() {
            let own = SessionId::from_random(link.draw());
            let peer = Peer::new(link.config.mission, vehicle, own, series, link.config.master, now);
            link.peers.insert(vehicle, peer);
        }
        link
    }

    /// A vehicle as it is known now.
    pub fn vehicle(&self, vehicle: Address) -> Option<PeerView<'_>> {
        self.peers.get(&vehicle).map(PeerView)
    }

    /// Issues a new version of a slot to a vehicle.
    pub fn issue(&mut self, vehicle: Address, slot: Slot, now: Instant) -> Result<u16, IssueError> {
        let room = self.config.modem.frame_bytes.saturating_sub(SLOT_OVERHEAD);
        let bytes = VersionedSlot::encode(0, 0, &slot).len();
        if bytes > room {
            return Err(IssueError::TooLarge { bytes, room });
        }
        self.peers.get_mut(&vehicle).map(|p| p.issue(slot, now)).ok_or(IssueError::NoVehicle)
    }

    /// Changes the surface's own bit budget.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
    }

    /// The surface's own bit budget.
    pub fn budget_bps(&self) -> u32 {
        self.budget.bits_per_s()
    }

    /// The next thing to tell the host.
    pub fn poll_event(&mut self) -> Option<SurfaceEvent> {
        self.events.pop_front()
    }

    /// Takes received bytes.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let Some(peer) = bytes.get(1).and_then(|b| Address::vehicle(b >> 4)).and_then(|a| self.peers.get_mut(&a))
        else {
            if let Some(first) = self.peers.values_mut().next() {
                first.pair.stats.drop(super::DropReason::Stranger);
            }
            return;
        };
        peer.handle_frame(bytes, &self.config.modem, now, &mut self.events);
        if peer.out_of_step {
            let own = SessionId::from_random(next_random(&mut self.random));
            peer.resync(own, now);
            self.events.push_back(SurfaceEvent::MapChanged(peer.pair.peer()));
        }
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        let last = self.on_air.take() == Some(true);
        if last && let Some(peer) = self.current.and_then(|a| self.peers.get_mut(&a)) {
            peer.master.handle_turn_sent(&self.config.modem, now);
        }
    }

    /// When [`Self::poll_transmit`] next may have a frame by itself.
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        if self.on_air.is_some() {
            return None;
        }
        let busy = self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged());
        let next = match busy {
            Some(peer) => peer.master.next_wakeup(),
            None => self.peers.values().filter_map(|p| p.master.next_wakeup()).min(),
        };
        next.map(|at| (at, Wakeup::Grant))
    }

    /// The next frame of the surface's turn, if it has one and the budget allows it.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        if self.on_air.is_some() {
            return None;
        }
        let speaking = self.current.filter(|a| self.peers.get(a).is_some_and(|p| p.master.is_speaking()));
        let (vehicle, fresh) = match speaking {
            Some(vehicle) => (vehicle, false),
            None => (self.choose(now)?, true),
        };
        let peer = self.peers.get_mut(&vehicle)?;
        let allowed = self.budget.earliest(peer.next_frame_bits(&self.config.modem, now), now);
        if allowed > now {
            peer.master.postpone(allowed);
            return None;
        }
        if fresh {
            self.current = Some(vehicle);
            self.grant = peer.master.grant(&self.config.modem);
            peer.begin_turn(self.grant, now);
            self.hello = says_hello(peer.master.unanswered()) || peer.pair.is_full();
        }
        let (transmit, last) = peer.write_frame(&self.config.modem, self.grant, self.hello, now);
        self.on_air = Some(last);
        self.budget.spend(self.config.modem.bits_on_air(transmit.bytes.len()), now);
        Some(transmit)
    }

    /// The vehicle to speak with next: of those that are due, the one that waited longest.
    fn choose(&self, now: Instant) -> Option<Address> {
        let engaged = self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged());
        if engaged.is_some_and(|p| !p.master.may_speak(false, now)) {
            return None;
        }
        let due = |p: &&Peer| p.master.may_speak(p.outbox.has_backlog(), now);
        self.peers.values().filter(due).min_by_key(|p| (p.master.begun(), p.pair.peer())).map(|p| p.pair.peer())
    }

    fn draw(&mut self) -> u16 {
        next_random(&mut self.random)
    }
}

/// A vehicle that does not answer may have restarted and not know us: every second grant is a hello, and after a while every
/// one, so that the numbers of unheard frames do not run out.
fn says_hello(unanswered: u32) -> bool {
    unanswered >= 2 && (unanswered.is_multiple_of(2) || unanswered >= 16)
}

/// Sixteen bits of a splitmix64 sequence.
fn next_random(state: &mut u64) -> u16 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ z >> 31) as u16
}
