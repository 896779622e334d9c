//! The part of the vehicle's state that waits for the disk, and the cells that are not sent before it is stored.

use crate::{MapChanges, SharedExemplars};
use scenecast_protocol::directive::{Slot, SlotId, SlotState};
use scenecast_protocol::link::SlotInboxState;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::DiskReport;
use std::time::Duration;

/// Time after which a state that the disk has refused is given to it again.
const RETRY_INTERVAL: Duration = Duration::from_secs(10);

/// The state of the host's disk, for the reports of the vehicle. Refusals of the journal are not part of it: see
/// [`super::Vehicle::handle_persist_failed`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VehicleDisk {
    /// Bytes that may still be written; `None` if that is unknown.
    pub free_bytes: Option<u64>,
    /// Whether the last checkpoint of the scene model could not be written.
    pub is_checkpoint_refused: bool,
}

/// An order that waits until the disk has taken a record, so that it can be refused if the disk does not.
#[derive(Debug)]
pub(super) struct WaitingOrder {
    pub(super) id: SlotId,
    pub(super) version: u16,
    pub(super) content: Option<Slot>,
    pub(super) at: Instant,
}

/// A decision in force, and when it was made.
pub(super) type UnreportedDecision = (SlotId, SlotState, Instant);

/// Knows which labels are on the disk, and keeps whatever waits for it.
#[derive(Debug, Default)]
pub(super) struct Storing {
    orders: Vec<WaitingOrder>,
    /// Decisions in force that are reported once they are on the disk.
    decisions: Vec<UnreportedDecision>,
    /// The map of the next epoch, and when it changed last.
    next_map: Option<(MapChanges, Instant)>,
    /// Exemplars that may be of labels that are not on the disk, and when they came.
    exemplars: Option<(SharedExemplars, Instant)>,
    /// The epoch on the disk, and its highest label.
    epoch: u8,
    labels: u8,
    /// When the refused state is given to the disk again; `None` while the disk takes everything.
    retry_at: Option<Instant>,
    refusals: u64,
    /// `None` if the host has no files.
    disk: Option<VehicleDisk>,
}

impl Storing {
    pub(super) fn new(epoch: u8, labels: u8) -> Self {
        Self { epoch, labels, ..Self::default() }
    }

    /// The epoch of the labels that are sent.
    pub(super) fn epoch(&self) -> u8 {
        self.epoch
    }

    /// The highest label on the disk.
    pub(super) fn labels(&self) -> u8 {
        self.labels
    }

    /// The number of times that the disk has refused the state.
    pub(super) fn refusals(&self) -> u64 {
        self.refusals
    }

    pub(super) fn is_refused(&self) -> bool {
        self.retry_at.is_some()
    }

    pub(super) fn set_disk(&mut self, disk: VehicleDisk) {
        self.disk = Some(disk);
    }

    /// The state of the disk for a report; `None` if the host has no files. A disk that has refused is one.
    pub(super) fn disk_report(&self) -> Option<DiskReport> {
        let disk = self.disk.or((self.refusals > 0).then(VehicleDisk::default))?;
        let VehicleDisk { free_bytes, is_checkpoint_refused } = disk;
        Some(DiskReport { journal_refused: self.is_refused(), checkpoint_refused: is_checkpoint_refused, free_bytes })
    }

    /// Has an order wait in the place of an older version; returns whether it is the first one that waits.
    pub(super) fn await_disk(&mut self, order: WaitingOrder) -> bool {
        let is_first = self.orders.is_empty();
        self.orders.retain(|waiting| waiting.id != order.id);
        self.decisions.retain(|&(id, ..)| id != order.id);
        self.orders.push(order);
        is_first
    }

    pub(super) fn take_orders(&mut self) -> Vec<WaitingOrder> {
        std::mem::take(&mut self.orders)
    }

    /// Keeps a decision until it is on the disk.
    pub(super) fn handle_decision(&mut self, id: SlotId, state: SlotState, at: Instant) {
        self.decisions.push((id, state, at));
    }

    /// The link's state with the decisions that are not reported yet.
    pub(super) fn with_decisions(&self, mut inbox: SlotInboxState) -> SlotInboxState {
        self.decisions.iter().for_each(|&(id, state, _)| inbox.decide(id, state));
        inbox
    }

    /// Has changes wait if their labels belong to another epoch than the one on the disk; returns whether they do.
    pub(super) fn holds_changes(&mut self, changes: &MapChanges, at: Instant) -> bool {
        let is_next = changes.labels.as_ref().is_some_and(|labels| labels.epoch != self.epoch);
        if is_next {
            let (map, last) = self.next_map.get_or_insert_default();
            map.then(changes);
            *last = at;
        }
        is_next
    }

