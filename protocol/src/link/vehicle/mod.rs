//! The vehicle's end of the link.
//!
//! [`VehicleLink`] joins parts that own their state: `content` (the data to send), `repeat` (copies
//! of the frames of a turn), `timing` (the surface's clock), `hellos` (the answers to hellos and calls). `turn` writes frames, `receive` handles them.

mod config;
mod content;
mod hellos;
mod in_force;
mod layers;
mod parts;
mod receive;
mod repeat;
mod status;
mod timing;
mod turn;

pub use config::{OversizedChunk, VehicleConfig, VehicleEvent};

use super::{LinkPair, LinkStats, SlotInbox, SlotInboxState, Wakeup};
use crate::directive::{Budget, Slot, SlotId, SlotState};
use crate::mac::{Access, Floor};
use crate::map::{
    Cell, ClassEntry, ClassSource, LabelGrid, LabelTree, LayerId, LayerMask, LayerSource, MapSource, StateSource,
};
use crate::object::ObjectId;
use crate::schedule::{BackgroundOrder, BitBudget, Shares};
use crate::time::{ClockMap, Instant};
use crate::wire::{Address, Introduction, UtcHours, VehicleStatus};
use content::VehicleContent;
use hellos::{HelloLimit, ShortReply};
use parts::Carried;
use repeat::{Repeater, TailProbe};
use std::collections::VecDeque;
use std::time::Duration;
use timing::SurfaceTiming;

/// The vehicle's end of the link: replicates a state and the status upward, receives the directive.
#[derive(Debug)]
pub struct VehicleLink<S: StateSource = MapSource> {
    config: VehicleConfig,
    pair: LinkPair<Carried<S::Carried>>,
    budget: BitBudget,
    content: VehicleContent<S>,
    inbox: SlotInbox,
    floor: Floor,
    repeater: Repeater,
    timing: SurfaceTiming,
    reply: ShortReply,
    hello_limit: HelloLimit,
    /// When the surface that holds the vehicle was told of another one.
    told_caller: Option<Instant>,
    probe: TailProbe,
    /// Where the modem decides when to transmit: when an acknowledgement or a hello is due.
    answer_due: Option<Instant>,
    /// When the budget allows the next frame, if it did not allow the last one that was wanted.
    blocked_until: Option<Instant>,
    events: VecDeque<VehicleEvent>,
}

impl<S: StateSource> VehicleLink<S> {
    /// An end without contact that replicates `source`. `seed` must be random for each run; `restored` is the state
    /// that survived the last one.
    pub fn with_source(
        config: VehicleConfig,
        mut source: S,
        seed: u64,
        restored: SlotInboxState,
        now: Instant,
    ) -> Self {
        source.set_quick(config.modem.access == Access::FullDuplex);
        let frame_bytes = config.modem.frame_bytes as u16;
        let (cell_edge, origin) = (config.cell_edge, config.origin);
        let is_full_duplex = config.modem.access == Access::FullDuplex;
        let introduction = Introduction { cell_edge, origin, frame_bytes, is_full_duplex, ..Introduction::default() };
        let (mission, authenticity) = (config.mission, config.authenticity.clone());
        let mut link = Self {
            pair: LinkPair::new(mission, config.address, Address::SURFACE, authenticity, introduction, seed),
            budget: BitBudget::new(config.budget_bps, config.budget_window, now),
            content: VehicleContent::new(source, config.shares, config.status_period, now),
            inbox: SlotInbox::restore(restored),
            floor: Floor::default(),
            repeater: Repeater::default(),
            timing: SurfaceTiming::default(),
            reply: ShortReply::new(seed),
            told_caller: None,
            hello_limit: HelloLimit::new(config.modem.access, now),
            probe: TailProbe::default(),
            answer_due: None,
            blocked_until: None,
            events: VecDeque::new(),
            config,
        };
        link.follow_budget();
        link
    }

    /// The replicated state as the vehicle holds it.
    pub fn source(&self) -> &S {
        &self.content.source
    }

    /// The replicated state, to be changed.
    pub fn source_mut(&mut self) -> &mut S {
        self.repeater.forget();
        &mut self.content.source
    }

    /// Replicates a layer beside the state, from now on; returns `false` if a layer with its index exists.
    pub fn add_layer(&mut self, mut layer: LayerSource) -> bool {
        self.repeater.forget();
        layer.set_quick(self.config.modem.access == Access::FullDuplex);
        self.content.add_layer(layer)
    }

    /// Announces the name and the colour of a label. A label keeps its first name until [`Self::begin_epoch`]: returns whether
    /// this entry is the one that is announced.
    pub fn add_class(&mut self, entry: &ClassEntry) -> bool {
        let waiting = self.content.classes.backlog_bytes();
        let is_first = self.content.classes.add(entry);
        if self.content.classes.backlog_bytes() > waiting {
            self.repeater.forget();
        }
        is_first
    }

