//! Growing a compact patch around a cell: nested rectangles, each a little larger than the one before.

use super::window::{Area, Window};
use super::{MAX_PATCH_CELLS, MAX_PATCH_SIDE};
use crate::map::{Cell, LabelGrid};

/// Nested areas around the middle of `window`, smallest first; each holds more changes than the one before.
#[derive(Debug)]
pub(super) struct Growth {
    pub(super) window: Window,
    pub(super) areas: Vec<Area>,
}

/// What a lonely change costs at least, bits.
const LONELY_BITS: usize = 4;
/// What a change with another one beside it costs at least, unless it goes on like all its neighbours, bits.
const EDGE_BITS: usize = 1;
/// How far from the patch changes still belong to it, cells.
const HORIZON: usize = 48;
/// The first window reaches this many cells from the seed.
const FIRST_REACH: usize = 40;
/// The last window reaches this many cells from the seed.
const LAST_REACH: usize = 320;

impl Growth {
    /// Grows around `seed` until the changes surely need more than `room` bytes; `None` if `seed` is not to be sent.
    pub(super) fn around(
        base: &LabelGrid,
        target: &LabelGrid,
        seed: Cell,
        room: usize,
        wanted: &dyn Fn(Cell) -> bool,
    ) -> Option<Self> {
        let mut reach = FIRST_REACH;
        loop {
            let window = Window::around(base, target, seed, reach, wanted);
            if !window.is_wanted(reach, reach) {
                return None;
            }
            let (areas, hit_the_edge) = grow(&window, room * 8);
            if !hit_the_edge || reach >= LAST_REACH {
                return Some(Self { window, areas });
            }
            reach *= 2;
        }
    }
}

/// Areas around the middle of the window, and whether the window's edge stopped them.
fn grow(window: &Window, room_bits: usize) -> (Vec<Area>, bool) {
    let middle = window.side / 2;
    let mut area = Area { left: middle, right: middle + 1, bottom: middle, top: middle + 1 };
    let mut areas = vec![area];
    let mut bits = 0;
    let mut hit_the_edge = false;
    while bits <= room_bits {
        let stride = (area.width().max(area.height()) / 8).clamp(1, 8);
        let (Some((larger, more)), cut) = best_step(window, area, stride) else { break };
        hit_the_edge |= cut;
        if larger.cells() > MAX_PATCH_CELLS || larger.width().max(larger.height()) > MAX_PATCH_SIDE {
            break;
        }
        bits += more;
        area = larger;
        areas.push(area);
    }
    let edge = area.left == 0 || area.bottom == 0 || area.right == window.side || area.top == window.side;
    (areas, hit_the_edge || edge)
}

/// The neighbouring strip with the most changes for its cells, at least `stride` thick, and the bits they need at least.
fn best_step(window: &Window, area: Area, stride: usize) -> (Option<(Area, usize)>, bool) {
    let mut cut = false;
    let mut thickness = stride;
    while thickness <= HORIZON {
        let mut best: Option<(Area, usize, u64)> = None;
        for side in 0..4 {
            let (larger, strip) = widened(window, area, side, thickness);
            cut |= strip.cells() < thickness * if side < 2 { area.height() } else { area.width() };
            let (changes, bits) = count(window, strip);
            if changes == 0 {
                continue;
            }
            // Dense strips first, and squat patches before long ones.
            let long = larger.width().max(larger.height()) as u64;
            let worth = (changes as u64 * 1000 / strip.cells() as u64 + 20) * 1000 / long;
            if best.is_none_or(|(_, _, most)| worth > most) {
                best = Some((larger, bits, worth));
            }
        }
        if let Some((larger, bits, _)) = best {
            return (Some((larger, bits)), cut);
        }
        thickness *= 2;
    }
    (None, cut)
}

/// `area` with a strip more on its `side` (0 west, 1 east, 2 south, 3 north), and that strip, within the window.
fn widened(window: &Window, area: Area, side: usize, thickness: usize) -> (Area, Area) {
    let (mut larger, mut strip) = (area, area);
    match side {
        0 => {
            larger.left = area.left.saturating_sub(thickness);
            (strip.left, strip.right) = (larger.left, area.left);
        }
        1 => {
            larger.right = (area.right + thickness).min(window.side);
            (strip.left, strip.right) = (area.right, larger.right);
        }
        2 => {
            larger.bottom = area.bottom.saturating_sub(thickness);
            (strip.bottom, strip.top) = (larger.bottom, area.bottom);
        }
        _ => {
            larger.top = (area.top + thickness).min(window.side);
            (strip.bottom, strip.top) = (area.top, larger.top);
        }
    }
    (larger, strip)
}

/// Changes in the strip, and the bits they need at least.
fn count(window: &Window, strip: Area) -> (usize, usize) {
    let (mut changes, mut bits) = (0, 0);
    for row in strip.bottom..strip.top {
        for column in strip.left..strip.right {
            if window.is_wanted(column, row) {
                changes += 1;
                bits += least_bits(window, column, row);
            }
        }
    }
    (changes, bits)
}

fn least_bits(window: &Window, column: usize, row: usize) -> usize {
    let label = window.outcome(column, row);
    let same = |c: usize, r: usize| window.is_wanted(c, r) && window.outcome(c, r) == label;
    let west = column > 0 && same(column - 1, row);
    let south = row > 0 && same(column, row - 1);
    match (west, south) {
        (true, true) => 0,
        (false, false) => LONELY_BITS,
        _ => EDGE_BITS,
    }
}
