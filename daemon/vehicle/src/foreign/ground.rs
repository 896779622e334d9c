//! The values of a grid in the cells of the map.

use scenecast_labels::{Ground, Raster, Refusal};
use scenecast_protocol::map::Cell;

/// Most cells of the map that one grid or image may cover.
pub(super) const MAX_CELLS: u64 = 1 << 22;

/// A grid on the ground, to be read in cells of the map.
pub(super) struct GroundRaster<'a, T> {
    raster: &'a Raster<T>,
    ground: Ground,
    cell_m: f64,
}

impl<'a, T: Copy> GroundRaster<'a, T> {
    /// # Errors
    /// The grid covers more than [`MAX_CELLS`] cells of `cell_m` metres.
    pub(super) fn new(raster: &'a Raster<T>, ground: Ground, cell_m: f64) -> Result<Self, Refusal> {
        let across = |pixels: u32| (f64::from(pixels) * ground.cell_m / cell_m).ceil() as u64 + 1;
        let cells = across(raster.width).saturating_mul(across(raster.height));
        match cells <= MAX_CELLS {
            true => Ok(Self { raster, ground, cell_m }),
            false => Err(Refusal::Cells(cells, MAX_CELLS)),
        }
    }

    /// Calls `each` with every cell of the map whose middle the grid covers, and with the grid's values in it: that at its
    /// middle, or, where the grid has smaller cells, those of all grid cells whose middles lie in it.
    pub(super) fn for_each(&self, mut each: impl FnMut(Cell, &[T])) {
        let Ground { west_m, south_m, cell_m: edge } = self.ground;
        let (columns, rows) = (self.range(west_m, self.raster.width), self.range(south_m, self.raster.height));
        let is_finer = edge < self.cell_m * 0.999;
        let mut values = Vec::new();
        for y in rows {
            for x in columns.clone() {
                values.clear();
                if is_finer {
                    let across = |cell: i32, origin: f64| {
                        let first = |side: f64| ((side - origin) / edge - 0.5 - 1e-9).ceil().max(0.0) as u32;
                        first(f64::from(cell) * self.cell_m)..first((f64::from(cell) + 1.0) * self.cell_m)
                    };
                    let of_row = |north: u32| across(x, west_m).filter_map(move |column| self.at(column, north));
                    values.extend(across(y, south_m).flat_map(of_row));
                } else {
                    let place =
                        |cell: i32, origin: f64| (((f64::from(cell) + 0.5) * self.cell_m - origin) / edge).floor();
                    values.extend(self.at(place(x, west_m) as u32, place(y, south_m) as u32));
                }
                if !values.is_empty() {
                    each(Cell::new(x, y), &values);
                }
            }
        }
    }

    /// The cells whose middles lie between the sides of the grid.
    fn range(&self, origin_m: f64, pixels: u32) -> std::ops::Range<i32> {
        let cell = |side_m: f64| (side_m / self.cell_m - 0.5 - 1e-9).ceil() as i32;
        cell(origin_m)..cell(origin_m + f64::from(pixels) * self.ground.cell_m)
    }

    /// The value in a column of a row that is counted from the south.
    fn at(&self, column: u32, north: u32) -> Option<T> {
        self.raster.get(column, self.raster.height.checked_sub(1 + north)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(raster: &Raster, ground: Ground, cell_m: f64) -> Vec<(i32, i32, Vec<u8>)> {
        let mut found = Vec::new();
        GroundRaster::new(raster, ground, cell_m).unwrap().for_each(|c, v| found.push((c.x, c.y, v.to_vec())));
        found
    }

    #[test]
    fn a_grid_of_the_same_cells_is_read_one_by_one() {
        let raster = Raster { width: 3, height: 2, values: vec![1, 2, 3, 4, 5, 6] };
        for cell_m in [0.1, 0.25, 1.0 / 3.0] {
            let ground = Ground { west_m: -2.0 * cell_m, south_m: 7.0 * cell_m, cell_m };
            let cells: Vec<(i32, i32, u8)> =
                read(&raster, ground, cell_m).into_iter().map(|(x, y, v)| (x, y, v[0])).collect();
            assert_eq!(cells, [(-2, 7, 4), (-1, 7, 5), (0, 7, 6), (-2, 8, 1), (-1, 8, 2), (0, 8, 3)]);
        }
    }

    #[test]
    fn coarser_and_finer_grids_fill_every_cell() {
        let raster = Raster { width: 2, height: 2, values: vec![1, 2, 3, 4] };
        let coarse = read(&raster, Ground { west_m: 0.0, south_m: 0.0, cell_m: 2.0 }, 1.0);
        assert_eq!(coarse.len(), 16);
        assert!(
            coarse.contains(&(0, 0, vec![3])) && coarse.contains(&(3, 3, vec![2])) && coarse.contains(&(1, 2, vec![1]))
        );
        let fine = read(&raster, Ground { west_m: 1.0, south_m: 0.0, cell_m: 0.5 }, 1.0);
        assert_eq!(fine, [(1, 0, vec![3, 4, 1, 2])]);
        let huge: Raster = Raster { width: 4096, height: 4096, values: Vec::new() };
        assert!(GroundRaster::new(&huge, Ground { west_m: 0.0, south_m: 0.0, cell_m: 1e4 }, 0.1).is_err());
    }
}
