//! A patch as a string of decisions: which cells keep their label, and which labels the others get; and the largest `context`
//! chunk that fits.

use super::arith::BitCoder;
use super::canvas::{Canvas, View};
use super::decisions::{self, CellRun, Recent, Votes};
use super::prior::Prior;
use super::stage::{Contexts, Stage};
use super::{LastRow, Reach, head, write};
use crate::grid::{MAX_LABEL, UNEXPLORED};
use crate::map_codec::grow::Growth;
use crate::map_codec::patch::{Lattice, MapChunk, Patch};

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

/// The chunk of at most `room` bytes with the most changes along `growth`; `None` if not even its seed fits.
///
/// Each trial codes a whole patch, so there are few: at most [`TRIALS`] once one fits.
pub(in crate::map_codec) fn best_chunk(base: Lattice<'_>, growth: &Growth, room: usize) -> Option<MapChunk> {
    let (mut least, mut too_large) = (0, growth.areas.len());
    let mut best: Option<MapChunk> = None;
    let mut short: Option<(Patch, Reach)> = None;
    let mut guess = too_large - 1;
    let mut trials = 0;
    while least < too_large && (best.is_none() || trials < TRIALS) {
        trials += 1;
        let patch = growth.window.patch(growth.areas[guess]).trimmed()?;
        let (bytes, reach) = write_whole(base, &patch, room);
        let cells = growth.areas[guess].cells();
        let goal = if reach.all { cells * room / bytes.len().max(1) } else { reach.cells * 15 / 16 };
        if reach.all {
            let full = bytes.len() * 100 / room;
            (least, best) = (guess + 1, Some(MapChunk::of(&patch, bytes)));
            if full >= FULL_ENOUGH {
                break;
            }
        } else {
            (too_large, short) = (guess, Some((patch, reach)));
        }
        // The size at which the room ends, by the bits of this trial.
        let by_size = growth.areas.partition_point(|area| area.cells() <= goal).saturating_sub(1);
        guess = by_size.clamp(least, too_large.max(least + 1) - 1);
    }
    let best = best?;
    let longer = short.and_then(|(patch, reach)| {
        let part = patch.first_cells(reach.cells.max(1)).changes();
        let is_useful = part.len() > best.changes.len() && part.iter().any(|&(cell, _)| cell == growth.seed());
        if is_useful { cut(base, &patch, reach, room) } else { None }
    });
    let holds_seed = |chunk: &MapChunk| chunk.changes.iter().any(|&(cell, _)| cell == growth.seed());
    Some(longer.filter(|chunk| holds_seed(chunk) && chunk.changes.len() > best.changes.len()).unwrap_or(best))
}

/// A chunk of at most `room` bytes along `growth`, with as many changes as fit if each takes `bytes_per_change`; `None` if not
/// even its seed fits.
pub(in crate::map_codec) fn quick_chunk(
    base: Lattice<'_>,
    growth: &Growth,
    room: usize,
    bytes_per_change: f64,
) -> Option<MapChunk> {
    let aim = (room as f64 * QUICK_FILL / bytes_per_change.max(1e-3)) as usize;
    let mut guess = growth.changes.partition_point(|&changes| changes <= aim).max(1) - 1;
    let mut best: Option<MapChunk> = None;
    for _ in 0..QUICK_TRIALS {
        let patch = growth.window.patch(growth.areas[guess]).trimmed()?;
        let (bytes, reach) = write_whole(base, &patch, room);
        let cells = growth.areas[guess].cells();
        if !reach.all {
            if best.is_some() || guess == 0 {
                break;
            }
            guess = growth.areas.partition_point(|area| area.cells() <= reach.cells * 7 / 8).clamp(1, guess) - 1;
            continue;
        }
        let (length, more) = (bytes.len(), guess + 1 < growth.areas.len());
        best = Some(MapChunk::of(&patch, bytes));
        if !more || length as f64 >= room as f64 * QUICK_ENOUGH {
            break;
        }
        let goal = (cells as f64 * room as f64 * QUICK_FILL / length as f64) as usize;
        let larger = growth.areas.partition_point(|area| area.cells() <= goal).saturating_sub(1);
        if larger <= guess {
            break;
        }
        guess = larger;
    }
    best.or_else(|| best_chunk(base, growth, room))
}

/// The part of the room that a quick chunk is made for, and the part that is enough.
const QUICK_FILL: f64 = 0.92;
const QUICK_ENOUGH: f64 = 0.7;
/// Patches to code for a quick chunk.
const QUICK_TRIALS: usize = 3;

/// Patches to code before one that fits is accepted.
const TRIALS: usize = 4;
/// Percentage of the room that is full enough to stop the search.
const FULL_ENOUGH: usize = 94;

fn write_whole(base: Lattice<'_>, patch: &Patch, room: usize) -> (Vec<u8>, Reach) {
    write(base, &head(base, patch.rect), patch, LastRow(patch.rect.width as usize), room * 8)
}

/// The chunk for the first cells of `patch`, row by row, as many as fit; `None` if no change fits.
pub(in crate::map_codec) fn prefix_chunk(base: Lattice<'_>, patch: &Patch, room: usize) -> Option<MapChunk> {
    let (bytes, reach) = write_whole(base, patch, room);
    if reach.all { Some(MapChunk::of(patch, bytes)) } else { cut(base, patch, reach, room) }
}

/// The chunk for the first `reach.cells` of `patch` or a few less.
fn cut(base: Lattice<'_>, patch: &Patch, reach: Reach, room: usize) -> Option<MapChunk> {
    let width = patch.rect.width as usize;
    let mut cells = reach.cells;
    // The header grows by the length of the last row, so a few cells fewer may fit.
    for _ in 0..8 {
        let changed = |i: &usize| patch.base.get(*i) != patch.outcome.get(*i);
        cells = (0..cells).rev().find(changed)? + 1;
        let part = patch.first_cells(cells);
        let last_row = LastRow(cells - (part.rect.height as usize - 1) * width);
        let (bytes, reach) = write(base, &head(base, part.rect), &part, last_row, room * 8);
        if reach.all {
            return Some(MapChunk::of(&part, bytes));
        }
        cells = reach.cells.min(cells - 1);
    }
    None
}
