//! The largest `context` chunk that fits.

use super::{LastRow, Reach, head, write};
use crate::map_codec::MapChunk;
use crate::map_codec::chunk::chunk;
use crate::map_codec::grow::{Growth, Lattice};
use crate::map_codec::series::Patch;

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
            (least, best) = (guess + 1, Some(chunk(&patch, bytes)));
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
        best = Some(chunk(&patch, bytes));
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
    if reach.all { Some(chunk(patch, bytes)) } else { cut(base, patch, reach, room) }
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
            return Some(chunk(&part, bytes));
        }
        cells = reach.cells.min(cells - 1);
    }
    None
}
