//! How true the map of a mission is: the errors of its frames, and its mutual information with the true classes.

use super::Mission;
use crate::world::World;
use scenecast_core::Area;
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::map::{Cell, LabelGrid, UNEXPLORED};
use scenecast_protocol::wire::{Placement, VehicleStatus};
use scenecast_worlds::scoring::{PointPair, RigidFit, mutual_information_nats, rms_distance};
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

/// The cells of a fixed area whose true class is known.
#[derive(Debug)]
pub(crate) struct TrueCells {
    cell_m: f64,
    /// The middle of each cell in the world frame, metres, and its class.
    cells: Vec<((f64, f64), u8)>,
}

impl TrueCells {
    /// The cells that lie in the area as a whole.
    pub(super) fn new(world: &World, area: &Area, cell_m: f64) -> Self {
        let range = |low: f64, high: f64| (low / cell_m).ceil() as i32..(high / cell_m).floor() as i32;
        let columns = range(area.west, area.east);
        let all = range(area.south, area.north).flat_map(|y| columns.clone().map(move |x| Cell::new(x, y)));
        let middle = |cell: Cell| ((f64::from(cell.x) + 0.5) * cell_m, (f64::from(cell.y) + 0.5) * cell_m);
        let known = |cell: Cell| Some((middle(cell), world.class_of(cell, cell_m)?));
        Self { cell_m, cells: all.filter_map(known).collect() }
    }

    /// The mutual information of a map with the classes, nats; unexplored is a label of its own. `to_map` returns the
    /// place on the map that shows a place of the world.
    pub(super) fn information_nats(&self, map: &LabelGrid, to_map: impl Fn((f64, f64)) -> (f64, f64)) -> f64 {
        let cell_of = |metres: f64| (metres / self.cell_m).floor() as i32;
        let pairs = self.cells.iter().map(|&(middle, class)| {
            let (x, y) = to_map(middle);
            (u32::from(map.get(Cell::new(cell_of(x), cell_of(y)))), u32::from(class))
        });
        mutual_information_nats(pairs).nats
    }
}

/// Cells of a block in each direction: a vehicle with a long backlog sends every fourth cell first.
const SIDE: i32 = 4;

/// A map as the page shows it: a coarse cell stands for the block of which only that cell was received. Where the finely sent
/// map may just end beside such a cell, another such block has to adjoin (`page/js/map/coarse.js`).
fn with_blocks(map: &LabelGrid) -> LabelGrid {
    let is_known = |cell: Cell| map.get(cell) != UNEXPLORED;
    let shifted = |cell: Cell, (dx, dy): (i32, i32)| Cell::new(cell.x + dx, cell.y + dy);
    let is_coarse = |cell: Cell| cell.x.rem_euclid(SIDE) == 0 && cell.y.rem_euclid(SIDE) == 0;
    let block = || (0..SIDE).flat_map(|dy| (0..SIDE).map(move |dx| (dx, dy)));
    let is_alone = |cell: Cell| is_known(cell) && block().skip(1).all(|by| !is_known(shifted(cell, by)));
    let may_be_edge =
        |cell: Cell| [(-1, -1), (0, -1), (1, -1), (-1, 0), (-1, 1)].iter().any(|&by| is_known(shifted(cell, by)));
    let is_block = |cell: Cell| {
        let beside = || [(SIDE, 0), (-SIDE, 0), (0, SIDE), (0, -SIDE)].map(|by| shifted(cell, by));
        !may_be_edge(cell) || beside().into_iter().any(|other| is_alone(other) && !may_be_edge(other))
    };
    let mut shown = map.clone();
    for (cell, label) in map.iter().filter(|&(cell, _)| is_coarse(cell) && is_alone(cell) && is_block(cell)) {
        block().for_each(|by| _ = shown.set(shifted(cell, by), label));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_map_holds_less_information_than_the_whole() {
        let world = World::patches(1, 0.01);
        let area = world.survey_area();
        let truth = TrueCells::new(&world, &area, 0.25);
        let whole = crate::world::true_classes(
            &world,
            scenecast_protocol::map::Rect { x: 0, y: 0, width: 104, height: 72 },
            0.25,
        );
        let part: LabelGrid = whole.iter().filter(|(cell, _)| cell.y < 5).collect();
        let [all, some, none] = [whole, part, LabelGrid::default()].map(|map| truth.information_nats(&map, |at| at));
        assert!(all > 0.5 && some < 0.2 * all && none == 0.0, "{all} {some} {none}");
    }

    fn labels(cells: &[(i32, i32)]) -> LabelGrid {
        let mut map = LabelGrid::default();
        cells.iter().for_each(|&(x, y)| _ = map.set(Cell::new(x, y), 7));
        map
    }

    #[test]
    fn a_lone_coarse_cell_stands_for_its_block() {
        let shown = with_blocks(&labels(&[(-4, 8)]));
        assert_eq!(shown.iter().count(), 16);
        assert_eq!((shown.get(Cell::new(-1, 11)), shown.get(Cell::new(0, 8))), (7, UNEXPLORED));
    }

    #[test]
    fn a_cell_of_a_finely_sent_map_stands_for_itself() {
        for cells in [&[(1, 0)][..], &[(0, 0), (3, 2)], &[(0, 0), (-1, 0)]] {
            assert_eq!(with_blocks(&labels(cells)).iter().count(), cells.len(), "{cells:?}");
        }
    }
}
