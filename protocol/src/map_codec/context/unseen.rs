//! The decision whether an unexplored cell stays unexplored.

use super::canvas::Canvas;
use super::stage::{Contexts, MAX_KEYED, StageLayout};
use super::view::{View, magnitude};

pub(super) const LAYOUT: StageLayout = StageLayout {
    name: "unseen",
    direct: &[256, 256, 512, 64, 81, 256, 1024, 144],
    keyed: &[],
    sets: [9, 16, 16],
    apms: 9,
};

/// The length of the current run of explored or unexplored cells along the row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellRun {
    length: usize,
    seen: bool,
}

impl CellRun {
    pub(super) fn note(&mut self, column: usize, seen: bool) {
        self.length = if column > 0 && seen == self.seen { self.length + 1 } else { 1 };
        self.seen = seen;
    }
}

pub(super) fn contexts(canvas: &Canvas, at: usize, place: (usize, usize), view: &View, run: &CellRun) -> Contexts {
    let unseen = view.ring(0);
    let new = view.changed;
    let row = (-3..=3).fold(0, |mask, east| mask << 1 | usize::from(canvas.changed(at, east, -1)));
    let states = [0, 1, 2, 3].map(|i| if new >> i & 1 == 1 { 2 } else { usize::from(view.behind[i] != 0) });
    let edges = usize::from(place.0 == 0)
        | usize::from(place.0 + 1 == canvas.width) << 1
        | usize::from(place.1 == 0) << 2
        | usize::from(place.1 + 1 == canvas.height) << 3;
    let ahead = usize::from(view.ahead[0] != 0) | usize::from(view.ahead[1] != 0) << 1;
    let length = if place.0 == 0 { 0 } else { magnitude(run.length).min(15) };
    Contexts {
        direct: [
            unseen,
            (new & 63) * 4 + ahead,
            row * 4 + (new & 1) + (new >> 4 & 1) * 2,
            edges * 4 + (new & 3),
            states.iter().fold(0, |sum, state| sum * 3 + state),
            length * 16 + (new & 15),
            new & 1023,
            edges * 9 + states[0] * 3 + states[1],
            0,
            0,
        ],
        keyed: [(0, 0); MAX_KEYED],
        sets: [states[0] * 3 + states[1], edges, new & 15],
        apm: states[0] * 3 + states[1],
    }
}
