//! The depth of the sea floor in each cell.

use scenecast_protocol::map::Cell;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The mean depth of the observations in each cell.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Relief(BTreeMap<(i32, i32), Depths>);

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Depths {
    sum_m: f64,
    seen: f64,
}

impl Relief {
    /// Adds an observation, so many metres below the surface.
    pub(super) fn add(&mut self, cell: Cell, depth_m: f64) {
        let depths = self.0.entry((cell.x, cell.y)).or_default();
        depths.sum_m += depth_m;
        depths.seen += 1.0;
    }

    /// Mean depth in metres below the surface; `None` without an observation.
    pub(super) fn depth_m(&self, cell: Cell) -> Option<f64> {
        self.0.get(&(cell.x, cell.y)).map(|d| d.sum_m / d.seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_has_the_mean_depth_of_its_observations() {
        let (slope, unseen) = (Cell::new(-3, 2), Cell::new(0, 0));
        let mut relief = Relief::default();
        [20.0, 21.0, 23.5].into_iter().for_each(|depth| relief.add(slope, depth));
        assert_eq!((relief.depth_m(slope), relief.depth_m(unseen)), (Some(21.5), None));
    }
}
