//! How true the map of a mission is: the errors of its frames, and its mutual information with the sea floor.

use super::Mission;
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_scoring::{RigidFit, mutual_information_nats, rms_distance};

/// Root mean square errors of the places of all frames, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameErrors {
    /// After the best turn and shift of the whole map.
    pub(crate) rigid_m: f64,
    /// With the vehicle's own placement of the map in the world.
    pub(crate) placed_m: f64,
}

/// Mutual information over all cells of the survey's area with a known class, unexplored being a label, in nats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MapInformation {
    pub(crate) rigid_nats: f64,
    pub(crate) placed_nats: f64,
}

impl Mission {
    /// The errors of the frames that were mapped; `None` where the truth is not known.
    pub(crate) fn registration_error_m(&self) -> Option<FrameErrors> {
        let pairs: Vec<_> = self.logbook.poses.iter().map(|poses| (poses.mapped_at, poses.true_at)).collect();
        if self.camera.is_recorded() || pairs.is_empty() {
            return None;
        }
        let fit = RigidFit::new(&pairs);
        let navigator = self.vehicle().navigator();
        let placed = |(x_m, y_m): (f64, f64)| navigator.to_world(MapPoint { x_m, y_m }).xy();
        Some(FrameErrors {
            rigid_m: rms_distance(pairs.iter().map(|&(mapped, truth)| (fit.apply(mapped), truth))),
            placed_m: rms_distance(pairs.iter().map(|&(mapped, truth)| (placed(mapped), truth))),
        })
    }

    /// The mutual information of a map in the map frame with the true classes; `None` if they are not known.
    pub(crate) fn map_information(&self, map: &LabelGrid) -> Option<MapInformation> {
        if !self.camera.world.is_annotated() {
            return None;
        }
        let to_map: Vec<_> = self.logbook.poses.iter().map(|poses| (poses.true_at, poses.mapped_at)).collect();
        let fit = RigidFit::new(&to_map);
        let navigator = self.vehicle().navigator();
        let placed = |(east_m, north_m): (f64, f64)| navigator.to_map(WorldPoint { east_m, north_m }).xy();
        Some(MapInformation {
            rigid_nats: self.information_by(map, |at| fit.apply(at)),
            placed_nats: self.information_by(map, placed),
        })
    }

    /// The mutual information where `to_map` says which place of the map shows a place of the world.
    fn information_by(&self, map: &LabelGrid, to_map: impl Fn((f64, f64)) -> (f64, f64)) -> f64 {
        let cell_m = self.cell_m();
        let area = self.config.survey.area_m.unwrap_or_else(|| self.camera.world.survey_area());
        let cells = |low: f64, high: f64| (low / cell_m).ceil() as i32..(high / cell_m).floor() as i32;
        let columns = cells(area.west, area.east);
        let all = cells(area.south, area.north).flat_map(|y| columns.clone().map(move |x| Cell::new(x, y)));
        let pairs = all.filter_map(|cell| {
            let class = self.camera.world.class_of(cell, cell_m)?;
            let middle = ((f64::from(cell.x) + 0.5) * cell_m, (f64::from(cell.y) + 0.5) * cell_m);
            let (x, y) = to_map(middle);
            let label = map.get(Cell::new((x / cell_m).floor() as i32, (y / cell_m).floor() as i32));
            Some((u32::from(label), u32::from(class)))
        });
        mutual_information_nats(pairs).nats
    }
}
