//! The content of the vehicle's frames: chosen and encoded when a frame is written.

use super::config::OversizedChunk;
use super::in_force::InForceSender;
use super::parts::{Carried, LayerOut, Part};
use super::status::StatusSender;
use crate::directive::{SLOTS, SlotReport};
use crate::map::{ClassSource, StateSource, TreeSource};
use crate::object::{ObjectId, ObjectSender};
use crate::schedule::{BackgroundOrder, BackgroundStream, BitBudget, Class, ClassShares, Shares};
use crate::time::Instant;
use crate::wire::{Backlog, ChunkKind, FrameBuilder, room_for_payload};
use std::time::Duration;

/// The state of the link that a frame reports or depends on.
pub(super) struct FillContext<'a> {
    pub(super) budget: &'a BitBudget,
    /// Decisions about the slots of the directive.
    pub(super) slots: [SlotReport; SLOTS],
    /// Frames that were refused because they were not authentic.
    pub(super) refused_frames: u64,
    pub(super) now: Instant,
}

/// Everything that the vehicle sends, and the shares by which it is chosen.
#[derive(Debug)]
pub(super) struct VehicleContent<S> {
    pub(super) source: S,
    pub(super) classes: ClassSource,
    pub(super) tree: TreeSource,
    pub(super) layers: Vec<LayerOut>,
    pub(super) objects: ObjectSender,
    pub(super) shares: ClassShares,
    pub(super) background: BackgroundOrder,
    pub(super) status: StatusSender,
    pub(super) in_force: InForceSender,
    /// The slots of which the surface has acknowledged a report in this run.
    pub(super) is_told: [bool; SLOTS],
    /// The introduction of another surface that calls, until the surface that holds the vehicle is known to have it.
    pub(super) caller: Option<Vec<u8>>,
    /// Whether the status comes last in the next frame, because it took room from other content in the last one. On a lossy
    /// link with small frames, a status that is due again after each loss would leave no room to the map and its layers.
    is_status_last: bool,
    /// The last chunk that did not fit into the frame it was made for.
    pub(super) oversized: Option<OversizedChunk>,
}

impl<S: StateSource> VehicleContent<S> {
    pub(super) fn new(source: S, shares: Shares, status_period: Duration, now: Instant) -> Self {
        Self {
            source,
            classes: ClassSource::default(),
            tree: TreeSource::default(),
            layers: Vec::new(),
            objects: ObjectSender::default(),
            shares: ClassShares::new(shares),
            background: BackgroundOrder::default(),
            status: StatusSender::new(status_period, now),
            in_force: InForceSender::default(),
            is_told: [false; SLOTS],
            caller: None,
            is_status_last: false,
            oversized: None,
        }
    }

