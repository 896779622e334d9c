//! The vehicle's end of the link.

mod call;
mod extras;
mod fill;
mod planes;
mod receive;
mod repeat;
mod turn;

use super::{Authenticity, LinkStats, Pair, SlotInbox, SlotInboxState, Wakeup};
use crate::directive::{Slot, SlotId};
use crate::mac::{Access, ClockMap, Floor, ModemProfile};
use crate::map::{Cell, LabelGrid, MapSource, PlaneKind, StateSource};
use crate::object::{ObjectId, ObjectSender, SymbolRun};
use crate::schedule::{BitBudget, Class, ClassShares, Shares, SpendOrder};
use crate::time::Instant;
use crate::wire::{Address, MissionId, SessionId, SlotState, VehicleStatus};
use planes::PlaneOut;
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
    /// Least share of each class while it has something to send.
    pub shares: Shares,
    /// Time between two statuses; longer where the budget is small, so that they take at most a tenth of it.
    pub status_period: Duration,
    /// How frames are made authentic, if they are.
    pub authenticity: Option<Authenticity>,
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
enum Part<C> {
    Map(C),
    Plane(PlaneKind, Vec<(Cell, u8)>),
    PlaneDigest(PlaneKind),
    Object(ObjectId, SymbolRun),
    Pose,
    Report,
}

impl<C> Part<C> {
    fn class(&self) -> Class {
        match self {
            Self::Map(_) => Class::Map,
            Self::Plane(kind, _) | Self::PlaneDigest(kind) => (*kind).into(),
            Self::Object(..) => Class::Exemplar,
            Self::Pose | Self::Report => Class::Status,
        }
    }
}

/// What a frame carried, each with its bytes.
type Carried<C> = Vec<(Part<C>, usize)>;

/// A frame that was sent.
#[derive(Debug)]
struct Said {
    number: u64,
    bytes: Vec<u8>,
}

/// The last frame of the surface that a stamp of ours can name.
#[derive(Debug, Clone, Copy)]
struct HeardLast {
    number: u64,
    at: Instant,
}

/// The vehicle's end of the link: replicates a state and the status upward, receives the directive.
#[derive(Debug)]
pub struct VehicleLink<S: StateSource = MapSource> {
    config: VehicleConfig,
    pair: Pair<Carried<S::Carried>>,
    budget: BitBudget,
    source: S,
    planes: Vec<PlaneOut>,
    objects: ObjectSender,
    shares: ClassShares,
    spend: SpendOrder,
    inbox: SlotInbox,
    status: Option<VehicleStatus>,
    pose_due: Instant,
    report_due: Instant,
    /// Slot that the next report begins with: one that does not fit a frame goes on in the next.
    report_from: usize,
    floor: Floor,
    /// Frames of this turn, to be sent again if nothing else is left to say, or if the surface has not heard the last of them.
    said: VecDeque<Said>,
    said_frames: usize,
    repeats: VecDeque<Vec<u8>>,
    /// Where the modem decides when to speak: when the surface is to have our acknowledgement, or our hello.
    answer_due: Option<Instant>,
    /// The session and nonce of a call that is to be answered.
    called: Option<(SessionId, u64)>,
    /// When the budget allows the next frame, if it did not allow the last one that was wanted.
    blocked_until: Option<Instant>,
    heard: Option<HeardLast>,
    clock: Option<ClockMap>,
    one_way: Option<Duration>,
    /// Seeds the choice of when to answer a call.
    random: u64,
    events: VecDeque<VehicleEvent>,
}

impl<S: StateSource> VehicleLink<S> {
    /// An end that has met nobody and replicates `source`; `seed` is random for each run, `restored` is what survived the
    /// last one.
    pub fn with_source(config: VehicleConfig, source: S, seed: u64, restored: SlotInboxState, now: Instant) -> Self {
        let pair = Pair::new(config.mission, config.address, Address::SURFACE, config.authenticity.clone(), seed);
        Self {
            pair,
            budget: BitBudget::new(config.budget_bps, config.budget_window, now),
            shares: ClassShares::new(config.shares),
            spend: SpendOrder::default(),
            config,
            source,
            planes: Vec::new(),
            objects: ObjectSender::default(),
            inbox: SlotInbox::restore(restored),
            status: None,
            pose_due: now,
            report_due: now,
            report_from: 0,
            floor: Floor::default(),
            said: VecDeque::new(),
            said_frames: 0,
            repeats: VecDeque::new(),
            answer_due: None,
            called: None,
            blocked_until: None,
            heard: None,
            clock: None,
            one_way: None,
            random: seed ^ 0x0CA1_15EA,
            events: VecDeque::new(),
        }
    }

