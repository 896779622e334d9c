//! The index of cells that differ from the state that the surface is known to hold, and of those that go first when the
//! backlog is large.

use super::tiles::TileSet;
use super::value::{Interest, Value, cost};
use super::{Cell, LabelGrid, UNEXPLORED};
use crate::grid::{TILE_CELLS, TileKey, TileLabels};
use crate::map_codec::Stride;
use crate::time::Instant;
use std::collections::BTreeMap;

/// A time in sixteenths of a second.
type Tick = u32;

fn tick(at: Instant) -> Tick {
    (at.as_micros() / 62_500) as Tick
}

fn tick_after(at: Instant) -> Tick {
    at.as_micros().div_ceil(62_500) as Tick
}

fn moment(tick: Tick) -> Instant {
    Instant::from_micros(u64::from(tick) * 62_500)
}

/// When each cell of a tile began to differ, and until when it is held back.
#[derive(Debug, Clone)]
struct Times {
    since: [Tick; TILE_CELLS],
    due: [Tick; TILE_CELLS],
}

#[derive(Debug, Clone)]
struct Tile {
    differing: TileSet,
    /// Cells whose label is not stable yet.
    held: TileSet,
    /// Cells in frames of unknown fate.
    flying: TileSet,
    /// A lower bound of the times at which held cells become due.
    due: Tick,
    /// The value of the waiting cells; `None` if it must be summed again.
    value: Option<Value>,
    times: Box<Times>,
}

impl Default for Tile {
    fn default() -> Self {
        Self {
            differing: TileSet::default(),
            held: TileSet::default(),
            flying: TileSet::default(),
            due: Tick::MAX,
            value: None,
            times: Box::new(Times { since: [0; TILE_CELLS], due: [0; TILE_CELLS] }),
        }
    }
}

impl Tile {
    fn waiting(&self) -> TileSet {
        self.differing.without(&self.held, &self.flying)
    }

    fn since(&self, place: u8) -> Tick {
        self.times.since[usize::from(place)]
    }

    fn due(&self, place: u8) -> Tick {
        self.times.due[usize::from(place)]
    }

    /// Notes whether a cell differs; if it begins to, since `now`.
    fn differ(&mut self, place: u8, differs: bool, afresh: bool, now: Instant) {
        if differs && (afresh || !self.differing.contains(place)) {
            self.times.since[usize::from(place)] = tick(now);
        }
        self.differing.set(place, differs);
    }

    /// Holds a cell back if it is not due yet and `may_wait`.
    fn hold(&mut self, place: u8, may_wait: bool, now: Instant) {
        let due = self.due(place);
        let held = may_wait && self.differing.contains(place) && moment(due) > now;
        self.held.set(place, held);
        if held {
            self.due = self.due.min(due);
        }
    }

    fn counts(&self) -> Counts {
        let held = self.held.without(&self.flying, &TileSet::default()).len();
        let waiting = self.waiting();
        Counts {
            differing: self.differing.len(),
            waiting: waiting.len(),
            waiting_coarse: waiting.on(Stride::Four).len(),
            held,
            flying: self.flying.len(),
        }
    }
}

/// Numbers of cells that differ, of these waiting or held back, and of cells in flight.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) differing: usize,
    pub(super) waiting: usize,
    /// Waiting cells on the coarse lattice.
    pub(super) waiting_coarse: usize,
    pub(super) held: usize,
    pub(super) flying: usize,
}

impl Counts {
    fn replace(&mut self, old: Self, new: Self) {
        self.differing = self.differing - old.differing + new.differing;
        self.waiting = self.waiting - old.waiting + new.waiting;
        self.waiting_coarse = self.waiting_coarse - old.waiting_coarse + new.waiting_coarse;
        self.held = self.held - old.held + new.held;
        self.flying = self.flying - old.flying + new.flying;
    }
}

/// A change of a cell's target label.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellChange {
    /// Whether the new label differs from the one that the surface is known to hold.
    pub(super) differs: bool,
    /// Whether the surface is known to hold any label.
    pub(super) known: bool,
    /// The new label must be stable until then.
    pub(super) due: Instant,
    /// The longest time for which a difference is held back.
    pub(super) longest: std::time::Duration,
}

