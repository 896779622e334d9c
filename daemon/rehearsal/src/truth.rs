//! The true classes of a simulated sea floor.

use crate::world::World;
use scenecast_core::{Area, UserError, label_picture};
use scenecast_protocol::map::{Cell, LabelGrid, Rect};

/// The true classes of a part of a sea floor, as a picture with one pixel a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The outline of the picture in the world frame, metres.
    pub area: Area,
    /// The classes of the picture, each with its pixel value and its name.
    pub classes: Vec<(u8, String)>,
    /// An indexed PNG, north up; 0 where the class is not known.
    pub png: Vec<u8>,
}

impl Truth {
    /// The classes of an area; `None` if the world has no known classes.
    pub fn new(world: &World, area: &Area, cell_m: f64) -> Result<Option<Self>, UserError> {
        if !world.is_annotated() {
            return Ok(None);
        }
        let bounds = cells_of(area, cell_m);
        let grid = true_classes(world, bounds, cell_m);
        let png = label_picture::encode_within(&grid, bounds).map_err(|e| UserError::Failed(e.to_string()))?;
        let mut found: Vec<u8> = grid.iter().map(|(_, value)| value).collect();
        found.sort_unstable();
        found.dedup();
        let classes = found.into_iter().map(|value| (value, world.class_name(value - 1))).collect();
        let metres = |cells: i32| f64::from(cells) * cell_m;
        let area = Area {
            west: metres(bounds.x),
            south: metres(bounds.y),
            east: metres(bounds.x + bounds.width as i32),
            north: metres(bounds.y + bounds.height as i32),
        };
        Ok(Some(Self { area, classes, png }))
    }
}

/// The cells of an area, those at its edges included.
fn cells_of(area: &Area, cell_m: f64) -> Rect {
    let (x, y) = ((area.west / cell_m).floor() as i32, (area.south / cell_m).floor() as i32);
    let count = |high: f64, first: i32| ((high / cell_m).ceil() as i32 - first).max(1) as u32;
    Rect { x, y, width: count(area.east, x), height: count(area.north, y) }
}

/// The true classes of cells, shifted by one; a cell of unknown class is left out.
pub fn true_classes(world: &World, bounds: Rect, cell_m: f64) -> LabelGrid {
    let value = |cell: Cell| Some((cell, world.class_of(cell, cell_m)?.saturating_add(1).min(254)));
    bounds.cells().filter_map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_of_a_reef_names_the_classes_of_its_cells() {
        let world = World::reef(1, 0.01);
        let area = Area { west: 50.1, south: 30.0, east: 60.0, north: 35.0 };
        let truth = Truth::new(&world, &area, 0.25).unwrap().unwrap();
        assert_eq!(truth.area, Area { west: 50.0, ..area });
        assert!(truth.classes.len() > 1, "{:?}", truth.classes);
        let (cell, class) = (Cell::new(210, 130), world.class_of(Cell::new(210, 130), 0.25).unwrap());
        let known = true_classes(&world, cells_of(&area, 0.25), 0.25).get(cell);
        assert_eq!(known, class + 1);
        assert!(truth.classes.contains(&(known, world.class_name(class))));
    }
}
