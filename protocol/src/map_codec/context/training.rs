//! The parameters of the `context` coder: its start state, trained on procedural maps and shipped with the program, and what
//! other programs need to train it or to write another decoder.
//!
//! A training run codes changes with a [`TrainingCoder`], counts how often each decision was `true`, sets the estimates
//! of a [`TrainablePrior`] from the counts, and finally takes over the weights that the coder has learnt.

use super::arith::{BitCoder, Decoder};
use super::canvas::Canvas;
use super::model::Model;
use super::stage::{self, Contexts, INPUTS, SETS, Stage, StageLayout, stored_logit};
pub use super::stage::{BitEstimate, VisitCounts};
use super::{LastRow, decisions, order, read_cells};
use crate::bytes::BitReader;
use crate::grid::{Cell, LabelGrid, Rect};
use crate::map_codec::grow::Lattice;
use crate::map_codec::{DecodeError, LabelRaster};
use std::sync::LazyLock;

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

/// The state of one kind of decision at the start of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StagePrior {
    /// Estimates of the direct contexts one after another, then the start values of the keyed ones.
    pub(super) slots: Vec<BitEstimate>,
    /// Weights of the parallel mixers, in 1/65536.
    pub(super) weights: Vec<[i32; INPUTS]>,
    /// Weights of the final mixer, in 1/65536.
    pub(super) second: Vec<[i32; SETS]>,
    /// Points of the adaptive probability maps, in 1/2^32.
    pub(super) apms: Vec<u32>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Prior {
    pub(super) calm: StagePrior,
    pub(super) flip: StagePrior,
    pub(super) unseen: StagePrior,
    pub(super) label: StagePrior,
}

/// Written by `scenecast-bench train-prior --seed 1 --out prior.bin`. It is part of the wire format:
/// another table makes another coder.
const TABLE: &[u8] = include_bytes!("prior.bin");

static SHIPPED: LazyLock<Prior> = LazyLock::new(|| Prior::from_bytes(TABLE).unwrap_or_else(Prior::blank));

/// Weights are stored in 1/2^12.
const WEIGHT_SHIFT: u32 = 4;

impl Prior {
    /// The prior that both ends share.
    pub(super) fn shipped() -> &'static Self {
        &SHIPPED
    }

    /// A prior without knowledge: every probability is one half.
    pub(super) fn blank() -> Self {
        Self {
            calm: decisions::CALM_LAYOUT.blank(),
            flip: decisions::FLIP_LAYOUT.blank(),
            unseen: decisions::UNSEEN_LAYOUT.blank(),
            label: decisions::LABEL_LAYOUT.blank(),
        }
    }

    /// Reads a table; `None` if it has another layout.
    ///
    /// ```text
    ///      for calm, flip, unseen, label:  estimates x (logit i16, visits u16), weights x i16 / 2^12, maps x logit i16
    /// ```
    /// Little-endian; logits in 1/256 of a factor of two.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut reader = TableReader(bytes);
        let prior = Self {
            calm: reader.stage(&decisions::CALM_LAYOUT)?,
            flip: reader.stage(&decisions::FLIP_LAYOUT)?,
            unseen: reader.stage(&decisions::UNSEEN_LAYOUT)?,
            label: reader.stage(&decisions::LABEL_LAYOUT)?,
        };
        reader.0.is_empty().then_some(prior)
    }

    /// The table that [`Prior::from_bytes`] reads.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let stages = [&self.calm, &self.flip, &self.unseen, &self.label];
        let layouts =
            [&decisions::CALM_LAYOUT, &decisions::FLIP_LAYOUT, &decisions::UNSEEN_LAYOUT, &decisions::LABEL_LAYOUT];
        for (stage, layout) in stages.into_iter().zip(layouts) {
            for slot in &stage.slots {
                out.extend(stored_logit(slot.p).to_le_bytes());
                out.extend(slot.visits.to_le_bytes());
            }
            let used = stage.weights.iter().flat_map(|row| row.iter().take(layout.inputs()));
            for weight in used.chain(stage.second.iter().flatten()) {
                let weight = (weight >> WEIGHT_SHIFT).clamp(i16::MIN.into(), i16::MAX.into()) as i16;
                out.extend(weight.to_le_bytes());
            }
            for &point in &stage.apms {
                out.extend(stored_logit(point).to_le_bytes());
            }
        }
        out
    }
}

struct TableReader<'a>(&'a [u8]);

impl TableReader<'_> {
    fn stage(&mut self, layout: &StageLayout) -> Option<StagePrior> {
        let slots = (0..layout.slots()).map(|_| Some(BitEstimate { p: self.probability()?, visits: self.visits()? }));
        let slots = slots.collect::<Option<_>>()?;
        let weights = (0..layout.rows()).map(|_| self.row(layout.inputs()));
        let weights = weights.collect::<Option<_>>()?;
        let second = (0..layout.apms).map(|_| self.row(SETS)).collect::<Option<_>>()?;
        let apms = (0..layout.apm_points()).map(|_| self.probability()).collect::<Option<_>>()?;
        Some(StagePrior { slots, weights, second, apms })
    }

    fn row<const N: usize>(&mut self, used: usize) -> Option<[i32; N]> {
        let mut row = [0; N];
        for weight in row.iter_mut().take(used) {
            *weight = i32::from(self.number()?) << WEIGHT_SHIFT;
        }
        Some(row)
    }

    fn probability(&mut self) -> Option<u32> {
        Some(stage::probability(i32::from(self.number()?)) << 16 | 0x8000)
    }

    fn number(&mut self) -> Option<i16> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(i16::from_le_bytes(*number))
    }

    fn visits(&mut self) -> Option<u16> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u16::from_le_bytes(*number).min(BitEstimate::MAX_VISITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_table_fits_the_layout() {
        let prior = Prior::from_bytes(TABLE).expect("a table of this layout");
        assert_eq!(prior.to_bytes().len(), TABLE.len());
        assert!(Prior::from_bytes(&TABLE[1..]).is_none());
    }
}
