//! The cells of a map, and their form in JSON.

use crate::state::{LayerBody, MapBody};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_protocol::map::Rect;

/// A map cell by cell, row by row from the south-west.
#[derive(Debug, Clone, PartialEq)]
pub struct MapCells {
    /// A number that grows with each change of a cell.
    pub version: u64,
    /// Mission time to which the ages refer, seconds.
    pub at_s: f64,
    /// The columns and rows of the cells.
    pub bounds: Rect,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// The shift from the map frame to the world frame, metres east and north.
    pub moved_m: (f64, f64),
    /// The label of each cell, 0 = unexplored.
    pub labels: Vec<u8>,
    /// Seconds since each cell was received, 65535 = never.
    pub age_s: Vec<u16>,
    /// The other layers.
    pub layers: Vec<CellLayer>,
}

/// A quantity of each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct CellLayer {
    /// Its name, such as `depth`.
    pub name: &'static str,
    /// Its unit, empty if it has none.
    pub unit: &'static str,
    /// Value of shade 0.
    pub min: f64,
    /// Value of shade 254.
    pub max: f64,
    /// Width of a level.
    pub step: f64,
    /// 0 to 254 from `min` to `max`, 255 = unknown.
    pub shades: Vec<u8>,
    /// Seconds since each cell was received, 65535 = never.
    pub age_s: Vec<u16>,
}

impl CellLayer {
    /// The value of a cell, if it is known.
    pub(crate) fn value(&self, at: usize) -> Option<f64> {
        let shade = self.shades.get(at).filter(|shade| **shade < 255)?;
        Some(self.min + (self.max - self.min) * f64::from(*shade) / 254.0)
    }

    fn body(&self) -> LayerBody {
        LayerBody {
            name: self.name.to_owned(),
            unit: self.unit.to_owned(),
            min: self.min,
            max: self.max,
            step: self.step,
            data: STANDARD.encode(&self.shades),
            age_s: ages(&self.age_s),
        }
    }
}

fn ages(seconds: &[u16]) -> String {
    STANDARD.encode(seconds.iter().flat_map(|age| age.to_le_bytes()).collect::<Vec<u8>>())
}

impl MapCells {
    /// The map for JSON.
    pub(crate) fn body(&self) -> MapBody {
        MapBody {
            version: self.version,
            at_s: self.at_s,
            x0: self.bounds.x,
            y0: self.bounds.y,
            width: self.bounds.width,
            height: self.bounds.height,
            cell_m: self.cell_m,
            labels: STANDARD.encode(&self.labels),
            age_s: ages(&self.age_s),
            layers: self.layers.iter().map(CellLayer::body).collect(),
        }
    }

    /// The place of a corner of the cells in the world, metres east and north; columns and rows count from the south-west.
    pub(super) fn corner_m(&self, column: u32, row: u32) -> (f64, f64) {
        let metres = |first: i32, n: u32, moved: f64| (f64::from(first) + f64::from(n)) * self.cell_m + moved;
        (metres(self.bounds.x, column, self.moved_m.0), metres(self.bounds.y, row, self.moved_m.1))
    }

    /// The explored cells.
    pub(super) fn explored(&self) -> impl Iterator<Item = ExploredCell> {
        let width = self.bounds.width.max(1) as usize;
        self.labels.iter().zip(&self.age_s).enumerate().filter(|(_, (label, _))| **label != 0).map(
            move |(at, (&label, &age_s))| {
                let (x, y) = self.corner_m((at % width) as u32, (at / width) as u32);
                ExploredCell { at, x: x + self.cell_m / 2.0, y: y + self.cell_m / 2.0, label, age_s }
            },
        )
    }
}

/// An explored cell: its index, its centre in metres east and north in the world, its label, seconds since it was received.
pub(super) struct ExploredCell {
    pub(super) at: usize,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) label: u8,
    pub(super) age_s: u16,
}
