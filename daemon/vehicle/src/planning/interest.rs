//! What the operator favours.

use super::bounds::Point;
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Utility, WeightedArea};

/// The operator's utility, and the areas that are weighted whatever lies there.
#[derive(Debug, Clone, Copy)]
pub struct Interest<'a> {
    pub utility: &'a Utility,
    pub areas: &'a [WeightedArea],
}

impl<'a> Interest<'a> {
    /// The interest of an operator who has weighted no area.
    pub fn in_labels(utility: &'a Utility) -> Self {
        Self { utility, areas: &[] }
    }

    /// The largest weight, from 0 to 1.
    pub fn largest_weight(&self) -> f64 {
        let labels = self.utility.weights.values().copied();
        let areas = self.areas.iter().map(|area| area.weight);
        let others = [self.utility.exploration, self.utility.curiosity];
        f64::from(labels.chain(areas).chain(others).fold(0, i8::max)) / 100.0
    }

    /// The weight of a place of the world frame by the areas alone.
    pub fn weight_of_place(&self, place: Point) -> f32 {
        let point = DecimetrePoint::nearest(WorldPoint::new(place.0, place.1));
        let contains = |area: &&WeightedArea| point.is_some_and(|point| area.outline.contains(point));
        self.areas.iter().filter(contains).map(|area| f32::from(area.weight) / 100.0).sum()
    }
}
