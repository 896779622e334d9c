//! The map as files that other programs open in the right place.

mod files;
mod place;
mod regions;

pub(super) use files::{csv, geojson, indexed_png, ply, projection, world_file};

use super::base64;
use super::state::Map;
use scenecast_protocol::map::Rect;

/// A map cell by cell, row by row from the south-west.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Counts up whenever a cell changes.
    pub version: u64,
    /// Mission time when the ages were true, seconds.
    pub at_s: f64,
    /// Where the cells are.
    pub bounds: Rect,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// A label each, 0 = unexplored.
    pub labels: Vec<u8>,
    /// Seconds since each was heard of, 65535 = never.
    pub age_s: Vec<u16>,
}

impl Cells {
    /// The map as the API tells it.
    pub(super) fn told(&self) -> Map {
        let ages: Vec<u8> = self.age_s.iter().flat_map(|age| age.to_le_bytes()).collect();
        Map {
            version: self.version,
            at_s: self.at_s,
            x0: self.bounds.x,
            y0: self.bounds.y,
            width: self.bounds.width,
            height: self.bounds.height,
            cell_m: self.cell_m,
            labels: base64::encode(&self.labels),
            age_s: base64::encode(&ages),
        }
    }

    /// Metres east and north of a corner of the grid of cells, counted from the south-west of the map.
    fn corner_m(&self, column: u32, row: u32) -> (f64, f64) {
        let metres = |first: i32, n: u32| (f64::from(first) + f64::from(n)) * self.cell_m;
        (metres(self.bounds.x, column), metres(self.bounds.y, row))
    }

    /// The explored cells: metres east and north of the middle, label, age.
    fn explored(&self) -> impl Iterator<Item = (f64, f64, u8, u16)> {
        let width = self.bounds.width.max(1) as usize;
        self.labels.iter().zip(&self.age_s).enumerate().filter(|(_, (label, _))| **label != 0).map(
            move |(i, (&label, &age))| {
                let (x, y) = self.corner_m((i % width) as u32, (i / width) as u32);
                (x + self.cell_m / 2.0, y + self.cell_m / 2.0, label, age)
            },
        )
    }
}
