//! The map of one end over the time of a record.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_messages::scenecast_msgs;
use scenecast_protocol::map::{Cell, LabelGrid, LayerDescriptor, LayerReplica, Quantity, Rect, Replica, UNEXPLORED};
use scenecast_protocol::time::Instant;
use scenecast_surface::state::FormerLabel;
use scenecast_surface::{MapCells, cell_layers};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The changes of a map, and the map after those up to one moment.
#[derive(Debug, Default)]
pub(crate) struct MapHistory {
    changes: Vec<Change>,
    /// The meaning of the layers' levels, by name.
    descriptors: BTreeMap<String, LayerDescriptor>,
    /// How many of `changes`, from the first on, are in `shown`.
    applied: usize,
    shown: ShownMap,
}

/// A recorded message about cells of the labels or of one layer, and its time, nanoseconds since 1970.
#[derive(Debug)]
struct Change {
    nanos: u64,
    message: scenecast_msgs::MapCells,
}

/// A map at one moment.
#[derive(Debug, Default)]
pub(crate) struct ShownMap {
    pub(crate) labels: Replica,
    pub(crate) layers: BTreeMap<String, LayerReplica>,
    pub(crate) epoch: u8,
    /// The edge of a cell, metres; 0 before the first cells.
    pub(crate) cell_m: f64,
}

impl Change {
    fn cells(&self) -> impl Iterator<Item = (Cell, u8)> + '_ {
        let message = &self.message;
        message.x.iter().zip(&message.y).zip(&message.value).map(|((&x, &y), &value)| (Cell::new(x, y), value))
    }

    fn is_of_labels(&self) -> bool {
        self.message.layer.is_empty()
    }

    /// The cells that were received with this message. The next file of a record repeats the whole map, of which the others were received
    /// before.
    fn news(&self, held: &Replica) -> Vec<(Cell, u8)> {
        if !self.message.whole {
            return self.cells().collect();
        }
        let all: LabelGrid = self.cells().collect();
        let missing = held.shown().iter().filter(|&(cell, _)| all.get(cell) == UNEXPLORED);
        let gone = missing.map(|(cell, _)| (cell, UNEXPLORED));
        gone.chain(self.cells().filter(|&(cell, value)| held.shown().get(cell) != value)).collect()
    }
}

impl MapHistory {
    /// Adds a message about cells. Messages come in the order of their times.
    pub(crate) fn take(&mut self, nanos: u64, message: scenecast_msgs::MapCells) {
        let is_begun = message.whole || self.changes.iter().any(|change| change.message.layer == message.layer);
        // Without its first files, a record has changes of a map that it does not have; the whole map follows.
        if is_begun {
            self.changes.push(Change { nanos, message });
        }
    }

    /// Adds what a later record of the same end says, its times moved.
    pub(crate) fn add(&mut self, later: Self, moved: impl Fn(u64) -> u64) {
        self.descriptors.extend(later.descriptors);
        let changes = later.changes.into_iter();
        self.changes.extend(changes.map(|change| Change { nanos: moved(change.nanos), ..change }));
    }

    /// Adds the meaning of a layer's levels.
    pub(crate) fn describe(&mut self, descriptor: LayerDescriptor) {
        self.descriptors.insert(descriptor.name.clone().into_owned(), descriptor);
    }

    /// Shows the map at a moment of the record, whose mission times `mission` knows.
    pub(crate) fn seek(&mut self, nanos: u64, mission: impl Fn(u64) -> Instant) {
        let upto = self.changes.partition_point(|change| change.nanos <= nanos);
        if upto < self.applied {
            (self.applied, self.shown) = (0, ShownMap::default());
        }
        for change in &self.changes[self.applied..upto] {
            self.shown.apply(change, &self.descriptors, mission(change.nanos));
        }
        self.applied = upto;
    }

    /// All labels that the map of the last [`Self::seek`] has had in its epoch.
    pub(crate) fn labels_so_far(&self) -> BTreeSet<u8> {
        let is_of_it = |change: &&Change| change.is_of_labels() && change.message.epoch == u32::from(self.shown.epoch);
        let values = self.changes[..self.applied].iter().filter(is_of_it).flat_map(|change| &change.message.value);
        values.copied().filter(|label| *label != UNEXPLORED).collect()
    }