    /// What is replicated.
    pub fn source(&self) -> &S {
        &self.source
    }

    /// What is replicated, to change it.
    pub fn source_mut(&mut self) -> &mut S {
        self.forget_said();
        &mut self.source
    }

    /// Whether the surface is known to hold the replicated state, its planes, and every object.
    pub fn is_settled(&self) -> bool {
        self.source.is_settled() && self.planes().all(StateSource::is_settled) && self.objects.is_empty()
    }

    /// The status to tell next; position and time are the host's at the moment of the call.
    pub fn set_status(&mut self, status: VehicleStatus) {
        self.status = Some(status);
    }

    /// Whether a status would go into a frame written now, so that the host may bring it up to date.
    pub fn wants_status(&self, now: Instant) -> bool {
        now >= self.pose_due.min(self.report_due)
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

    /// An earlier run of this end may have sent until `now`: the budget counts as spent.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.budget.assume_spent(now);
    }

    /// Changes the bit budget; the surface learns of it by the next report.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
        self.owe_report(now);
    }

    /// The bit budget.
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

    /// The vehicle does something else than it said: the next turn begins with a pose.
    pub fn owe_pose(&mut self, now: Instant) {
        self.pose_due = now;
    }

    /// The surface does not know all that a report says.
    fn owe_report(&mut self, now: Instant) {
        (self.report_due, self.report_from) = (now, 0);
    }

    /// The host's decision about the latest version of a slot.
    pub fn decide(&mut self, id: SlotId, state: SlotState, now: Instant) {
        self.inbox.decide(id, state);
        self.owe_report(now);
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

    /// The surface's clock, once a frame with a stamp was heard.
    pub fn surface_clock(&self) -> Option<&ClockMap> {
        self.clock.as_ref()
    }

    /// When a frame of the surface was last taken, in this pair of runs.
    pub fn last_heard(&self) -> Option<Instant> {
        self.heard.map(|h| h.at)
    }

    /// One-way propagation, as the surface has measured it.
    pub fn one_way(&self) -> Option<Duration> {
        self.one_way
    }

    /// The next thing to tell the host.
    pub fn poll_event(&mut self) -> Option<VehicleEvent> {
        self.events.pop_front()
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        if let Access::ModemOwned { .. } = self.config.modem.access {
            self.budget.handle_delay(self.floor.in_modem() as usize, now);
        }
        self.floor.handle_sent();
    }

    /// The modem put `bits` on air beside what it was given, as one that repeats by itself does.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.budget.spend(bits, now);
    }

    /// The modem asks for `frames` frames of a cycle that begins now ([`crate::mac::Access::Polled`]).
    pub fn handle_poll(&mut self, frames: u32) {
        self.begin_turn();
        self.floor.handle_poll(frames);
    }

    /// Begins a new run toward the surface, which then forgets what it has.
    pub fn renew(&mut self, now: Instant) {
        self.pair.renew();
        self.forget_peer(now);
    }

    /// The surface holds nothing of ours any more.
    fn forget_peer(&mut self, now: Instant) {
        self.source.handle_peer_restart(now);
        self.planes.iter_mut().for_each(|p| p.source.handle_peer_restart(now));
        self.objects.handle_peer_restart();
        (self.pose_due, self.heard) = (now, None);
        self.owe_report(now);
        self.forget_said();
    }

    /// When [`Self::poll_transmit`] next may have a frame, if the link is not waiting for the surface.
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        self.next_wakeup().map(|at| (at, Wakeup::Turn))
    }
}

impl VehicleLink {
    /// An end that replicates a label map and has met nobody; `seed` is random for each run, `restored` is what survived the
    /// last one.
    pub fn new(
        config: VehicleConfig,
        codec: crate::map_codec::Codec,
        seed: u64,
        restored: SlotInboxState,
        now: Instant,
    ) -> Self {
        Self::with_source(config, MapSource::new(codec), seed, restored, now)
    }

    /// Sets labels of cells; what the surface does not hold yet is sent when there is room.
    pub fn set_map(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        let changed = self.source.set(cells, now);
        if changed > 0 {
            self.forget_said();
        }
        changed
    }

    /// Label ids start afresh: begins a new run toward the surface, which then forgets the map it has.
    pub fn begin_epoch(&mut self, now: Instant) {
        self.source.clear(now);
        self.planes.iter_mut().for_each(|p| p.source.clear(now));
        self.renew(now);
        self.cancel_objects();
    }

    /// The map as the vehicle sees it.
    pub fn map(&self) -> &LabelGrid {
        self.source.target()
    }

    /// Versions of the map so far.
    pub fn map_version(&self) -> u64 {
        self.source.version()
    }
}
