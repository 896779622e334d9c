//! The map of a vehicle, and which version of it each topic has.

use scenecast_messages::contents::{Grid, MAX_GRID_CELLS};
use scenecast_protocol::map::{LabelGrid, LayerDescriptor, Quantity};

/// The map of a vehicle: labels, and levels of its layers.
#[derive(Debug, Clone)]
pub struct VehicleMap {
    pub version: u64,
    pub cell_m: f64,
    pub labels: LabelGrid,
    pub layers: Vec<(LayerDescriptor, LabelGrid)>,
}

/// The published version of labels, layers and cloud. A map that no message can have counts as published, so that it is not
/// copied again before it changes.
#[derive(Debug, Default)]
pub(crate) struct MapVersions {
    published: [Option<u64>; 3],
    is_too_large: bool,
}

impl MapVersions {
    /// Which topics have subscribers that do not have this version yet.
    pub fn due(&self, subscribers: [usize; 3], version: u64) -> [bool; 3] {
        std::array::from_fn(|i| subscribers[i] > 0 && self.published[i] != Some(version))
    }

    /// Notes which topics have this version.
    pub fn handle_published(&mut self, done: [bool; 3], version: u64) {
        self.published.iter_mut().zip(done).filter(|(_, done)| *done).for_each(|(topic, _)| *topic = Some(version));
    }

    /// The grid to publish; `None` if the map is empty or too large for a message, of which it warns once.
    pub fn grid(&mut self, map: &VehicleMap) -> Option<Grid> {
        let grid = grid(map);
        let bounds = map.labels.bounds();
        let is_too_large = grid.is_none() && bounds.is_some();
        if let Some(area) = bounds.filter(|_| is_too_large && !self.is_too_large) {
            let size = format!("{} x {} cells", area.width, area.height);
            tracing::warn!("ROS 2: the map spans {size}; one message has at most {MAX_GRID_CELLS}");
        }
        self.is_too_large = is_too_large;
        if grid.is_none() {
            self.handle_published([true; 3], map.version);
        }
        grid
    }
}

fn grid(map: &VehicleMap) -> Option<Grid> {
    let mut grid = Grid::new(map.labels.bounds()?, map.cell_m, (0.0, 0.0), |cell| map.labels.get(cell))?;
    for (layer, levels) in &map.layers {
        let is_depth = layer.quantity == Quantity::Depth;
        grid.add_layer(&layer.name, is_depth, |cell| layer.middle(levels.get(cell)));
    }
    Some(grid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::Cell;

    fn map(version: u64, cells: &[Cell]) -> VehicleMap {
        let mut labels = LabelGrid::default();
        for &cell in cells {
            labels.set(cell, 1);
        }
        VehicleMap { version, cell_m: 0.5, labels, layers: Vec::new() }
    }

    #[test]
    fn a_map_too_large_for_a_message_is_not_asked_for_again() {
        let (mut versions, wide) = (MapVersions::default(), map(7, &[Cell::new(0, 0), Cell::new(2999, 2999)]));
        assert_eq!(versions.due([1, 0, 1], 7), [true, false, true]);
        assert_eq!(versions.grid(&wide), None);
        assert!(versions.is_too_large, "it is reported");
        assert_eq!(versions.due([1, 1, 1], 7), [false; 3]);
        assert_eq!(versions.due([1, 1, 1], 8), [true; 3], "another version");
    }

    #[test]
    fn a_map_is_due_until_each_topic_has_it() {
        let (mut versions, small) = (MapVersions::default(), map(7, &[Cell::new(0, 0)]));
        assert_eq!(versions.grid(&small).unwrap().labels, [1]);
        versions.handle_published([true, false, false], 7);
        assert_eq!(versions.due([1, 1, 0], 7), [false, true, false]);
        assert_eq!(versions.grid(&map(8, &[])), None);
        assert_eq!((versions.due([1; 3], 8), versions.is_too_large), ([false; 3], false), "nothing to publish");
    }
}
