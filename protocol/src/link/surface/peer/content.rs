//! The surface's copy of a vehicle's state: map, layers, status and objects, and frames whose chunks do not decode here.

use super::status::{ReportedBacklog, StatusParts};
use super::strangers::EndedRun;
use crate::directive::InForcePart;
use crate::link::surface::layers::{LayerOutcome, Layers};
use crate::link::{FrameNumber, LinkStats, SurfaceEvent};
use crate::map::{ClassChunk, ClassReplica, LayerChunk, StateReplica, TextPart, TreeReplica};
use crate::object::{ObjectReceiver, Part, Received};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, Chunk, ChunkKind, Chunks, Introduction, VehicleStatus};
use std::collections::VecDeque;
use std::time::Duration;

/// The result of handling a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChunkOutcome {
    Accepted,
    /// Accepted, and it shows that the two ends hold different states.
    Diverged,
    /// It makes no sense and is dropped.
    Malformed,
    /// It is dropped because it makes no sense with our state, so the two ends hold different ones.
    Contradictory,
}

impl ChunkOutcome {
    pub(super) fn is_accepted(self) -> bool {
        matches!(self, Self::Accepted | Self::Diverged)
    }

    pub(super) fn is_out_of_step(self) -> bool {
        matches!(self, Self::Diverged | Self::Contradictory)
    }
}

/// Replica, layers, objects and status of one vehicle in its current run.
#[derive(Debug)]
pub(super) struct PeerContent<R> {
    pub(super) replica: R,
    pub(super) classes: ClassReplica,
    pub(super) tree: TreeReplica,
    pub(super) layers: Layers,
    pub(super) status: StatusParts,
    pub(super) backlog: Option<ReportedBacklog>,
    pub(super) ended: Option<EndedRun<R>>,
    objects: ObjectReceiver,
    generation: u64,
}

impl<R: StateReplica> PeerContent<R> {
    pub(super) fn new() -> Self {
        Self {
            replica: R::default(),
            classes: ClassReplica::default(),
            tree: TreeReplica::default(),
            layers: Layers::default(),
            status: StatusParts::default(),
            backlog: None,
            ended: None,
            objects: ObjectReceiver::default(),
            generation: 0,
        }
    }

    /// The number of times that the copy was emptied.
    pub(super) fn generation(&self) -> u64 {
        self.generation
    }

    /// The vehicle has begun a new run. The larger of the copies of this run and of an earlier one is kept; returns
    /// whether it is that of this run.
    pub(super) fn end_run(&mut self, now: Instant) -> bool {
        let (replica, layers) = (self.replica.take(), self.layers.take());
        let (epoch, status) = (self.status.epoch(), self.status.whole().cloned());
        let size = replica.size();
        let is_kept = size > 0 && self.ended.as_ref().is_none_or(|ended| ended.replica.size() <= size);
        if is_kept {
            self.ended = Some(EndedRun { replica, layers, epoch, status, ended: now });
        }
        self.objects.clear();
        self.classes = ClassReplica::default();
        self.tree = TreeReplica::default();
        self.status = StatusParts::default();
        self.backlog = None;
        self.generation += 1;
        is_kept
    }

    /// Drops the copy of an ended run if the present one is as large; returns whether it did.
    pub(super) fn overtake(&mut self) -> bool {
        let size = self.replica.size();
        let is_overtaken = self.ended.as_ref().is_some_and(|ended| ended.replica.size() <= size);
        if is_overtaken {
            self.ended = None;
        }
        is_overtaken
    }

    /// Whether every chunk of a frame with this base decodes, or, without a base, of the first frame of a run. Chunks that
    /// only a vehicle receives are skipped.
    pub(super) fn decodes(&self, base: Option<FrameNumber>, chunks: Chunks<'_>) -> bool {
        match base {
            Some(base) => decode(&self.replica, &self.layers, base, chunks),
            None => decode(&R::default(), &Layers::default(), 0, chunks),
        }
    }

    /// Counts changes of the map and its layers.
    pub(super) fn map_version(&self) -> u64 {
        self.replica.version() + self.layers.version()
    }

    /// The vehicle bases its chunks on every frame up to `horizon`.
    pub(super) fn advance_base(&mut self, horizon: FrameNumber) {
        self.replica.advance_base(horizon);
        self.layers.advance_base(horizon);
    }

