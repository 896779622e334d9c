//! The surface's end of the link.

mod backlog;
mod discovery;
mod grant;
mod peer;
mod planes;
mod polled;
mod pool;
mod turn;
mod view;

pub use polled::Cycle;
pub use view::PeerView;

use crate::directive::{Slot, SlotId, VersionedSlot};
use crate::link::{Authenticity, DropReason, FrameNumber, Transmit};
use crate::mac::{Access, MasterConfig, ModemProfile};
use crate::map::{Replica, StateReplica};
use crate::schedule::{BitBudget, ClassShares, Shares};
use crate::time::Instant;
use crate::wire::{Address, Envelope, MissionId, Seal};
use discovery::Discovery;
use peer::Peer;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;
use turn::{Ready, room_for_slot};

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
    /// Least share of each class while it has something to send.
    pub shares: Shares,
    /// How turns are granted.
    pub master: MasterConfig,
    /// The vehicles to speak with from the beginning.
    pub vehicles: Vec<Address>,
    /// Longest time between two calls for vehicles that are not known; `None`: there are no calls.
    pub call_every: Option<Duration>,
    /// How frames are made authentic, if they are.
    pub authenticity: Option<Authenticity>,
}

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
    /// A vehicle answered a call that nobody had known of.
    VehicleFound(Address),
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
    pub const OBJECT_HEAD: usize = 4;
}

/// A frame that the modem has.
#[derive(Debug, Clone, Copy)]
struct OnAir {
    to: Address,
    number: Option<FrameNumber>,
    /// Whether a turn ends with it.
    last: bool,
}

/// The surface's end of the link: grants turns, holds a replica a vehicle, sends each its directive.
#[derive(Debug)]
pub struct SurfaceLink<R: StateReplica = Replica> {
    config: SurfaceConfig,
    peers: BTreeMap<Address, Peer<R>>,
    budget: BitBudget,
    shares: ClassShares,
    /// Whose turn it is; the surface speaks with one vehicle at a time.
    current: Option<Address>,
    /// What is left of the surface's own turn.
    turn: VecDeque<Ready>,
    in_modem: VecDeque<OnAir>,
    discovery: Discovery,
    cycle: polled::Cycles,
    series: u16,
    random: u64,
    events: VecDeque<SurfaceEvent>,
    /// Frames that no vehicle that we know has sent.
    strangers: u64,
}

impl<R: StateReplica> SurfaceLink<R> {
    /// An end that has met nobody; `seed` is random for each run.
    pub fn new(config: SurfaceConfig, seed: u64, now: Instant) -> Self {
        let mut random = seed;
        let series = crate::random::next(&mut random) as u16;
        let known = !config.vehicles.is_empty();
        let mut link = Self {
            peers: BTreeMap::new(),
            budget: BitBudget::new(config.budget_bps, config.budget_window, now),
            shares: ClassShares::new(config.shares),
            current: None,
            turn: VecDeque::new(),
            in_modem: VecDeque::new(),
            discovery: Discovery::new(config.call_every, known, config.master.max_propagation, now),
            cycle: polled::Cycles::default(),
            series,
            random,
            events: VecDeque::new(),
            strangers: 0,
            config,
        };
        for vehicle in link.config.vehicles.clone() {
            link.add(vehicle, now);
        }
        link
    }

    fn add(&mut self, vehicle: Address, now: Instant) {
        let seed = crate::random::next(&mut self.random);
        let c = &self.config;
        let peer = Peer::new(c.mission, vehicle, c.authenticity.clone(), seed, self.series, c.master, now);
        self.peers.insert(vehicle, peer);
    }