/// Cells that differ or are in flight, by tile.
///
/// Memory is nine bytes a cell in tiles that hold one.
#[derive(Debug)]
pub(super) struct Dirty {
    tiles: BTreeMap<TileKey, Tile>,
    counts: Counts,
    /// A lower bound of the times at which held cells become due.
    due: Tick,
    /// The lattice on which the tiles' values are computed.
    stride: Stride,
    /// The number of cells inspected so far in choosing the cells to send.
    looked_at: u64,
}

impl Default for Dirty {
    fn default() -> Self {
        Self { tiles: BTreeMap::new(), counts: Counts::default(), due: Tick::MAX, stride: Stride::One, looked_at: 0 }
    }
}

impl Dirty {
    pub(super) fn counts(&self) -> Counts {
        self.counts
    }

    #[cfg(test)]
    pub(super) fn looked_at(&self) -> u64 {
        self.looked_at
    }

    /// Marks every cell of the target as different and none as in flight.
    pub(super) fn reset(&mut self, target: &LabelGrid, now: Instant) {
        (self.tiles, self.counts, self.due) = (BTreeMap::new(), Counts::default(), Tick::MAX);
        for (key, labels) in target.tiles().filter(|(_, labels)| labels.iter().any(|&l| l != UNEXPLORED)) {
            let mut tile = Tile::default();
            tile.times.since.fill(tick(now));
            (0..=u8::MAX).zip(labels).for_each(|(place, &l)| tile.differing.set(place, l != UNEXPLORED));
            self.counts.replace(Counts::default(), tile.counts());
            self.tiles.insert(key, tile);
        }
    }

    /// Handles a change of a cell's target. Returns how many changes will never be sent because of it.
    pub(super) fn change(&mut self, cell: Cell, change: CellChange, now: Instant) -> u64 {
        self.update(cell, |tile, place| {
            let overtaken = tile.held.contains(place) && !tile.flying.contains(place);
            let began = if tile.differing.contains(place) { moment(tile.since(place)) } else { now };
            tile.times.due[usize::from(place)] = tick_after(change.due.min(began + change.longest));
            tile.differ(place, change.differs, false, now);
            tile.hold(place, change.known || tile.flying.contains(place), now);
            u64::from(overtaken) + u64::from(overtaken && !change.differs)
        })
    }

    /// Ends the hold of a cell, because its label is certain.
    pub(super) fn settle(&mut self, cell: Cell) {
        if self.tiles.contains_key(&cell.tile()) {
            self.update(cell, |tile, place| {
                tile.times.due[usize::from(place)] = 0;
                tile.held.set(place, false);
            });
        }
    }

    /// Notes that a cell is in flight.
    pub(super) fn depart(&mut self, cell: Cell) {
        self.update(cell, |tile, place| tile.flying.set(place, true));
    }

    /// Notes that a cell is no longer in flight; `known` is whether the surface holds any label of it.
    pub(super) fn arrive(&mut self, cell: Cell, delivered: bool, differs: bool, known: bool, now: Instant) {
        self.update(cell, |tile, place| {
            tile.flying.set(place, false);
            tile.differ(place, differs, delivered, now);
            tile.hold(place, known, now);
        });
    }

    /// Releases the cells that are due; returns whether there are any.
    pub(super) fn release(&mut self, now: Instant) -> bool {
        if moment(self.due) > now {
            return false;
        }
        let waiting = self.counts.waiting;
        self.due = Tick::MAX;
        for tile in self.tiles.values_mut() {
            if moment(tile.due) <= now {
                let before = tile.counts();
                let held = std::mem::take(&mut tile.held);
                tile.due = Tick::MAX;
                held.iter().for_each(|place| tile.hold(place, true, now));
                self.counts.replace(before, tile.counts());
                tile.value = None;
            }
            self.due = self.due.min(tile.due);
        }
        self.counts.waiting > waiting
    }

    /// Releases all cells that are held back.
    pub(super) fn release_all(&mut self) {
        self.due = Tick::MAX;
        for tile in self.tiles.values_mut().filter(|tile| !tile.held.is_empty()) {
            let before = tile.counts();
            tile.held = TileSet::default();
            tile.due = Tick::MAX;
            tile.value = None;
            self.counts.replace(before, tile.counts());
        }
    }

    /// A lower bound of the times at which held cells become due.
    pub(super) fn next_due(&self) -> Option<Instant> {
        (self.counts.held > 0).then(|| moment(self.due))
    }

    /// Discards all values, because the interest has changed.
    pub(super) fn revalue(&mut self) {
        self.tiles.values_mut().for_each(|tile| tile.value = None);
    }