    /// The map of the last [`Self::seek`].
    pub(crate) fn shown(&self) -> &ShownMap {
        &self.shown
    }

    /// Names the map of the last [`Self::seek`].
    pub(crate) fn place(&self) -> usize {
        self.applied
    }

    /// The labels that a cell of this map had before, the newest first.
    pub(crate) fn former_labels(&self, cell: Cell, mission_s: impl Fn(u64) -> f64) -> Vec<FormerLabel> {
        let (mut former, mut held) = (Vec::new(), UNEXPLORED);
        let mut epoch = None;
        for change in self.changes[..self.applied].iter().filter(|change| change.is_of_labels()) {
            if epoch.replace(change.message.epoch) != Some(change.message.epoch) {
                (former, held) = (Vec::new(), UNEXPLORED);
            }
            let Some(label) = change.cells().find_map(|(at, label)| (at == cell).then_some(label)) else { continue };
            let before = std::mem::replace(&mut held, label);
            if before != label && before != UNEXPLORED {
                former.push(FormerLabel { label: before, until_s: mission_s(change.nanos) });
            }
        }
        former.reverse();
        former
    }
}

impl ShownMap {
    fn apply(&mut self, change: &Change, descriptors: &BTreeMap<String, LayerDescriptor>, at: Instant) {
        let message = &change.message;
        let epoch = message.epoch.try_into().unwrap_or(u8::MAX);
        if change.is_of_labels() {
            if self.epoch != epoch {
                *self = Self { epoch, ..Self::default() };
            }
            self.cell_m = message.cell_m;
            for (cell, label) in change.news(&self.labels) {
                self.labels.restore(cell, label, at);
            }
            return;
        }
        let Some(descriptor) = descriptors.get(&message.layer) else { return };
        let new = || LayerReplica::new(descriptor.clone());
        let layer = self.layers.entry(message.layer.clone()).or_insert_with(new);
        for (cell, level) in change.news(layer.levels()) {
            layer.restore(cell, level, at);
        }
    }

    /// The number of cells of each label.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u8, u32)> + '_ {
        self.labels.counts()
    }

    /// The map as the page and exports take it.
    pub(crate) fn cells(&self, version: u64, at: Instant) -> MapCells {
        let layers: Vec<&LayerReplica> = self.layers.values().collect();
        MapCells {
            version,
            at,
            bounds: self.labels.bounds(),
            tiles: self.labels.tiles().clone(),
            layers: cell_layers(&layers),
            ..MapCells::of_labels(&LabelGrid::default(), self.cell_m)
        }
    }

    /// Cells in which two maps differ, with the label of this one, or of the other one where this one has none.
    pub(crate) fn difference(&self, other: &Self) -> LabelGrid {
        if self.epoch != other.epoch {
            // Their labels have other meanings, so no cell is the same.
            let both = other.labels.shown().iter().chain(self.labels.shown().iter());
            return both.collect();
        }
        let (own, others) = (self.labels.shown(), other.labels.shown());
        let missing = others.iter().filter(|&(cell, _)| own.get(cell) == UNEXPLORED);
        own.iter().filter(|&(cell, label)| others.get(cell) != label).chain(missing).collect()
    }

    pub(crate) fn bounds(&self) -> Option<Rect> {
        self.labels.bounds()
    }
}

/// The meaning of a layer's levels in a record, as JSON.
#[derive(Serialize, Deserialize)]
struct LayerText {
    name: String,
    unit: String,
    is_depth: bool,
    /// The bounds of levels in units: level n lies from `edges[n - 1]` to `edges[n]`.
    edges: Vec<f64>,
    /// Base64 of the descriptor's bytes on the wire.
    descriptor: String,
}

/// The meaning of a layer's levels as text for a record.
pub fn layer_text(descriptor: &LayerDescriptor) -> String {
    let bounds = |level| descriptor.bounds(level).unwrap_or_default();
    let text = LayerText {
        name: descriptor.name.clone().into_owned(),
        unit: descriptor.unit.clone().into_owned(),
        is_depth: descriptor.quantity == Quantity::Depth,
        edges: (1..=descriptor.levels).map(|n| bounds(n).0).chain([bounds(descriptor.levels).1]).collect(),
        descriptor: STANDARD.encode(descriptor.to_bytes()),
    };
    // Strings, numbers and lists of these, so this cannot fail.
    serde_json::to_string(&text).unwrap_or_default()
}

