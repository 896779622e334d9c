//! A patch as a string of decisions: which cells keep their label, and which labels the others get.

use super::arith::BitCoder;
use super::canvas::{Canvas, View};
use super::decisions::{self, CellRun, Recent, Votes};
use super::stage::{Contexts, Stage};
use super::training::Prior;
use crate::grid::{MAX_LABEL, UNEXPLORED};

/// The adaptive state of a chunk, initialised from the prior for each.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub(super) calm: Stage,
    pub(super) flip: Stage,
    pub(super) unseen: Stage,
    pub(super) label: Stage,
    inside: Recent,
    border: Recent,
    run: CellRun,
}

/// Probability, in 1/65536, that a label other than the candidates is unexplored.
const CLEARED: u32 = 1 << 12;

impl Model {
    pub(super) fn new(prior: &'static Prior) -> Self {
        Self {
            calm: Stage::new(&decisions::CALM_LAYOUT, &prior.calm),
            flip: Stage::new(&decisions::FLIP_LAYOUT, &prior.flip),
            unseen: Stage::new(&decisions::UNSEEN_LAYOUT, &prior.unseen),
            label: Stage::new(&decisions::LABEL_LAYOUT, &prior.label),
            inside: Recent::default(),
            border: Recent::default(),
            run: CellRun::default(),
        }
    }

    /// Codes one cell. An encoder takes `wanted` as its new label, a decoder ignores it. `None` if no label is left.
    pub(super) fn code_cell(
        &mut self,
        coder: &mut impl BitCoder,
        canvas: &mut Canvas,
        (column, row): (usize, usize),
        wanted: u8,
    ) -> Option<()> {
        coder.begin_cell((column, row));
        let at = canvas.at(column, row);
        let view = View::of(canvas, at);
        let kept = if view.held == UNEXPLORED {
            let contexts = decisions::unseen_contexts(canvas, at, (column, row), &view, &self.run);
            let kept = decide(&mut self.unseen, coder, &contexts, wanted == view.held);
            self.run.note(column, !kept);
            kept
        } else {
            let kept = self.code_kept(coder, canvas, at, &view, wanted == view.held);
            self.run.note(column, true);
            kept
        };
        if !kept {
            let label = self.code_label(coder, canvas, &view, wanted)?;
            canvas.set(at, label);
        }
        Some(())
    }

    fn code_kept(&mut self, coder: &mut impl BitCoder, canvas: &Canvas, at: usize, view: &View, kept: bool) -> bool {
        let wide = decisions::wider_ring(canvas, at, view.held);
        if wide == 0 && view.ring(view.held) == 255 && view.changed == 0 {
            let contexts = decisions::calm_contexts(view, canvas.noise, &self.inside, &self.border);
            let kept = decide(&mut self.calm, coder, &contexts, kept);
            self.inside.note(kept);
            kept
        } else {
            let contexts = decisions::flip_contexts(canvas, view, wide, &self.inside, &self.border);
            let kept = decide(&mut self.flip, coder, &contexts, kept);
            self.border.note(kept);
            kept
        }
    }

    fn code_label(&mut self, coder: &mut impl BitCoder, canvas: &Canvas, view: &View, wanted: u8) -> Option<u8> {
        let votes = Votes::around(view);
        let in_use = canvas.kinds_beside(view.held);
        for (rank, &(candidate, _)) in votes.ranked().iter().enumerate() {
            let contexts = decisions::label_contexts(view, &votes, candidate, rank, in_use.saturating_sub(rank));
            if decide(&mut self.label, coder, &contexts, wanted == candidate) {
                return Some(candidate);
            }
        }
        let voted = votes.ranked().len();
        for (i, candidate) in decisions::other_labels(canvas, view, &votes).into_iter().enumerate() {
            let contexts =
                decisions::label_contexts(view, &votes, candidate, voted + i, in_use.saturating_sub(voted + i));
            if decide(&mut self.label, coder, &contexts, wanted == candidate) {
                return Some(candidate);
            }
        }
        if view.held != UNEXPLORED && decide_plainly("cleared", coder, CLEARED, wanted == UNEXPLORED) {
            return Some(UNEXPLORED);
        }
        new_label(coder, canvas, view.held, wanted)
    }
}

fn decide(stage: &mut Stage, coder: &mut impl BitCoder, contexts: &Contexts, bit: bool) -> bool {
    let one = stage.predict(contexts);
    coder.begin(stage.layout.name, Some((stage.layout, contexts)));
    let bit = coder.code(bit, one);
    stage.update(bit);
    bit
}

/// A decision with a fixed probability.
fn decide_plainly(kind: &'static str, coder: &mut impl BitCoder, one: u32, bit: bool) -> bool {
    coder.begin(kind, None);
    coder.code(bit, one)
}

/// A label that is not in use around, by its index among those; low ones are more likely.
fn new_label(coder: &mut impl BitCoder, canvas: &Canvas, held: u8, wanted: u8) -> Option<u8> {
    let free = || (1..=MAX_LABEL).filter(|&label| canvas.count(label) == 0 && label != held);
    let place = free().take_while(|&label| label < wanted).count();
    let mut first = 0;
    for (bits, one) in NEW_LABELS {
        if decide_plainly("group", coder, one, place < first + (1 << bits)) {
            let within = place.saturating_sub(first);
            let mut bit = |i: u32| decide_plainly("bit", coder, 1 << 15, within >> i & 1 == 1);
            let offset = (0..bits).rev().fold(0, |n, i| n << 1 | usize::from(bit(i)));
            return free().nth(first + offset);
        }
        first += 1 << bits;
    }
    None
}

/// Groups of new labels: the logarithm of the size, and the probability of this group in 1/65536;
/// the last one is certain.
const NEW_LABELS: [(u32, u32); 6] = [(2, 26_000), (2, 32_000), (3, 45_000), (4, 45_000), (5, 40_000), (8, 65_535)];
