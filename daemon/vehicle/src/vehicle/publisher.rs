//! The vehicle's map, and the choice of the cells and layers of it that are sent.

use super::bands::Bands;
use super::evidence::{Evidence, EvidenceByCell, FrameClock};
use super::storing::WaitingCells;
use crate::{LabelChanges, MapChanges};
use scenecast_config::Debounce;
use scenecast_protocol::directive::{CellBand, Settings};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{Cell, LabelGrid, LabelTree, LayerId, LayerMask, LayerSource, UNEXPLORED};
use scenecast_protocol::map_codec::{Codec, Stride};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// The limit of the backlog, in seconds of the budget, where the operator orders coarse to fine and the
/// configuration has no such limit.
const DEFAULT_COARSE_AFTER_S: f64 = 30.0;

/// Least time between two trees of the labels.
const TREE_INTERVAL: Duration = Duration::from_secs(60);

/// The part of the map that is sent unless the operator orders another.
#[derive(Debug, Clone, Copy)]
pub struct MapSelection {
    /// Whether only the coarse cells are sent.
    pub is_coarse: bool,
    /// A backlog beyond so many seconds of the budget is sent coarse to fine. 0: never.
    pub coarse_after_s: f64,
    /// How long new labels of known cells are held back.
    pub debounce: Debounce,
    pub layers: LayerMask,
}

impl Default for MapSelection {
    fn default() -> Self {
        let (debounce, layers) = (Debounce::Automatic, LayerMask::default());
        Self { is_coarse: false, coarse_after_s: 0.0, debounce, layers }
    }
}

/// Gives the link the part of the map that is to be sent.
#[derive(Debug, Default)]
pub(super) struct MapPublisher {
    /// Every cell that has a label.
    map: LabelGrid,
    version: u64,
    evidence: EvidenceByCell,
    frames: FrameClock,
    /// Whether cells have lost their labels, as those of another program may.
    has_erased: bool,
    /// Levels of the scene model's layers.
    layers: BTreeMap<LayerId, LabelGrid>,
    labels: u8,
    explored: u32,
    configured: MapSelection,
    ordered_cells: Option<CellBand>,
    ordered_layers: Option<LayerMask>,
    /// The tree of the labels, if it waits for its time, and when the last one was given to the link.
    tree: Option<LabelTree>,
    tree_at: Option<Instant>,
    /// Bands of another program and their layers, which the vehicle adds when the first of their cells comes.
    bands: Bands,
    /// Cells whose labels are not on the disk yet.
    waiting: WaitingCells,
}

impl MapPublisher {
    /// The whole map and its version, which grows with each change.
    pub(super) fn seen(&self) -> (&LabelGrid, u64) {
        (&self.map, self.version)
    }

    /// The times of camera frames.
    pub(super) fn frames(&self) -> FrameClock {
        self.frames
    }

    /// Why a cell has its label, if a camera frame of this run gave it.
    pub(super) fn evidence(&self, cell: Cell) -> Option<&Evidence> {
        self.evidence.get(cell)
    }

    /// The highest label so far that may be sent.
    pub(super) fn labels(&self) -> u8 {
        self.waiting.allowed(self.labels)
    }

    /// The number of cells that have a label.
    pub(super) fn explored(&self) -> u32 {
        self.explored
    }

    /// Sets the codec of the layers of bands.
    pub(super) fn set_codec(&mut self, codec: Codec) {
        self.bands.set_codec(codec);
    }

    /// Sets the configured selection, which orders override.
    pub(super) fn configure(&mut self, selection: MapSelection) {
        self.configured = selection;
    }

    /// Takes cells and layers from the settings in force.
    pub(super) fn set_settings(&mut self, settings: &Settings) {
        (self.ordered_cells, self.ordered_layers) = (settings.cells.value(), settings.layers.value());
    }

    fn cells(&self) -> CellBand {
        let configured = match (self.configured.is_coarse, self.configured.coarse_after_s > 0.0) {
            (true, _) => CellBand::Coarse,
            (false, true) => CellBand::CoarseToFine,
            (false, false) => CellBand::Fine,
        };
        self.ordered_cells.unwrap_or(configured)
    }

