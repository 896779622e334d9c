//! The largest `context` chunk that fits.

use super::{LastRow, Reach, head, write};
use crate::map::{LabelGrid, Rect};
use crate::map_codec::MapChunk;
use crate::map_codec::chunk::chunk;
use crate::map_codec::grow::Growth;
use crate::map_codec::window::Patch;

/// The chunk of at most `room` bytes with the most changes found along `growth`; `None` if not even its seed fits.
pub(in crate::map_codec) fn best_chunk(base: &LabelGrid, growth: &Growth, room: usize) -> Option<MapChunk> {
    let try_whole = |i: usize| -> Option<(Patch, Vec<u8>, Reach)> {
        let patch = growth.window.patch(growth.areas[i]).trimmed()?;
        let (bytes, reach) = write_whole(base, &patch, room);
        Some((patch, bytes, reach))
    };
    let (mut fitting, mut too_large) = (None, growth.areas.len());
    let mut short: Option<(Patch, Reach)> = None;
    let mut guess = growth.areas.len() - 1;
    loop {
        let (patch, bytes, reach) = try_whole(guess)?;
        let share = if reach.all { bytes.len() * 100 / room } else { 100 };
        if reach.all {
            fitting = Some((guess, chunk(&patch, bytes)));
        } else {
            too_large = guess;
            short = Some((patch, reach));
        }
        let least = fitting.as_ref().map_or(0, |(i, _)| i + 1);
        if least >= too_large {
            break;
        }
        guess = next_guess(growth, guess, least, too_large, reach, share);
    }
    let (_, mut best) = fitting?;
    if let Some((patch, reach)) = short
        && let Some(longer) = cut(base, &patch, reach, room, growth.seed())
        && longer.changes.len() > best.changes.len()
    {
        best = longer;
    }
    Some(best)
}

/// The next area to try between `least` and `too_large`: where the bits of the last trial say that the room ends.
fn next_guess(growth: &Growth, last: usize, least: usize, too_large: usize, reach: Reach, share: usize) -> usize {
    let cells = growth.areas[last].cells();
    let goal = if reach.all { cells * 100 / share.max(1) } else { reach.cells };
    let by_size = growth.areas.partition_point(|area| area.cells() <= goal).saturating_sub(1);
    by_size.clamp(least, too_large - 1)
}

fn write_whole(base: &LabelGrid, patch: &Patch, room: usize) -> (Vec<u8>, Reach) {
    write(base, &head(base, patch.rect), patch, LastRow(patch.rect.width as usize), room * 8)
}

/// The first rows of `patch`, as many cells as fit; `None` if `seed` is not among them.
fn cut(base: &LabelGrid, patch: &Patch, reach: Reach, room: usize, seed: crate::map::Cell) -> Option<MapChunk> {
    let width = patch.rect.width as usize;
    let mut cells = reach.cells;
    // The head grows by the length of the last row: a few cells fewer may fit.
    for _ in 0..8 {
        let changed = |i: &usize| patch.base.get(*i) != patch.outcome.get(*i);
        let last = (0..cells).rev().find(changed)?;
        cells = last + 1;
        let height = cells.div_ceil(width);
        let mut part = patch.clone();
        part.rect = Rect { height: height as u32, ..patch.rect };
        part.base.truncate(height * width);
        part.outcome.truncate(height * width);
        let tail = part.base.clone();
        part.outcome[cells..].copy_from_slice(&tail[cells..]);
        if !part.rect.contains(seed) || !part.changes().iter().any(|&(cell, _)| cell == seed) {
            return None;
        }
        let last_row = LastRow(cells - (height - 1) * width);
        let (bytes, reach) = write(base, &head(base, part.rect), &part, last_row, room * 8);
        if reach.all {
            return Some(chunk(&part, bytes));
        }
        cells = reach.cells.min(cells - 1);
    }
    None
}