    /// Applies a chunk of frame `number`, which `stats` has counted.
    pub(super) fn handle_chunk(
        &mut self,
        vehicle: Address,
        number: FrameNumber,
        chunk: &Chunk<'_>,
        stats: &LinkStats,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) -> ChunkOutcome {
        let accepted_if = |sound| if sound { ChunkOutcome::Accepted } else { ChunkOutcome::Malformed };
        match chunk.kind {
            ChunkKind::Map if self.replica.apply(number, chunk.payload, now) => ChunkOutcome::Accepted,
            ChunkKind::Map => ChunkOutcome::Contradictory,
            ChunkKind::Pose => accepted_if(self.status.read_pose(chunk.payload, number, now)),
            ChunkKind::Details => accepted_if(self.status.read_details(chunk.payload, number)),
            ChunkKind::Report => self.handle_report(chunk.payload, stats, now),
            ChunkKind::Object => accepted_if(self.handle_object(vehicle, chunk.payload, events)),
            ChunkKind::Layer => match self.layers.handle_chunk(number, chunk.payload, now) {
                LayerOutcome::Accepted => ChunkOutcome::Accepted,
                LayerOutcome::Skipped => ChunkOutcome::Malformed,
                LayerOutcome::OutOfStep => ChunkOutcome::Contradictory,
            },
            ChunkKind::LabelClass => match self.classes.handle_chunk(chunk.payload) {
                Some(is_complete) => {
                    events.extend(is_complete.then_some(SurfaceEvent::LabelNamed(vehicle)));
                    ChunkOutcome::Accepted
                }
                None => ChunkOutcome::Malformed,
            },
            ChunkKind::LabelTree => match self.tree.handle_chunk(number, chunk.payload) {
                Some(is_complete) => {
                    events.extend(is_complete.then_some(SurfaceEvent::LabelsJoined(vehicle)));
                    ChunkOutcome::Accepted
                }
                None => ChunkOutcome::Malformed,
            },
            ChunkKind::InForce | ChunkKind::Caller => ChunkOutcome::Accepted,
            ChunkKind::Slot | ChunkKind::Introduction | ChunkKind::Inquiry | ChunkKind::NextKey => {
                ChunkOutcome::Malformed
            }
        }
    }

    fn handle_report(&mut self, payload: &[u8], stats: &LinkStats, now: Instant) -> ChunkOutcome {
        if !self.status.read_report(payload) {
            return ChunkOutcome::Malformed;
        }
        let status = self.status.latest();
        self.backlog = Some(ReportedBacklog::new(status.backlog, stats, now));
        match status.base_digest == self.replica.base_digest() {
            true => ChunkOutcome::Accepted,
            false => ChunkOutcome::Diverged,
        }
    }

    fn handle_object(&mut self, vehicle: Address, payload: &[u8], events: &mut VecDeque<SurfaceEvent>) -> bool {
        let Ok(part) = Part::decode(payload) else { return false };
        match self.objects.handle_part(&part) {
            Received::Nothing => {}
            Received::Complete(_, bytes) => events.push_back(SurfaceEvent::Object(vehicle, bytes)),
            Received::Progress(id, held, total) => {
                let head = self.objects.head(id, SurfaceEvent::OBJECT_HEAD).map(<[u8]>::to_vec);
                events.push_back(SurfaceEvent::ObjectProgress { vehicle, head, held, total });
            }
        }
        true
    }
}

/// The class that the bytes of a chunk count as.
pub(super) fn class_of(chunk: &Chunk<'_>) -> Class {
    match chunk.kind {
        ChunkKind::Map | ChunkKind::LabelClass | ChunkKind::LabelTree => Class::Map,
        ChunkKind::Pose | ChunkKind::Details | ChunkKind::Report | ChunkKind::InForce | ChunkKind::Caller => {
            Class::Status
        }
        ChunkKind::Slot | ChunkKind::Inquiry | ChunkKind::NextKey => Class::Directive,
        ChunkKind::Introduction => Class::Overhead,
        ChunkKind::Object => Class::Exemplar,
        ChunkKind::Layer => LayerChunk::decode(chunk.payload).map_or(Class::Overhead, |c| Class::Layer(c.id())),
    }
}

fn decode<R: StateReplica>(replica: &R, layers: &Layers, base: FrameNumber, mut chunks: Chunks<'_>) -> bool {
    chunks.all(|chunk| match chunk.kind {
        ChunkKind::Map => replica.decodes(base, chunk.payload),
        ChunkKind::Pose => VehicleStatus::default().read_pose(chunk.payload).is_ok(),
        ChunkKind::LabelClass => ClassChunk::decode(chunk.payload).is_some(),
        ChunkKind::LabelTree => TextPart::decode(chunk.payload).is_some(),
        ChunkKind::Report => VehicleStatus::default().read_report(chunk.payload).is_ok(),
        ChunkKind::Object => Part::decode(chunk.payload).is_ok(),
        ChunkKind::Layer => layers.decodes(base, chunk.payload),
        ChunkKind::InForce => InForcePart::decode(chunk.payload).is_some(),
        ChunkKind::Caller => Introduction::decode(chunk.payload).is_ok_and(|caller| caller.series.is_some()),
        // A frame counts without the details that are not understood.
        ChunkKind::Details => true,
        ChunkKind::Slot | ChunkKind::Introduction | ChunkKind::Inquiry | ChunkKind::NextKey => true,
    })
}

/// Decides from undecodable frames whether the two ends hold different states.
///
/// A single such frame may be forged or damaged. If the states differ, no map chunk decodes any more.
#[derive(Debug, Default)]
pub(super) struct Divergence {
    /// Undecodable frames since a map chunk was last accepted, at most one in each [`Self::INTERVAL`].
    count: u32,
    last: Option<Instant>,
}

impl Divergence {
    const INTERVAL: Duration = Duration::from_secs(5);
    const CERTAIN: u32 = 3;

    /// Counts an undecodable frame; returns whether the states certainly differ.
    pub(super) fn note_undecodable(&mut self, now: Instant) -> bool {
        if self.last.is_none_or(|at| now.since(at) >= Self::INTERVAL) {
            (self.count, self.last) = (self.count + 1, Some(now));
        }
        self.count >= Self::CERTAIN
    }

    /// A map chunk was accepted, or a new run has begun.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}