    /// The backlog in bytes beyond which cells are sent coarse to fine, at a budget of `bits_per_s`.
    fn coarse_limit(&self, bits_per_s: u32) -> Option<usize> {
        let configured_s = self.configured.coarse_after_s;
        let seconds = if configured_s > 0.0 { configured_s } else { DEFAULT_COARSE_AFTER_S };
        match self.cells() {
            CellBand::Fine => None,
            CellBand::CoarseToFine => Some((f64::from(bits_per_s) / 8.0 * seconds) as usize),
            CellBand::Coarse => Some(0),
        }
    }

    /// Passes the selection on to the link. Settings, configuration and budget determine it.
    pub(super) fn select(&self, link: &mut VehicleLink) {
        let limit = self.coarse_limit(link.budget_bps());
        let is_coarse = self.cells() == CellBand::Coarse;
        link.source_mut().set_coarse_limit(limit);
        let hold = self.configured.debounce.hold(link.budget_bps());
        link.source_mut().set_hold(hold);
        link.set_coarse_layers(is_coarse.then_some(0));
        // An order that was given before a band came does not switch it off.
        let selected = self.ordered_layers.unwrap_or(self.configured.layers);
        link.select_layers(self.bands.added_to(selected));
    }

    /// Takes changes of a producer and gives the link those cells whose labels are on the disk, which are labels up to `stored`.
    /// The others wait for [`Self::handle_stored`].
    pub(super) fn handle_changes(&mut self, changes: &MapChanges, stored: u8, link: &mut VehicleLink, now: Instant) {
        if let Some(frame) = &changes.frame {
            self.frames.handle(frame, now);
            self.evidence.handle_frame(frame, self.frames);
        }
        if let Some(labels) = &changes.labels {
            self.handle_labels(labels, stored, link, now);
        }
        for (&id, levels) in &changes.layers {
            // A band in the place of a built-in layer has its cells to itself.
            if !self.bands.has(id) {
                self.layers.entry(id).or_default().extend(levels.iter().copied());
                self.set_levels(id, levels.iter().copied(), link, now);
            }
        }
        self.handle_bands(changes, link, now);
    }

    fn handle_labels(&mut self, changes: &LabelChanges, stored: u8, link: &mut VehicleLink, now: Instant) {
        self.labels = changes.highest;
        self.tree = changes.tree.clone().or_else(|| self.tree.take());
        self.waiting.begin(stored);
        let mut has_changed = false;
        for &(cell, label) in &changes.cells {
            let before = self.map.set(cell, label);
            has_changed |= before != label;
            self.explored = self.explored + u32::from(label != UNEXPLORED) - u32::from(before != UNEXPLORED);
            self.has_erased |= label == UNEXPLORED;
        }
        self.version += u64::from(has_changed);
        let (now_sent, later): (Vec<_>, Vec<_>) =
            changes.cells.iter().copied().partition(|&(_, label)| label <= stored);
        self.waiting.add(&later, now);
        self.publish_cells(now_sent, link, now);
    }

    /// Whether cells wait for the disk.
    pub(super) fn is_waiting(&self) -> bool {
        self.waiting.is_any()
    }

    /// Labels up to `stored` are on the disk: gives the link the cells that waited for that.
    pub(super) fn handle_stored(&mut self, stored: u8, link: &mut VehicleLink) {
        if !self.waiting.is_any() {
            return self.waiting.begin(stored);
        }
        let now = self.waiting.at();
        match self.waiting.release(stored) {
            Some(cells) => {
                let cells = cells.into_iter().map(|cell| (cell, self.map.get(cell)));
                let cells = cells.filter(|(_, label)| *label <= stored).collect();
                self.publish_cells(cells, link, now);
            }
            None => self.publish_scene(link, now),
        }
    }

    fn publish_cells(&mut self, mut cells: Vec<(Cell, u8)>, link: &mut VehicleLink, now: Instant) {
        cells.retain(|&(cell, _)| self.is_sent(Some(link.map()), cell));
        if !cells.is_empty() {
            link.set_map(cells, now);
        }
    }

