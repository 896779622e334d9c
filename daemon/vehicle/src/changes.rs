//! Changes of the map: what its producers, the scene model and other programs, give the vehicle.

use crate::mosaic::FloorTile;
use scene_model::exemplars::ExemplarPatch;
use scene_model::project::Pose;
use scenecast_protocol::map::{Cell, ClassEntry, LabelTree, LayerDescriptor, LayerId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a producer has changed of the map since its last changes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapChanges {
    /// `None` if another producer gives the labels.
    pub labels: Option<LabelChanges>,
    /// Levels of the scene model's layers; level 0 is not known.
    pub layers: BTreeMap<LayerId, Vec<(Cell, u8)>>,
    /// Bands of another program with levels of each.
    pub bands: Vec<(LayerDescriptor, Vec<(Cell, u8)>)>,
    /// Every class of another program that has a name so far.
    pub classes: Vec<ClassEntry>,
    /// The perplexity of cells under the scene model.
    pub perplexity: Vec<(Cell, f32)>,
    /// New pictures of the sea floor, which do not wait for labels.
    pub floor: Vec<FloorTile>,
    /// The camera frame after which the map is so; `None` if it is no frame's.
    pub frame: Option<SeenFrame>,
}

/// Changed cells of the labels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LabelChanges {
    pub epoch: u8,
    /// The highest label of the epoch so far, in these cells or elsewhere.
    pub highest: u8,
    /// 0 for a cell that has no label any more. Every cell is there at the begin of an epoch.
    pub cells: Vec<(Cell, u8)>,
    /// Which labels become one at coarser cuts; `None` where that is not known.
    pub tree: Option<LabelTree>,
}

/// A camera frame that was mapped.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenFrame {
    /// Mission time at which it was taken, seconds.
    pub t_s: f64,
    /// The pose of the camera in the vehicle's map frame: by registration, where that is on.
    pub camera: Pose,
    /// The cells whose labels it has changed.
    pub cells: Vec<SeenCell>,
}

/// A cell whose label a camera frame has changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenCell {
    pub cell: Cell,
    /// Visual words in it after the frame.
    pub words: u32,
    /// How sure the label is, 0 to 1.
    pub confidence: f32,
}

impl MapChanges {
    /// Labels of cells, and nothing else.
    pub fn of_labels(epoch: u8, highest: u8, cells: Vec<(Cell, u8)>) -> Self {
        Self { labels: Some(LabelChanges { epoch, highest, cells, tree: None }), ..Self::default() }
    }

    /// Adds later changes of the same producer, which replace these where both have a cell. Labels of another epoch, with which every
    /// cell is given again, replace all.
    pub fn then(&mut self, later: &Self) {
        match (&mut self.labels, &later.labels) {
            (Some(labels), Some(later)) if labels.epoch == later.epoch => labels.then(later),
            (_, Some(_)) => return self.clone_from(later),
            (_, None) => {}
        }
        for (&id, levels) in &later.layers {
            replace(self.layers.entry(id).or_default(), levels);
        }
        for (descriptor, levels) in &later.bands {
            match self.bands.iter_mut().find(|(known, _)| known.name == descriptor.name) {
                Some((_, known)) => replace(known, levels),
                None => self.bands.push((descriptor.clone(), levels.clone())),
            }
        }
        self.classes.clone_from(&later.classes);
        replace(&mut self.perplexity, &later.perplexity);
        self.frame = later.frame.clone().or(self.frame.take());
    }
}

impl LabelChanges {
    fn then(&mut self, later: &Self) {
        replace(&mut self.cells, &later.cells);
        self.highest = later.highest;
        self.tree = later.tree.clone().or(self.tree.take());
    }
}

fn replace<T: Copy>(cells: &mut Vec<(Cell, T)>, later: &[(Cell, T)]) {
    let both: BTreeMap<Cell, T> = cells.iter().chain(later).copied().collect();
    *cells = both.into_iter().collect();
}

/// The best exemplars of each label that has any, the best first.
pub type SharedExemplars = Arc<BTreeMap<u8, Vec<ExemplarPatch>>>;

/// A producer of the map, with a checkpoint of its own. The configuration selects one for the labels.
pub trait MapProducer {
    /// The epoch that the labels belong to.
    fn epoch(&self) -> u8;

    /// Mission time of the last frame or item, seconds.
    fn last_s(&self) -> Option<f64>;

    /// Continues after a restart in `epoch`. Labels up to `published` may be known at the surface.
    fn resume(&mut self, epoch: u8, published: u8);

    /// Encodes the producer for its checkpoint. `lineage` is the number of the mission.
    fn save(&self, lineage: u64) -> Vec<u8>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_changes_replace_earlier_ones_of_the_same_epoch() {
        let [a, b, c] = [0, 1, 2].map(|x| Cell::new(x, 0));
        let changes = |epoch, highest, cells: &[(Cell, u8)]| MapChanges {
            layers: BTreeMap::from([(LayerId::DEPTH, cells.to_vec())]),
            ..MapChanges::of_labels(epoch, highest, cells.to_vec())
        };
        let mut all = changes(1, 2, &[(a, 1), (b, 2)]);
        all.then(&changes(1, 3, &[(b, 3), (c, 0)]));
        assert_eq!(all, changes(1, 3, &[(a, 1), (b, 3), (c, 0)]));
        all.then(&MapChanges::default());
        assert_eq!(all.labels.as_ref().unwrap().cells.len(), 3, "a producer without labels");
        all.then(&changes(2, 1, &[(c, 1)]));
        assert_eq!(all, changes(2, 1, &[(c, 1)]), "labels of another epoch mean something else");
    }
}