    /// The waiting cell of a lattice to start from: the most valuable one of the tile with the most value a bit.
    pub(super) fn best(
        &mut self,
        stride: Stride,
        acked: &LabelGrid,
        target: &LabelGrid,
        interest: &Interest,
        now: Instant,
    ) -> Option<Cell> {
        if std::mem::replace(&mut self.stride, stride) != stride {
            self.revalue();
        }
        let now_s = now.as_secs_f64();
        let mut best: Option<(f64, TileKey)> = None;
        for (&key, tile) in &mut self.tiles {
            let value = match tile.value {
                Some(value) => value,
                None => {
                    let value = tile.sum(stride, acked.tile(key), target.tile(key), interest);
                    self.looked_at += TILE_CELLS as u64;
                    *tile.value.insert(value)
                }
            };
            let value = value.per_bit(now_s);
            if value > best.map_or(0.0, |(most, _)| most) {
                best = Some((value, key));
            }
        }
        let (_, key) = best?;
        self.looked_at += TILE_CELLS as u64;
        let tile = self.tiles.get(&key)?;
        let (old, new) = (acked.tile(key), target.tile(key));
        let value = |place: u8| {
            let i = usize::from(place);
            interest.value(old[i], new[i]) * (1.0 + now_s - moment(tile.since(place)).as_secs_f64())
        };
        let first = tile.waiting().on(stride).iter().map(|place| (value(place), place));
        let (_, place) = first.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
        Some(Cell::at(key, place))
    }

    /// A test whether cells wait; it is fast for cells that follow each other along a row.
    pub(super) fn waiting(&self) -> impl Fn(Cell) -> bool + '_ {
        let last = std::cell::Cell::new(None::<(TileKey, TileSet)>);
        move |cell| {
            let key = cell.tile();
            let known = last.get().filter(|(at, _)| *at == key).map(|(_, waiting)| waiting);
            let waiting = known.unwrap_or_else(|| self.tiles.get(&key).map(Tile::waiting).unwrap_or_default());
            last.set(Some((key, waiting)));
            waiting.contains(cell.place())
        }
    }

    /// Changes the state of a cell, and keeps counts, values and the list of tiles consistent.
    fn update<R>(&mut self, cell: Cell, change: impl FnOnce(&mut Tile, u8) -> R) -> R {
        let tile = self.tiles.entry(cell.tile()).or_default();
        let before = tile.counts();
        let result = change(tile, cell.place());
        tile.value = None;
        self.counts.replace(before, tile.counts());
        self.due = self.due.min(tile.due);
        if tile.differing.is_empty() && tile.flying.is_empty() {
            self.tiles.remove(&cell.tile());
        }
        result
    }
}

impl Tile {
    /// The value of the waiting cells of a lattice.
    fn sum(&self, stride: Stride, acked: &TileLabels, target: &TileLabels, interest: &Interest) -> Value {
        let mut value = Value::default();
        for place in self.waiting().on(stride).iter() {
            let i = usize::from(place);
            let since = moment(self.since(place)).as_secs_f64();
            value.add(interest.value(acked[i], target[i]), cost(acked[i]), since);
        }
        value
    }
}

/// The expected cost of a cell of a large backlog in bits; nearly all of these cells are new.
const BITS_PER_CELL: usize = 2;

/// Decides between an overview of the whole map and a detailed part of it.
#[derive(Debug, Default)]
pub(super) struct Coarse {
    /// A larger backlog in bytes goes out coarse to fine; 0 means always, `None` never.
    after_bytes: Option<usize>,
}

impl Coarse {
    pub(super) fn set_limit(&mut self, after_bytes: Option<usize>) {
        self.after_bytes = after_bytes;
    }

    /// Whether the backlog is large while every cell of the coarse lattice is sent or in flight.
    pub(super) fn is_refining(&self, counts: &Counts) -> bool {
        self.is_too_much(counts) && counts.waiting_coarse == 0
    }

    fn is_too_much(&self, counts: &Counts) -> bool {
        self.after_bytes.is_some_and(|most| counts.waiting * BITS_PER_CELL > most.saturating_mul(8))
    }

    /// The lattice of the next chunk: the coarse one while the backlog is large and one of its cells waits.
    pub(super) fn stride(&self, counts: &Counts) -> Stride {
        if self.is_too_much(counts) && counts.waiting_coarse > 0 { Stride::Four } else { Stride::One }
    }
}