/// Reads [`layer_text`]; `None` if it is another text.
pub(crate) fn layer_of_text(text: &str) -> Option<LayerDescriptor> {
    let text: LayerText = serde_json::from_str(text).ok()?;
    LayerDescriptor::from_bytes(&STANDARD.decode(text.descriptor).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{LayerId, LayerSet};

    fn change(whole: bool, epoch: u32, layer: &str, cells: &[(i32, u8)]) -> scenecast_msgs::MapCells {
        scenecast_msgs::MapCells {
            epoch,
            layer: layer.to_owned(),
            cell_m: 0.5,
            whole,
            x: cells.iter().map(|&(x, _)| x).collect(),
            y: vec![0; cells.len()],
            value: cells.iter().map(|&(_, value)| value).collect(),
            ..Default::default()
        }
    }

    fn labels(history: &mut MapHistory, nanos: u64) -> Vec<u8> {
        history.seek(nanos, Instant::from_micros);
        (0..4).map(|x| history.shown().labels.shown().get(Cell::new(x, 0))).collect()
    }

    #[test]
    fn a_map_is_the_sum_of_its_changes_at_every_moment() {
        let mut history = MapHistory::default();
        history.take(5, change(false, 1, "", &[(3, 9)]));
        history.take(10, change(true, 1, "", &[(0, 1), (1, 2)]));
        history.take(20, change(false, 1, "", &[(1, 3), (2, 4)]));
        history.take(30, change(true, 1, "", &[(0, 1), (2, 4)]));
        history.take(40, change(true, 2, "", &[(0, 7)]));
        assert_eq!(labels(&mut history, 9), [0, 0, 0, 0], "changes of a map that is not known");
        assert_eq!(labels(&mut history, 40), [7, 0, 0, 0]);
        assert_eq!(labels(&mut history, 39), [1, 0, 4, 0], "back");
        let cell = |x| Cell::new(x, 0);
        assert_eq!(history.shown().labels.received_at(cell(0)), Some(Instant::from_micros(10)), "repeated, not new");
        assert_eq!(labels(&mut history, 20), [1, 3, 4, 0]);
        let former = history.former_labels(cell(1), |nanos| nanos as f64);
        assert_eq!(former, [FormerLabel { label: 2, until_s: 20.0 }]);
    }

    #[test]
    fn layers_are_shown_as_they_were_received() {
        let descriptor = LayerSet::default().get(LayerId::CONFIDENCE).unwrap().clone();
        let mut history = MapHistory::default();
        history.describe(descriptor);
        history.take(10, change(true, 0, "", &[(0, 1)]));
        history.take(20, change(true, 0, "confidence", &[(0, 4)]));
        let value = |history: &mut MapHistory, nanos| {
            history.seek(nanos, Instant::from_micros);
            history.shown().cells(1, Instant::ZERO).layers.first().and_then(|layer| layer.value(Cell::new(0, 0)))
        };
        assert_eq!(value(&mut history, 20), Some(0.875));
        assert_eq!(value(&mut history, 10), None);
    }

    #[test]
    fn maps_differ_where_a_cell_is_missing_or_another() {
        let map = |epoch, cells: &[(i32, u8)]| {
            let mut history = MapHistory::default();
            history.take(0, change(true, epoch, "", cells));
            history.seek(0, Instant::from_micros);
            history.shown
        };
        let vehicle = map(0, &[(0, 1), (1, 2), (2, 3)]);
        let found: Vec<(Cell, u8)> = vehicle.difference(&map(0, &[(0, 1), (1, 5), (3, 6)])).iter().collect();
        assert_eq!(found, [(Cell::new(1, 0), 2), (Cell::new(2, 0), 3), (Cell::new(3, 0), 6)]);
        assert_eq!(vehicle.difference(&map(1, &[(0, 1)])).iter().count(), 3);
    }
}
