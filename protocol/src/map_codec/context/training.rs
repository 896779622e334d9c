//! What other programs need to train the `context` coder or to write another decoder.
//!
//! A training run codes changes with a [`TrainingCoder`], counts how often each decision was `true`, sets the estimates
//! of a [`TrainablePrior`] from the counts, and finally takes over the weights that the coder has learnt.

use super::arith::{BitCoder, Decoder};
use super::canvas::Canvas;
use super::model::Model;
use super::prior::Prior;
pub use super::stage::{BitEstimate, VisitCounts};
use super::stage::{Contexts, Stage, StageLayout, StagePrior};
use super::{LastRow, order, read_cells};
use crate::bytes::BitReader;
use crate::grid::{Cell, LabelGrid, Rect};
use crate::map_codec::patch::{DecodeError, Lattice};
use crate::map_codec::raster::LabelRaster;

/// Kinds of decision of the coder, each with its own parameters.
pub const STAGES: usize = 4;

/// The start parameters of the coder.
#[derive(Debug, Clone)]
pub struct TrainablePrior(Prior);

impl TrainablePrior {
    /// A prior without knowledge: every probability is one half.
    pub fn blank() -> Self {
        Self(Prior::blank())
    }

    /// The table in the format of `prior.bin`.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.to_bytes()
    }

    /// The estimates of each stage, one for each of its contexts.
    pub fn estimates(&self) -> [&[BitEstimate]; STAGES] {
        [&self.0.calm, &self.0.flip, &self.0.unseen, &self.0.label].map(|stage| &stage.slots[..])
    }

    /// Replaces the estimates; each stage must get as many as [`Self::estimates`] has.
    pub fn set_estimates(&mut self, estimates: [Vec<BitEstimate>; STAGES]) {
        for (stage, estimates) in self.stages().into_iter().zip(estimates) {
            assert_eq!(stage.slots.len(), estimates.len(), "a stage has a fixed number of contexts");
            stage.slots = estimates;
        }
    }

    /// Takes over the weights and correction apms that a coder has learnt.
    pub fn take_weights(&mut self, coder: &mut TrainingCoder) {
        for (stage, prior) in coder.stages().into_iter().zip(self.stages()) {
            stage.teach(prior);
        }
    }

    fn stages(&mut self) -> [&mut StagePrior; STAGES] {
        [&mut self.0.calm, &mut self.0.flip, &mut self.0.unseen, &mut self.0.label]
    }
}

/// A coder that learns from one change and writes no bytes.
#[derive(Debug)]
pub struct TrainingCoder(Model);

impl TrainingCoder {
    /// A coder in the state in which a chunk begins.
    pub fn new(prior: &'static TrainablePrior) -> Self {
        Self(Model::new(&prior.0))
    }

    /// Takes over the weights and correction apms that `before` has learnt.
    pub fn carry_weights(&mut self, before: &Self) {
        self.0.calm.carry(&before.0.calm);
        self.0.flip.carry(&before.0.flip);
        self.0.unseen.carry(&before.0.unseen);
        self.0.label.carry(&before.0.label);
    }

    /// Sets how fast the weights follow, in 1/2^20 of logit times error.
    pub fn set_weight_rate(&mut self, rate: i32) {
        self.stages().into_iter().for_each(|stage| stage.weight_rate = rate);
    }

    /// Counts decisions from now on.
    pub fn count_visits(&mut self) {
        self.stages().into_iter().for_each(|stage| stage.counts = Some(Box::default()));
    }

    /// The decisions that were counted, by stage.
    pub fn take_counts(&mut self) -> [VisitCounts; STAGES] {
        self.stages().map(|stage| *stage.counts.take().unwrap_or_default())
    }

    /// Codes the change from `base` to `target` in `rect`, which must lie inside of `target`.
    pub fn code(&mut self, base: &LabelGrid, target: &LabelRaster, rect: Rect) {
        let mut canvas = Canvas::new(Lattice::whole(base), rect);
        let (width, height) = (rect.width as usize, rect.height as usize);
        for (column, row) in order(width, height, LastRow(width)) {
            let wanted = target.get(column + rect.x as usize, row + rect.y as usize);
            let coded = self.0.code_cell(&mut NoOutput, &mut canvas, (column, row), wanted);
            debug_assert!(coded.is_some());
        }
    }

    fn stages(&mut self) -> [&mut Stage; STAGES] {
        [&mut self.0.calm, &mut self.0.flip, &mut self.0.unseen, &mut self.0.label]
    }
}

struct NoOutput;

impl BitCoder for NoOutput {
    fn code(&mut self, bit: bool, _: u32) -> bool {
        bit
    }
}

/// One decision of the `context` coder, with the names and the order of `WIRE.md`, appendix A.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decision {
    /// The cell that it is about, in steps of the chunk's stride.
    pub cell: Cell,
    /// `calm`, `flip`, `unseen`, `label`, `cleared`, `group` or `bit`; the last three have no contexts.
    pub kind: &'static str,
    /// The values of the direct contexts.
    pub direct: Vec<usize>,
    /// The keys and start values of the keyed contexts.
    pub keyed: Vec<(u32, usize)>,
    /// For each mixer, the number of its set of weights; empty without contexts.
    pub sets: Vec<usize>,
    /// The number of the adaptive probability map; 0 without contexts.
    pub curve: usize,
    /// The probability of yes in 1/65536.
    pub one: u32,
    /// Whether the decision is yes.
    pub is_yes: bool,
}

/// The decisions in the body of a chunk for `rect`.
pub(in super::super) fn trace(
    mut bits: BitReader<'_>,
    base: Lattice<'_>,
    rect: Rect,
) -> Result<Vec<Decision>, DecodeError> {
    let last = LastRow::read(rect.width as usize, &mut bits)?;
    let mut coder = Traced { decoder: Decoder::new(bits), origin: rect, next: None, decisions: Vec::new() };
    read_cells(&mut coder, base, rect, last)?;
    Ok(coder.decisions)
}

struct Traced<'a> {
    decoder: Decoder<'a>,
    origin: Rect,
    next: Option<Decision>,
    decisions: Vec<Decision>,
}

impl BitCoder for Traced<'_> {
    fn code(&mut self, bit: bool, one: u32) -> bool {
        let is_yes = self.decoder.code(bit, one);
        let next = self.next.clone();
        self.decisions.extend(next.map(|decision| Decision { one, is_yes, ..decision }));
        is_yes
    }

    fn begin_cell(&mut self, (column, row): (usize, usize)) {
        let cell = Cell::new(self.origin.x + column as i32, self.origin.y + row as i32);
        let (direct, keyed, sets) = (Vec::new(), Vec::new(), Vec::new());
        self.next = Some(Decision { cell, kind: "", direct, keyed, sets, curve: 0, one: 0, is_yes: false });
    }

    fn begin(&mut self, kind: &'static str, contexts: Option<(&StageLayout, &Contexts)>) {
        let Some(next) = &mut self.next else { return };
        next.kind = kind;
        next.direct =
            contexts.map_or_else(Vec::new, |(of, c)| c.direct.iter().copied().take(of.direct.len()).collect());
        next.keyed = contexts.map_or_else(Vec::new, |(of, c)| c.keyed.iter().copied().take(of.keyed.len()).collect());
        next.sets = contexts.map_or_else(Vec::new, |(_, c)| c.sets.to_vec());
        next.curve = contexts.map_or(0, |(_, c)| c.apm);
    }
}
