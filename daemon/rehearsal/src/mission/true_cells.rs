//! The true classes of the survey's area, with which every map of a mission is compared.

use crate::world::World;
use scenecast_core::Area;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_scoring::mutual_information_nats;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_map_holds_less_information_than_the_whole() {
        let world = World::patches(1, 0.01);
        let area = world.survey_area();
        let truth = TrueCells::new(&world, &area, 0.25);
        let whole = crate::truth::true_classes(
            &world,
            scenecast_protocol::map::Rect { x: 0, y: 0, width: 104, height: 72 },
            0.25,
        );
        let part: LabelGrid = whole.iter().filter(|(cell, _)| cell.y < 5).collect();
        let [all, some, none] = [whole, part, LabelGrid::default()].map(|map| truth.information_nats(&map, |at| at));
        assert!(all > 0.5 && some < 0.2 * all && none == 0.0, "{all} {some} {none}");
    }
}