    /// Sets the tree of the labels, which replaces the one before; returns whether it is another one.
    pub fn set_tree(&mut self, tree: &LabelTree) -> bool {
        let is_new = self.content.tree.set(tree);
        if is_new {
            self.repeater.forget();
        }
        is_new
    }

    /// The announced names of labels.
    pub fn classes(&self) -> &ClassSource {
        &self.content.classes
    }

    /// The layers that are sent: those that are selected and have a share or are a background stream.
    pub fn layers(&self) -> impl Iterator<Item = &LayerSource> {
        self.content.layers()
    }

    /// Selects the layers that are sent from now on; the others pause, and continue where they were when selected again.
    pub fn select_layers(&mut self, layers: LayerMask) {
        self.repeater.forget();
        self.content.select_layers(layers);
    }

    /// As [`LayerSource::set_coarse_limit`], for each layer.
    pub fn set_coarse_layers(&mut self, after_bytes: Option<usize>) {
        self.content.set_coarse_layers(after_bytes);
    }

    /// Sets quantities of cells of a layer, in its descriptor's unit, if it is replicated.
    pub fn set_layer(&mut self, id: LayerId, cells: impl IntoIterator<Item = (Cell, f64)>, now: Instant) {
        if self.content.layer_mut(id).is_some_and(|layer| layer.source.set(cells, now) > 0) {
            self.repeater.forget();
        }
    }

    /// As [`Self::set_layer`], with levels; 0 for a cell that is not known.
    pub fn set_levels(&mut self, id: LayerId, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) {
        if self.content.layer_mut(id).is_some_and(|layer| layer.source.set_levels(cells, now) > 0) {
            self.repeater.forget();
        }
    }

    /// Whether the surface is known to hold the replicated state, its layers, and every object but those that are sent last.
    pub fn is_converged(&self) -> bool {
        self.content.is_converged()
    }

    /// Sets the clock of this computer, with which that of the surface is compared. Without it, none is.
    pub fn set_clock(&mut self, clock: UtcHours) {
        self.pair.set_clock(clock);
    }

    /// Sets the status to send next; its position and time are those at the moment of the call.
    pub fn set_status(&mut self, status: VehicleStatus) {
        self.content.status.set(status);
    }

    /// Whether a status would go into a frame written now, so that the host should set a current one.
    pub fn wants_status(&self, now: Instant) -> bool {
        self.content.status.is_due(now)
    }

    /// Makes a pose due at once, because the vehicle's behaviour has changed since the last one.
    pub fn owe_pose(&mut self, now: Instant) {
        self.content.status.owe_pose(now);
    }

    /// Queues an object of at most [`crate::object::MAX_OBJECT`] bytes.
    pub fn push_object(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.content.objects.push(bytes)
    }

    /// Queues an object that is sent after all other content; `None` if it is empty or too large.
    pub fn push_last_object(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.content.objects.push_last(bytes)
    }

    /// Queues an object that is sent with spare capacity only ([`crate::schedule::BackgroundStream::Exemplars`]).
    pub fn push_background_object(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.content.objects.push_background(bytes)
    }

    /// Bytes of objects that wait for spare capacity.
    pub fn background_object_bytes(&self) -> usize {
        self.content.objects.background_backlog_bytes()
    }

    /// Stops sending every object, requested or not.
    pub fn cancel_objects(&mut self) {
        self.content.objects.cancel_all();
    }

    /// Stops sending an object; an unknown one is ignored.
    pub fn cancel_object(&mut self, id: ObjectId) {
        self.content.objects.cancel(id);
    }