    /// Whether the map of another epoch waits.
    pub(super) fn has_next_map(&self) -> bool {
        self.next_map.is_some()
    }

    /// Has exemplars wait until their map is stored.
    pub(super) fn hold_exemplars(&mut self, exemplars: SharedExemplars, at: Instant) {
        self.exemplars = Some((exemplars, at));
    }

    /// The exemplars that have waited.
    pub(super) fn take_exemplars(&mut self) -> Option<(SharedExemplars, Instant)> {
        self.exemplars.take()
    }

    /// The state with these labels is on the disk. Returns the decisions to report, and the map with which another epoch begins.
    pub(super) fn handle_stored(
        &mut self,
        epoch: u8,
        labels: u8,
    ) -> (Vec<UnreportedDecision>, Option<(MapChanges, Instant)>) {
        let is_next = epoch != self.epoch;
        (self.epoch, self.labels, self.retry_at) = (epoch, labels, None);
        let next = if is_next { self.next_map.take() } else { None };
        (std::mem::take(&mut self.decisions), next)
    }

    /// The disk has refused the state.
    pub(super) fn handle_refusal(&mut self, now: Instant) {
        self.refusals += 1;
        self.retry_at = Some(now + RETRY_INTERVAL);
    }

    /// The disk has refused the state at the start of the run, which begins an epoch.
    pub(super) fn handle_refused_start(&mut self, now: Instant) {
        self.handle_refusal(now);
        self.labels = 0;
    }

    /// Whether the state is due to be given to the disk again; if so, the next time is later.
    pub(super) fn takes_retry(&mut self, now: Instant) -> bool {
        let is_due = self.retry_at.is_some_and(|at| at <= now);
        if is_due {
            self.retry_at = Some(now + RETRY_INTERVAL);
        }
        is_due
    }
}

/// Cells that are remembered one by one; beyond them the whole map is given to the link again.
const MAX_CELLS: usize = 1 << 16;

/// The cells whose labels wait for the disk.
#[derive(Debug, Default)]
pub(super) struct WaitingCells {
    /// The highest label on the disk; `None` before labels came.
    stored: Option<u8>,
    cells: Vec<Cell>,
    is_overflown: bool,
    /// When the last of them came.
    at: Instant,
}

impl WaitingCells {
    /// Labels up to `stored` are on the disk.
    pub(super) fn begin(&mut self, stored: u8) {
        self.stored = Some(stored);
    }

    pub(super) fn add(&mut self, cells: &[(Cell, u8)], now: Instant) {
        if cells.is_empty() {
            return;
        }
        self.at = now;
        match self.cells.len() + cells.len() <= MAX_CELLS && !self.is_overflown {
            true => self.cells.extend(cells.iter().map(|&(cell, _)| cell)),
            false => (self.cells, self.is_overflown) = (Vec::new(), true),
        }
    }

    pub(super) fn is_any(&self) -> bool {
        self.is_overflown || !self.cells.is_empty()
    }

    /// When the last cell came.
    pub(super) fn at(&self) -> Instant {
        self.at
    }

    /// This label, or else the highest that may be sent.
    pub(super) fn allowed(&self, label: u8) -> u8 {
        self.stored.map_or(label, |stored| label.min(stored))
    }

    /// The cells that waited for labels up to `stored`; `None` if they are too many to be known.
    pub(super) fn release(&mut self, stored: u8) -> Option<Vec<Cell>> {
        self.stored = Some(stored);
        let cells = std::mem::take(&mut self.cells);
        (!std::mem::take(&mut self.is_overflown)).then_some(cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_cells_become_the_whole_map() {
        let mut waiting = WaitingCells::default();
        assert!(waiting.allowed(9) == 9 && !waiting.is_any());
        waiting.begin(4);
        assert_eq!([4, 5].map(|label| waiting.allowed(label)), [4, 4]);
        waiting.add(&[(Cell::new(1, 2), 5)], Instant::ZERO);
        assert_eq!(waiting.release(5), Some(vec![Cell::new(1, 2)]));
        assert!(waiting.allowed(5) == 5 && !waiting.is_any());
        let many: Vec<(Cell, u8)> = (0..40_000).map(|x| (Cell::new(x, 0), 6)).collect();
        waiting.add(&many, Instant::ZERO);
        waiting.add(&many, Instant::ZERO);
        assert!(waiting.is_any() && waiting.cells.is_empty());
        assert_eq!((waiting.release(6), waiting.is_any()), (None, false));
    }
}
