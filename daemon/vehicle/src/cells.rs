//! What the mapper keeps of each cell beside the scene model: its depth, its last sight, and what the map has of it.

use crate::MapChanges;
use scene_model::publish::{PublishedCell, in_step, update_in_step};
use scenecast_config::Config;
use scenecast_protocol::map::{BUILT_IN_LAYERS, Cell, LayerDescriptor, LayerId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

const LAYERS: usize = BUILT_IN_LAYERS.len();

/// The cells by y and x, in which order the scene model gives them too.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Cells(BTreeMap<(i32, i32), CellRecord>);

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct CellRecord {
    /// The sum of the depths of all observations, metres below the surface of the sea, and their number.
    depths: (f64, u32),
    /// Mission time of the last frame that had a word in the cell, seconds.
    last_s: f64,
    /// The level in every layer. A level stands against small changes, so that the quantity alone does not tell it.
    levels: [u8; LAYERS],
    /// The label on the map; 0 for none, and then the map has nothing of the cell.
    #[serde(skip)]
    label: u8,
    #[serde(skip)]
    perplexity: f32,
}

/// The changes of a map that is compared with its cells.
#[derive(Default)]
pub(super) struct CellChanges<'a> {
    pub(super) labels: Vec<&'a PublishedCell>,
    layers: [Vec<(Cell, u8)>; LAYERS],
    perplexity: Vec<(Cell, f32)>,
}

impl Cells {
    /// Adds an observation at mission time `t_s`, so many metres below the surface of the sea.
    pub(super) fn see(&mut self, cell: Cell, depth_m: f64, t_s: f64) {
        let record = self.0.entry((cell.y, cell.x)).or_default();
        record.depths = (record.depths.0 + depth_m, record.depths.1.saturating_add(1));
        record.last_s = t_s;
    }

    /// Takes the map at mission time `t_s`, sorted by y and x, and returns what is new in it. A cell that it leaves out stays
    /// as it is.
    pub(super) fn take<'a>(&mut self, map: &'a [PublishedCell], t_s: f64, scales: &LayerScales) -> CellChanges<'a> {
        let mut changes = CellChanges::default();
        let fresh = |_: &&PublishedCell| CellRecord::default();
        let update = |record: &mut CellRecord, shown| record.take(shown, t_s, scales, &mut changes);
        update_in_step(&mut self.0, map, |shown| (shown.y, shown.x), fresh, update);
        changes
    }

    /// The map of the last frame is as it was, after a restart; depths, last sights and levels are those of the checkpoint.
    pub(super) fn restore(&mut self, map: &[PublishedCell]) {
        for (shown, record) in in_step(self.0.iter_mut(), map.iter(), |shown| (shown.y, shown.x)) {
            if let Some(record) = record {
                (record.label, record.perplexity) = (shown.label, shown.perplexity);
            }
        }
    }

    /// Everything that the map has of each cell, without camera frame and labels' tree.
    pub(super) fn all(&self) -> (Vec<(Cell, u8)>, MapChanges) {
        let shown = || self.0.iter().filter(|(_, record)| record.label != 0);
        let place = |&(y, x): &(i32, i32)| Cell::new(x, y);
        let levels = |layer: usize| shown().map(move |(at, record)| (place(at), record.levels[layer]));
        let layers = std::array::from_fn(|layer| levels(layer).filter(|(_, level)| *level != 0).collect());
        let perplexity = shown().map(|(at, record)| (place(at), record.perplexity)).collect();
        let changes = CellChanges { labels: Vec::new(), layers, perplexity };
        (shown().map(|(at, record)| (place(at), record.label)).collect(), changes.into())
    }

    /// The map has nothing of any cell, because labels are numbered again.
    pub(super) fn clear_map(&mut self) {
        self.0.values_mut().for_each(|record| record.label = 0);
    }
}

impl CellRecord {
    fn take<'a>(&mut self, shown: &'a PublishedCell, t_s: f64, scales: &LayerScales, changes: &mut CellChanges<'a>) {
        let cell = Cell::new(shown.x, shown.y);
        let is_new = self.label == 0;
        if self.label != shown.label {
            self.label = shown.label;
            changes.labels.push(shown);
        }
        let is_explained_anew = is_new || self.perplexity != shown.perplexity;
        if is_explained_anew {
            self.perplexity = shown.perplexity;
            changes.perplexity.push((cell, shown.perplexity));
        }
        let (depth_m, seen) = self.depths;
        let quantities = [
            (LayerId::CONFIDENCE, Some(f64::from(shown.confidence))),
            (LayerId::DEPTH, (seen > 0).then(|| depth_m / f64::from(seen))),
            (LayerId::CURIOSITY, is_explained_anew.then(|| f64::from(shown.perplexity.max(1.0)).log2())),
            (LayerId::LAST_SEEN, (seen > 0).then(|| (t_s - self.last_s).max(0.0) / 60.0)),
        ];
        for (id, quantity) in quantities {
            let held = &mut self.levels[id.index()];
            let level = quantity.map_or(*held, |quantity| scales.level(id, quantity, *held));
            let before = std::mem::replace(held, level);
            if before != level || is_new && level != 0 {
                changes.layers[id.index()].push((cell, level));
            }
        }
    }
}