    fn handle_bands(&mut self, changes: &MapChanges, link: &mut VehicleLink, now: Instant) {
        for (descriptor, levels) in &changes.bands {
            let (Some(id), is_new) = self.bands.add(descriptor, link) else { continue };
            if is_new {
                self.select(link);
            }
            // The cells that the scene model gave to the layer until now.
            let others = self.layers.remove(&id).unwrap_or_default();
            let others: Vec<_> = others.iter().map(|(cell, _)| (cell, f64::NAN)).collect();
            let changed = self.bands.take(id, levels);
            self.set_band(id, others.into_iter().chain(changed).collect(), link, now);
        }
    }

    /// Forgets the map, because labels change their meaning. The link, which has cleared its layers, receives the bands again.
    pub(super) fn begin_epoch(&mut self, link: &mut VehicleLink, now: Instant) {
        self.map.clear();
        self.evidence.clear();
        self.explored = 0;
        self.layers.clear();
        (self.tree, self.tree_at) = (None, None);
        self.waiting = WaitingCells::default();
        self.version += 1;
        self.publish_bands(link, now);
    }

    /// Gives the link the selected cells of the map and of every layer, because the selection has changed.
    pub(super) fn publish(&self, link: &mut VehicleLink, now: Instant) {
        self.publish_scene(link, now);
        self.publish_bands(link, now);
    }

    /// Gives the link the selected cells of the map and of the scene model's layers.
    ///
    /// Where only coarse cells are selected, finer ones that the link already has stay up to date, so that no cell on the
    /// operator's map is older than it looks.
    fn publish_scene(&self, link: &mut VehicleLink, now: Instant) {
        let is_ready =
            |&(cell, label): &(Cell, u8)| self.is_sent(Some(link.map()), cell) && label == self.waiting.allowed(label);
        let mut cells: Vec<(Cell, u8)> = self.map.iter().filter(is_ready).collect();
        if self.has_erased {
            let gone = link.map().iter().filter(|&(cell, _)| self.map.get(cell) == UNEXPLORED);
            cells.extend(gone.map(|(cell, _)| (cell, UNEXPLORED)));
        }
        link.set_map(cells, now);
        for (&id, levels) in &self.layers {
            self.set_levels(id, levels.iter(), link, now);
        }
    }

    /// Gives the link every band whole, which takes long for a large one.
    fn publish_bands(&self, link: &mut VehicleLink, now: Instant) {
        for (id, cells) in self.bands.all() {
            self.set_band(id, cells, link, now);
        }
    }

    fn set_band(&self, id: LayerId, cells: Vec<(Cell, f64)>, link: &mut VehicleLink, now: Instant) {
        let cells = self.sent_cells(id, cells, f64::is_nan, link);
        link.set_layer(id, cells, now);
    }

    fn set_levels(&self, id: LayerId, cells: impl Iterator<Item = (Cell, u8)>, link: &mut VehicleLink, now: Instant) {
        let cells = self.sent_cells(id, cells, |level| level == UNEXPLORED, link);
        link.set_levels(id, cells, now);
    }

    /// The selected ones of the cells of a layer, and those that are no longer known.
    fn sent_cells<T: Copy>(
        &self,
        id: LayerId,
        cells: impl IntoIterator<Item = (Cell, T)>,
        is_unknown: impl Fn(T) -> bool,
        link: &VehicleLink,
    ) -> Vec<(Cell, T)> {
        let sent = link.layers().find(|layer| layer.id() == id).map(LayerSource::target);
        cells.into_iter().filter(|&(cell, value)| is_unknown(value) || self.is_sent(sent, cell)).collect()
    }

    /// Whether a cell is among the selected ones, or one of `sent`: what the link has of the map or of the layer.
    fn is_sent(&self, sent: Option<&LabelGrid>, cell: Cell) -> bool {
        let is_selected = self.cells() != CellBand::Coarse || Stride::Four.on_lattice(cell).is_some();
        is_selected || sent.is_some_and(|sent| sent.get(cell) != UNEXPLORED)
    }

    /// Gives the link the tree of the labels if that is due.
    pub(super) fn push_tree(&mut self, link: &mut VehicleLink, now: Instant) {
        if !self.is_waiting()
            && self.tree_at.is_none_or(|at| now.since(at) >= TREE_INTERVAL)
            && let Some(tree) = self.tree.take()
            && link.set_tree(&tree)
        {
            self.tree_at = Some(now);
        }
    }
}