    /// A vehicle as it is known now.
    pub fn vehicle(&self, vehicle: Address) -> Option<PeerView<'_, R>> {
        self.peers.get(&vehicle).map(PeerView)
    }

    /// The vehicles that are known.
    pub fn vehicles(&self) -> impl Iterator<Item = Address> + '_ {
        self.peers.keys().copied()
    }

    /// Frames of this mission that no known vehicle has sent, or that could not be read.
    pub fn strangers(&self) -> u64 {
        self.strangers
    }

    /// Issues a new version of a slot to a vehicle.
    pub fn issue(&mut self, vehicle: Address, slot: Slot, now: Instant) -> Result<u16, IssueError> {
        let seal = Seal::bytes(self.config.authenticity.is_some(), self.config.modem.frame_bytes);
        let room = room_for_slot(self.config.modem.frame_bytes, seal);
        let bytes = VersionedSlot::encode(0, 0, &slot).len();
        if bytes > room {
            return Err(IssueError::TooLarge { bytes, room });
        }
        self.peers.get_mut(&vehicle).map(|p| p.issue(slot, now)).ok_or(IssueError::NoVehicle)
    }

    /// Issues a new version of a slot to several vehicles; each acknowledges and decides for itself.
    pub fn issue_to(&mut self, vehicles: &[Address], slot: &Slot, now: Instant) -> Result<Vec<u16>, IssueError> {
        if vehicles.iter().any(|v| !self.peers.contains_key(v)) {
            return Err(IssueError::NoVehicle);
        }
        vehicles.iter().map(|&v| self.issue(v, slot.clone(), now)).collect()
    }

    /// An earlier run of this end may have sent until `now`: the budget counts as spent.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.budget.assume_spent(now);
    }

    /// Changes the surface's own bit budget.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
    }

    /// The surface's own bit budget.
    pub fn budget_bps(&self) -> u32 {
        self.budget.bits_per_s()
    }

    /// Changes the least shares of the classes.
    pub fn set_shares(&mut self, shares: Shares) {
        self.shares.set(shares);
    }

    /// The least shares of the classes.
    pub fn shares(&self) -> Shares {
        self.shares.shares()
    }

    /// The next thing to tell the host.
    pub fn poll_event(&mut self) -> Option<SurfaceEvent> {
        self.events.pop_front()
    }

    /// Takes received bytes.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let envelope = match Envelope::decode(bytes, |to| to == Address::SURFACE) {
            Ok(envelope) if envelope.header.from.is_vehicle() => envelope,
            Ok(_) => return self.drop_strange(DropReason::Stranger),
            Err(e) => return self.drop_strange(e.into()),
        };
        let from = envelope.header.from;
        let authenticity = self.config.authenticity.as_ref();
        if self.discovery.is_answered_by(&envelope, self.config.mission, authenticity, now) {
            return self.handle_here(from, now);
        }
        let Some(peer) = self.peers.get_mut(&from) else { return self.drop_strange(DropReason::Stranger) };
        peer.handle_frame(&envelope, bytes.len(), &self.config.modem, now, &mut self.events);
        if peer.out_of_step {
            peer.resync(now);
            if self.current == Some(from) && !self.turn.is_empty() {
                // What is left of the turn was written for the run that has ended.
                self.turn.clear();
                match self.in_modem.back_mut() {
                    Some(sent) => sent.last = true,
                    None => peer.master.postpone(now),
                }
            }
            self.events.push_back(SurfaceEvent::MapChanged(from));
        }
        let wait = if peer.pair.is_proven() { Duration::from_secs(2) } else { Duration::ZERO };
        if peer.pair.unstated() > 0 || (peer.pair.is_met() && !peer.pair.is_proven()) {
            peer.answer_due.get_or_insert(now + wait);
        }
    }

    fn handle_here(&mut self, from: Address, now: Instant) {
        match self.peers.get_mut(&from) {
            Some(peer) => peer.master.hurry(now),
            None => {
                self.add(from, now);
                self.events.push_back(SurfaceEvent::VehicleFound(from));
            }
        }
    }

    fn drop_strange(&mut self, reason: DropReason) {
        self.strangers += 1;
        if let Some(first) = self.peers.values_mut().next() {
            first.pair.stats.drop(reason);
        }
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        if let Access::ModemOwned { .. } = self.config.modem.access {
            self.budget.handle_delay(self.in_modem.len(), now);
        }
        let Some(sent) = self.in_modem.pop_front() else { return };
        let Some(peer) = self.peers.get_mut(&sent.to) else { return };
        peer.handle_sent(sent.number, now);
        if sent.last {
            let losable = peer.pair.stats.loss_in.copies(0.03, 8) - 1;
            peer.master.handle_turn_sent(&self.config.modem, losable, now);
            self.cycle.handle_turn_sent();
        }
    }

    /// The modem put `bits` on air beside what it was given, as one that repeats by itself does.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.budget.spend(bits, now);
    }

    /// Puts a frame into the modem.
    fn send(&mut self, ready: Ready, last: bool, now: Instant) -> Transmit {
        let to = ready.transmit.to;
        self.in_modem.push_back(OnAir { to, number: ready.number, last });
        self.budget.spend(self.config.modem.bits_on_air(ready.transmit.bytes.len()), now);
        ready.transmit
    }
}