    /// Counts the budget as spent, because an earlier run of this end may have transmitted until `now`.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.budget.assume_spent(now);
    }

    /// Changes the bit budget; the next report informs the surface.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
        self.follow_budget();
        self.content.status.owe_report(now);
    }

    /// The bit budget in bit/s.
    pub fn budget_bps(&self) -> u32 {
        self.budget.bits_per_s()
    }

    /// Changes the least shares of the classes.
    pub fn set_shares(&mut self, shares: Shares) {
        self.content.shares.set(shares);
        self.follow_budget();
    }

    /// The least shares of the classes.
    pub fn shares(&self) -> Shares {
        self.content.shares.shares()
    }

    /// Changes the background streams and their order.
    pub fn set_background(&mut self, order: BackgroundOrder) {
        self.content.background = order;
        self.follow_budget();
    }

    /// The background streams in their order.
    pub fn background(&self) -> BackgroundOrder {
        self.content.background
    }

    /// Takes the host's decision about the latest version of a slot. The next report, which has the decision, is due at
    /// once; that on a fix is due within the share of reports, because fixes come regularly and nobody waits for them.
    pub fn decide(&mut self, id: SlotId, state: SlotState, now: Instant) {
        self.inbox.decide(id, state);
        match id {
            SlotId::Fix => self.content.status.owe_report_in_share(now),
            _ => self.content.status.owe_report(now),
        }
    }

    /// Reports the content of utility, settings, limits or fence that is in force; `None`: none is. A new vehicle has none,
    /// so its host also calls this for what an earlier run has left in force. The budget follows from the link's own.
    pub fn set_in_force(&mut self, id: SlotId, content: Option<Slot>, now: Instant) {
        let content = content.filter(|slot| slot.id() == id).and_then(Slot::in_force);
        if id != SlotId::Budget && self.content.in_force.set(id, content) {
            self.content.status.owe_report(now);
        }
    }

    /// The content in force of a slot, as the next report states it.
    pub fn in_force(&self, id: SlotId) -> Option<&Slot> {
        self.content.in_force.get(id)
    }

    /// Brings the reported budget up to date.
    pub(super) fn follow_budget(&mut self) {
        let budget = Budget {
            bits_per_s: self.budget.bits_per_s(),
            shares: self.content.shares.shares(),
            background: self.content.background,
        };
        self.content.in_force.set(SlotId::Budget, Some(Slot::Budget(budget)));
    }

    /// The state that must survive a restart.
    pub fn persistent_state(&self) -> &SlotInboxState {
        self.inbox.state()
    }

    /// The host has made [`Self::persistent_state`] durable.
    pub fn handle_persisted(&mut self) {
        if let Some(window) = self.pair.window_mut() {
            window.handle_persisted();
        }
    }

    /// Counters and estimates of the link.
    pub fn stats(&self) -> &LinkStats {
        &self.pair.stats
    }

    /// The surface's clock, once a frame with a stamp was received.
    pub fn surface_clock(&self) -> Option<&ClockMap> {
        self.timing.clock()
    }

    /// When a frame of the surface was last received, in this pair of runs.
    pub fn last_received(&self) -> Option<Instant> {
        self.timing.last_received()
    }

    /// One-way propagation time, as the surface has measured it.
    pub fn one_way(&self) -> Option<Duration> {
        self.timing.one_way()
    }

    /// The next event; the host calls this until it returns `None`.
    #[must_use]
    pub fn poll_event(&mut self) -> Option<VehicleEvent> {
        self.events.pop_front()
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        if self.config.modem.access.is_free() {
            self.budget.handle_delay(self.floor.in_modem() as usize, now);
        }
        self.floor.handle_sent();
    }

    /// The modem put `bits` on air beside those it was given, for example by repeating a frame itself.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.budget.spend(bits, now);
    }

    /// The modem requests `frames` frames of a cycle that begins now ([`crate::mac::Access::Polled`]).
    pub fn handle_poll(&mut self, frames: u32) {
        self.begin_turn();
        self.floor.handle_poll(frames);
    }

    /// Begins a new run toward the surface, which then discards its copy of our state.
    pub fn renew(&mut self, now: Instant) {
        self.pair.renew();
        self.forget_peer(now);
    }

    /// The surface holds none of our state any more.
    fn forget_peer(&mut self, now: Instant) {
        self.content.handle_peer_restart(now);
        self.timing.handle_peer_restart();
        self.probe = TailProbe::default();
        self.repeater.forget();
    }

    /// When [`Self::poll_transmit`] may next have a frame, unless the link waits for the surface.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        self.next_wakeup().map(|at| (at, Wakeup::Turn))
    }
}

impl VehicleLink {
    /// An end without contact that replicates a label map. `seed` must be random for each run; `restored` is the state
    /// that survived the last one.
    pub fn new(
        config: VehicleConfig,
        codec: crate::map_codec::Codec,
        seed: u64,
        restored: SlotInboxState,
        now: Instant,
    ) -> Self {
        Self::with_source(config, MapSource::new(codec), seed, restored, now)
    }

    /// Sets labels of cells (1 to 254, or 0 for unexplored); returns how many changed. Cells that the surface does not
    /// hold yet are sent when there is room.
    pub fn set_map(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        let changed = self.content.source.set(cells, now);
        if changed > 0 {
            self.repeater.forget();
        }
        changed
    }

    /// Empties the map and begins a new run, so that label ids can be assigned again.
    pub fn begin_epoch(&mut self, now: Instant) {
        self.content.source.clear(now);
        self.content.classes.clear();
        self.content.tree.clear();
        self.content.layers.iter_mut().for_each(|l| l.source.clear(now));
        self.renew(now);
        self.cancel_objects();
    }

    /// The map as the vehicle sees it.
    pub fn map(&self) -> &LabelGrid {
        self.content.source.target()
    }

    /// Counts versions of the map.
    pub fn map_version(&self) -> u64 {
        self.content.source.version()
    }
}
