//! The cells of a map, and their form in JSON.

use crate::state::{LayerBody, MapBody};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_protocol::map::{LayerDescriptor, Quantity, Rect};

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
    pub layers: Vec<CellLayer>,
}

/// A quantity of each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct CellLayer {
    /// Its name, unit and colours, and the use of its values.
    pub descriptor: LayerDescriptor,
    /// The level whose bounds are the first two of `edges`.
    pub lowest: u8,
    /// The bounds of this level and of those above it, one after the other, in units.
    pub edges: Vec<f64>,
    /// The level of each cell, 0 = unknown.
    pub levels: Vec<u8>,
    /// Seconds since each cell was received, 65535 = never.
    pub age_s: Vec<u16>,
}

impl CellLayer {
    /// The value of a cell: the middle of its level, if that is known.
    pub(crate) fn value(&self, at: usize) -> Option<f64> {
        self.descriptor.middle(*self.levels.get(at)?)
    }

    fn body(&self) -> LayerBody {
        let layer = &self.descriptor;
        LayerBody {
            name: layer.name.clone().into_owned(),
            unit: layer.unit.clone().into_owned(),
            is_depth: layer.quantity == Quantity::Depth,
            palette: layer.palette.name().to_owned(),
            spread: layer.spread.name().to_owned(),
            lowest: self.lowest,
            edges: self.edges.clone(),
            data: STANDARD.encode(&self.levels),
            age_s: ages(&self.age_s),
        }
    }
}

fn ages(seconds: &[u16]) -> String {
    STANDARD.encode(seconds.iter().flat_map(|age| age.to_le_bytes()).collect::<Vec<u8>>())
}

impl MapCells {
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
