//! How true the map of a mission is: the errors of its frames, and its mutual information with the sea floor.

use super::Mission;
use super::blocks::with_blocks;
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::wire::{Placement, VehicleStatus};
use scenecast_scoring::{PointPair, RigidFit, rms_distance};
use serde::Serialize;

/// Root mean square errors of the places of all frames, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameErrors {
    /// After the best turn and shift of the whole map.
    pub rigid_m: f64,
    /// With the vehicle's own placement of the map in the world.
    pub placed_m: f64,
}

/// Mutual information of a map with the true classes over the survey's area, unexplored being a label of its own, nats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapInformation {
    /// After the best turn and shift of the whole map.
    pub rigid_nats: f64,
    /// With the placement of the map that its owner knows.
    pub placed_nats: f64,
}

impl Mission {
    /// The errors of the frames that were mapped; `None` where the truth is not known.
    pub fn registration_error_m(&self) -> Option<FrameErrors> {
        let pairs: Vec<_> = self.logbook.poses.iter().map(|poses| (poses.mapped_at, poses.true_at)).collect();
        if self.camera.is_recorded() || pairs.is_empty() {
            return None;
        }
        let navigator = self.vehicle().navigator();
        let placed = |(x_m, y_m): (f64, f64)| navigator.to_world(MapPoint { x_m, y_m }).xy();
        Some(FrameErrors {
            rigid_m: rigid_error_m(&pairs),
            placed_m: rms_distance(pairs.iter().map(|&(mapped, truth)| (placed(mapped), truth))),
        })
    }

    /// The root mean square error of the frames' places when the whole graph is solved after the survey, after the best turn
    /// and shift, metres; `None` where the truth is not known, or where not all frames were registered.
    pub fn solved_error_m(&self) -> Option<f64> {
        let solved = self.logbook.graph.solve();
        if self.camera.is_recorded() || solved.is_empty() || solved.len() != self.logbook.poses.len() {
            return None;
        }
        let places = solved.iter().map(|pose| pose.at().xy());
        let pairs: Vec<_> = places.zip(self.logbook.poses.iter().map(|poses| poses.true_at)).collect();
        Some(rigid_error_m(&pairs))
    }

    /// The mutual information of a map in the map frame with the true classes, placed as the vehicle places it; `None` if
    /// the classes are not known.
    pub fn map_information(&self, map: &LabelGrid) -> Option<MapInformation> {
        let navigator = self.vehicle().navigator();
        self.information(map, |at| navigator.to_map(at))
    }

    /// The mutual information of an operator's map, as the page shows it, with the true classes, placed by the last report
    /// that came in; `None` if the classes are not known.
    pub(crate) fn shown_information(&self, map: &LabelGrid, report: Option<&VehicleStatus>) -> Option<MapInformation> {
        let placement = report.and_then(|status| status.placement);
        self.information(&with_blocks(map), |at| Placement::world_to_map(placement, at))
    }

    fn information(&self, map: &LabelGrid, to_map: impl Fn(WorldPoint) -> MapPoint) -> Option<MapInformation> {
        let truth = self.camera.true_cells(&self.config)?;
        // The map of a recording is in the frame of its poses, which have no other truth.
        let poses = self.logbook.poses.iter().filter(|_| !self.camera.is_recorded());
        let fit = RigidFit::new(&poses.map(|poses| (poses.true_at, poses.mapped_at)).collect::<Vec<_>>());
        let placed = |(east_m, north_m): (f64, f64)| to_map(WorldPoint { east_m, north_m }).xy();
        Some(MapInformation {
            rigid_nats: truth.information_nats(map, |at| fit.apply(at)),
            placed_nats: truth.information_nats(map, placed),
        })
    }
}

/// The root mean square distance of places from the truth after the best turn and shift of all.
fn rigid_error_m(pairs: &[PointPair]) -> f64 {
    let fit = RigidFit::new(pairs);
    rms_distance(pairs.iter().map(|&(place, truth)| (fit.apply(place), truth)))
}