impl From<CellChanges<'_>> for MapChanges {
    fn from(changes: CellChanges<'_>) -> Self {
        let ids = BUILT_IN_LAYERS.iter().map(|layer| layer.id);
        let layers = ids.zip(changes.layers).filter(|(_, levels)| !levels.is_empty()).collect();
        Self { layers, perplexity: changes.perplexity, ..Self::default() }
    }
}

/// The scales of the built-in layers on this vehicle.
pub(super) fn descriptors(config: &Config) -> impl Iterator<Item = (LayerId, LayerDescriptor)> {
    BUILT_IN_LAYERS.iter().map(|layer| match layer.id {
        LayerId::DEPTH => (layer.id, LayerDescriptor::depth_around(config.survey.depth_m, config.map.depth_step_m)),
        _ => (layer.id, layer.descriptor.clone()),
    })
}

/// The scales of the layers, in which most quantities are found to keep their level by one comparison.
pub(super) struct LayerScales(BTreeMap<LayerId, LayerScale>);

struct LayerScale {
    descriptor: LayerDescriptor,
    /// The quantities that keep a level; those of level 0 are none.
    kept: Vec<Range<f64>>,
}

impl LayerScales {
    /// The scales on this vehicle.
    pub(super) fn new(config: &Config) -> Self {
        let scale = |(id, descriptor): (LayerId, LayerDescriptor)| {
            let kept = (0..=descriptor.levels).map(|level| descriptor.kept_by(level).unwrap_or(0.0..0.0)).collect();
            (id, LayerScale { descriptor, kept })
        };
        Self(descriptors(config).map(scale).collect())
    }

    fn level(&self, id: LayerId, quantity: f64, held: u8) -> u8 {
        let LayerScale { descriptor, kept } = &self.0[&id];
        match kept.get(usize::from(held)).is_some_and(|range| range.contains(&quantity)) {
            true => held,
            false => descriptor.level(quantity, held),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: Cell = Cell { x: 2, y: -3 };

    fn shown(cell: Cell, label: u8, confidence: f32) -> PublishedCell {
        PublishedCell { x: cell.x, y: cell.y, label, confidence, perplexity: 8.0 }
    }

    fn scales() -> LayerScales {
        let mut config = Config::default();
        config.survey.depth_m = 20.0;
        LayerScales::new(&config)
    }

    /// The changes of a map of one cell.
    fn changes(cells: &mut Cells, map: PublishedCell, t_s: f64) -> (Vec<u8>, MapChanges) {
        let map = [map];
        let changes = cells.take(&map, t_s, &scales());
        (changes.labels.iter().map(|shown| shown.label).collect(), changes.into())
    }

    #[test]
    fn only_what_has_changed_is_given() {
        let mut cells = Cells::default();
        cells.see(CELL, 20.0, 4.0);
        let (labels, first) = changes(&mut cells, shown(CELL, 3, 0.6), 4.0);
        assert_eq!((labels, first.layers.len(), first.perplexity.len()), (vec![3], LAYERS, 1));
        assert_eq!(changes(&mut cells, shown(CELL, 3, 0.6), 4.0), (vec![], MapChanges::default()));
        let (labels, older) = changes(&mut cells, shown(CELL, 3, 0.6), 400.0);
        assert!(labels.is_empty() && older.layers.keys().eq([&LayerId::LAST_SEEN]), "{older:?}");
        let (labels, other) = changes(&mut cells, shown(CELL, 2, 0.6), 400.0);
        assert_eq!((labels, other), (vec![2], MapChanges::default()));
        let (labels, all) = cells.all();
        assert_eq!((labels, all.layers.len()), (vec![(CELL, 2)], LAYERS));
        cells.clear_map();
        assert_eq!(cells.all(), (Vec::new(), MapChanges::default()));
        let (labels, again) = changes(&mut cells, shown(CELL, 2, 0.6), 400.0);
        assert_eq!((labels, again.layers), (vec![2], all.layers), "labels that are numbered again");
    }

    #[test]
    fn a_level_stands_against_small_changes() {
        let mut cells = Cells::default();
        let mut level = |confidence: f32| {
            changes(&mut cells, shown(CELL, 1, confidence), 0.0);
            let restored: Cells = postcard::from_bytes(&postcard::to_allocvec(&cells).unwrap()).unwrap();
            let level = |cells: &Cells| cells.0[&(CELL.y, CELL.x)].levels[LayerId::CONFIDENCE.index()];
            assert_eq!(level(&restored), level(&cells));
            level(&cells)
        };
        assert_eq!([0.30, 0.52, 0.56, 0.48, 0.44].map(&mut level), [2, 2, 3, 3, 2]);
    }

    #[test]
    fn a_cell_has_the_mean_depth_of_its_observations() {
        let mut cells = Cells::default();
        [20.0, 21.0, 23.5].into_iter().for_each(|depth_m| cells.see(CELL, depth_m, 0.0));
        let (_, given) = changes(&mut cells, shown(CELL, 1, 0.5), 0.0);
        let descriptor = LayerDescriptor::depth_around(20.0, 0.5);
        assert_eq!(given.layers[&LayerId::DEPTH], [(CELL, descriptor.level(21.5, 0))]);
        let unseen = Cell::new(9, 9);
        let (labels, given) = changes(&mut cells, shown(unseen, 1, 0.5), 0.0);
        assert_eq!((labels, given.layers.contains_key(&LayerId::DEPTH)), (vec![1], false));
    }
}