    /// Releases changes that were held back and are due; returns whether there were any.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> bool {
        let mut released = self.source.handle_timeout(now);
        self.layers.iter_mut().for_each(|l| released |= l.source.handle_timeout(now));
        released
    }

    /// Sets whether the surface reads the plainest form of chunks alone.
    pub(super) fn set_plain(&mut self, is_plain: bool) {
        self.source.set_plain(is_plain);
        self.layers.iter_mut().for_each(|l| l.source.set_plain(is_plain));
    }

    /// The surface holds none of our state any more.
    pub(super) fn handle_peer_restart(&mut self, now: Instant) {
        self.source.handle_peer_restart(now);
        self.classes.handle_peer_restart();
        self.tree.handle_peer_restart();
        self.layers.iter_mut().for_each(|l| l.source.handle_peer_restart(now));
        self.objects.handle_peer_restart();
        self.in_force.handle_peer_restart();
        (self.is_told, self.caller) = ([false; SLOTS], None);
        self.status.owe_pose(now);
        self.status.owe_report(now);
    }

    /// Whether the surface is known to hold the replicated state, its layers, and every object but those that are sent last.
    pub(super) fn is_converged(&self) -> bool {
        let is_map_converged = self.source.is_converged() && self.about_labels_is_converged();
        is_map_converged && self.layers().all(StateSource::is_converged) && self.objects.has_only_last()
    }

    /// Whether no content waits that could be sent now.
    pub(super) fn is_idle(&self, budget: &BitBudget, now: Instant) -> bool {
        let is_quiet =
            self.source.is_quiet() && self.about_labels_is_converged() && self.background_is_quiet(budget, now);
        is_quiet && self.objects.has_only_background() && self.in_force.backlog_bytes() == 0
    }

    /// Bytes of names and tree of the labels that may be sent now.
    fn about_labels_backlog(&self) -> usize {
        self.classes.backlog_bytes() + self.tree.backlog_bytes()
    }

    fn about_labels_is_converged(&self) -> bool {
        self.classes.is_converged() && self.tree.is_converged()
    }

    /// When a change that is held back becomes due.
    pub(super) fn next_due(&self) -> Option<Instant> {
        let layers = self.layers().filter_map(StateSource::next_due);
        self.source.next_due().into_iter().chain(layers).min()
    }

    /// The expected backlog, for the operator.
    fn backlog(&self, budget: &BitBudget, now: Instant) -> Backlog {
        let bytes = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let map = self.source.expected_backlog_bytes() + self.about_labels_backlog();
        // People do not wait for what is sent last.
        let background = match self.objects.waits_only_with_last() {
            true => self.background_backlog(budget, now).saturating_sub(self.objects.background_backlog_bytes()),
            false => self.background_backlog(budget, now),
        };
        let others = self.shared_layer_backlog() + self.objects.backlog_bytes() + background;
        Backlog { map_bytes: bytes(map), other_bytes: bytes(others) }
    }

    /// About how many bytes wait and may be sent.
    pub(super) fn backlog_bytes(&self, budget: &BitBudget, now: Instant) -> usize {
        self.urgent_bytes() + self.background_backlog(budget, now)
    }

    /// The same without layers and objects that spare capacity carries.
    pub(super) fn urgent_bytes(&self) -> usize {
        self.source.backlog_bytes()
            + self.about_labels_backlog()
            + self.shared_layer_backlog()
            + self.objects.backlog_bytes()
            + self.in_force.backlog_bytes()
    }

    /// Whether changes of the state or of its layers wait.
    pub(super) fn has_news(&self) -> bool {
        self.source.backlog_bytes() > 0 || self.about_labels_backlog() > 0 || self.shared_layer_backlog() > 0
    }

    /// The fate of a chunk is known; returns the object that is complete with it.
    pub(super) fn handle_fate(&mut self, part: Part<S::Carried>, delivered: bool, now: Instant) -> Option<ObjectId> {
        match part {
            Part::Map(carried) => self.source.handle_fate(carried, delivered, now),
            Part::LabelClass(carried) => self.classes.handle_fate(carried, delivered),
            Part::LabelTree(carried) => self.tree.handle_fate(carried, delivered),
            Part::Layer(id, carried) => {
                if let Some(layer) = self.layer_mut(id) {
                    layer.source.handle_fate(carried, delivered, now);
                }
            }
            Part::InForce(part) => self.in_force.handle_fate(&part, delivered, now),
            Part::Object(id, run) => return self.objects.handle_fate(id, &run, delivered).then_some(id),
            Part::Pose if !delivered => self.status.handle_lost_pose(now),
            Part::Report(_) if !delivered => self.status.handle_lost_report(now),
            Part::Report(slots) => {
                self.is_told.iter_mut().take(slots.end).skip(slots.start).for_each(|told| *told = true)
            }
            Part::Caller if delivered => self.caller = None,
            Part::Pose | Part::LayerDigest(_) | Part::Caller => {}
        }
        None
    }

    /// Fills a frame as far as possible: the shares choose the class, and within a class the
    /// most valuable chunk goes first.
    pub(super) fn fill(&mut self, builder: &mut FrameBuilder, context: &FillContext<'_>) -> Carried<S::Carried> {
        let mut carried = Carried::new();
        if self.is_status_last {
            self.fill_shared(vec![Class::Status], builder, &mut carried, context);
            self.fill_background(builder, &mut carried, context);
        }
        self.fill_shared(Vec::new(), builder, &mut carried, context);
        self.fill_background(builder, &mut carried, context);
        let has_status = carried.iter().any(|(part, _)| part.class() == Class::Status);
        self.is_status_last = has_status && self.has_other_content(context);
        self.fill_digests(builder, &mut carried);
        carried
    }

    /// Whether anything but the status waits.
    fn has_other_content(&self, context: &FillContext<'_>) -> bool {
        let waits = self.waiting(context.now).iter().any(|class| *class != Class::Status);
        waits || self.background_streams(context.budget, context.now).next().is_some()
    }

    /// Fills a frame with the classes that have shares, those in `unfit` excepted.
    fn fill_shared(
        &mut self,
        mut unfit: Vec<Class>,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        context: &FillContext<'_>,
    ) {
        loop {
            let waiting = self.waiting(context.now);
            let candidates: Vec<Class> = waiting.iter().copied().filter(|c| !unfit.contains(c)).collect();
            let Some(class) = self.shares.next(&candidates) else { return };
            let bytes = self.fill_class(class, false, builder, carried, context);
            if bytes == 0 {
                unfit.push(class);
            }
            self.shares.spend(class, bytes, &waiting);
        }
    }

    /// Fills the rest of a frame with background streams.
    fn fill_background(
        &mut self,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        context: &FillContext<'_>,
    ) {
        let mut unfit: Vec<BackgroundStream> = Vec::new();
        loop {
            let next = self.background_streams(context.budget, context.now).find(|s| !unfit.contains(s));
            let Some(stream) = next else { return };
            if self.fill_class(stream.class(), true, builder, carried, context) == 0 {
                unfit.push(stream);
            }
        }
    }

    /// Puts a chunk of a class into a frame; returns its bytes, 0 if none fits.
    fn fill_class(
        &mut self,
        class: Class,
        is_background: bool,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        context: &FillContext<'_>,
    ) -> usize {
        let before = carried.len();
        match class {
            Class::Status => self.fill_status(builder, carried, context),
            Class::Exemplar => self.fill_object(is_background, builder, carried),
            Class::Layer(id) => self.fill_layer(id, builder, carried, context.now),
            _ => self.fill_map(builder, carried, context.now),
        }
        carried.iter().skip(before).map(|(_, n)| n).sum()
    }

    fn waiting(&self, now: Instant) -> Vec<Class> {
        [
            (self.status.is_waiting(now) || self.in_force.backlog_bytes() > 0, Class::Status),
            (self.source.backlog_bytes() > 0 && !self.is_refining() || self.about_labels_backlog() > 0, Class::Map),
            (self.objects.backlog_bytes() > 0, Class::Exemplar),
        ]
        .into_iter()
        .filter_map(|(waits, class)| waits.then_some(class))
        .chain(self.waiting_layers().map(Class::Layer))
        .collect()
    }

    fn fill_status(
        &mut self,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        context: &FillContext<'_>,
    ) {
        let backlog = self.backlog(context.budget, context.now);
        let base_digest = self.source.digest();
        let in_force = self.in_force.digests().summary();
        self.fill_answer(builder, carried);
        let Some(status) = self.status.status_mut() else { return };
        status.backlog = backlog;
        status.in_force = Some(in_force);
        status.base_digest = base_digest;
        status.slots = context.slots;
        status.budget_bps = context.budget.bits_per_s();
        status.refused_frames = context.refused_frames.min(255) as u8;
        if let Some((bytes, slots)) = self.status.fill_report(builder, context.now) {
            carried.push((Part::Report(slots), bytes));
            // It goes with reports: it is news for people, and is sent until one of them arrives.
            if let Some(caller) = self.caller.as_ref().filter(|caller| builder.push(ChunkKind::Caller, caller)) {
                carried.push((Part::Caller, caller.len()));
            }
            self.layers.iter_mut().for_each(|l| l.owes_digest = l.source.is_begun());
        }
        if let Some(bytes) = self.status.fill_pose(builder, context.now) {
            carried.push((Part::Pose, bytes));
        }
    }

    /// Puts a part of the content in force into a frame, if the surface has inquired for one.
    fn fill_answer(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        // The kind takes a byte of the payload.
        let room = room_for_payload(builder.room()).saturating_sub(1);
        let Some((part, bytes)) = self.in_force.next_part(room) else { return };
        if builder.push(ChunkKind::InForce, &bytes) {
            self.in_force.mark_in_flight(&part);
            carried.push((Part::InForce(part), bytes.len()));
        }
    }

    fn fill_object(&mut self, is_background: bool, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        let room = room_for_payload(builder.room());
        let part = if is_background { self.objects.next_background_part(room) } else { self.objects.next_part(room) };
        let Some((id, run, bytes)) = part else { return };
        if builder.push(ChunkKind::Object, &bytes) {
            self.objects.mark_in_flight(id, &run);
            carried.push((Part::Object(id, run), bytes.len()));
        }
    }

    /// Puts a part of the name of a label or of the tree into a frame; returns whether there was one. A frame has one at most, so
    /// that cells do not wait for all of them.
    fn fill_about_labels(
        &mut self,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        now: Instant,
    ) -> bool {
        if carried.iter().any(|(part, _)| matches!(part, Part::LabelClass(_) | Part::LabelTree(_))) {
            return false;
        }
        // The kind takes a byte of the payload.
        let room = room_for_payload(builder.room()).saturating_sub(1);
        let name =
            self.classes.next_chunk(room).map(|(bytes, part)| (ChunkKind::LabelClass, bytes, Part::LabelClass(part)));
        let tree =
            || self.tree.next_chunk(room).map(|(bytes, part)| (ChunkKind::LabelTree, bytes, Part::LabelTree(part)));
        let Some((kind, bytes, part)) = name.or_else(tree) else { return false };
        let fits = builder.push(kind, &bytes);
        match fits {
            true => carried.push((part, bytes.len())),
            false => _ = self.handle_fate(part, false, now),
        }
        fits
    }

    fn fill_map(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>, now: Instant) {
        if self.fill_about_labels(builder, carried, now) {
            return;
        }
        let room = room_for_payload(builder.room());
        let Some((bytes, content)) = self.source.next_chunk(room, now) else { return };
        if builder.push(ChunkKind::Map, &bytes) {
            carried.push((Part::Map(content), bytes.len()));
        } else {
            self.source.handle_fate(content, false, now);
            self.oversized = Some(OversizedChunk { bytes: bytes.len(), room });
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::wire::{AckForm, AckStatement, Address, Header};

    /// A source whose chunks are one byte longer than the room it is given.
    #[derive(Debug, Default)]
    struct TooLong {
        lost: u32,
    }

    impl StateSource for TooLong {
        type Carried = ();

        fn next_chunk(&mut self, room: usize, _now: Instant) -> Option<(Vec<u8>, ())> {
            Some((vec![0; room + 1], ()))
        }

        fn handle_fate(&mut self, (): (), delivered: bool, _now: Instant) {
            self.lost += u32::from(!delivered);
        }

        fn handle_peer_restart(&mut self, _now: Instant) {}

        fn backlog_bytes(&self) -> usize {
            100
        }

        fn is_converged(&self) -> bool {
            false
        }

        fn digest(&self) -> u16 {
            0
        }
    }

    pub(in crate::link::vehicle) fn builder(size: usize) -> FrameBuilder {
        let ack = Some(AckStatement::new(0, vec![], AckForm::Near));
        let header = Header { ack, ..Header::numbered(Address::vehicle(1).unwrap(), Address::SURFACE, 1, 1) };
        FrameBuilder::new(&header, size)
    }

    #[test]
    fn an_oversized_chunk_is_left_out_and_its_content_waits() {
        let (shares, period) = (Shares::default(), Duration::from_secs(60));
        let mut content = VehicleContent::new(TooLong::default(), shares, period, Instant::ZERO);
        let (mut builder, mut carried) = (builder(64), Carried::new());
        let room = room_for_payload(builder.room());
        content.fill_map(&mut builder, &mut carried, Instant::ZERO);
        assert_eq!(content.oversized, Some(OversizedChunk { bytes: room + 1, room }));
        assert_eq!((content.source.lost, carried.len(), room_for_payload(builder.room())), (1, 0, room));
    }

    #[test]
    fn room_in_a_large_frame_ends_at_the_longest_chunk() {
        let mut builder = builder(4000);
        let room = room_for_payload(builder.room());
        assert_eq!(room, 1050);
        assert!(builder.push(ChunkKind::Map, &vec![0; room]));
    }
}
