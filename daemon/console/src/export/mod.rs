//! The map as files that other programs open in the right place.

mod files;
mod place;
mod regions;

pub(super) use files::{csv, geojson, indexed_png, ply, projection, world_file};

use super::base64;
use super::state::{self, Map};
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
    /// By how much the map is moved to lie where it belongs in the world, metres east and north.
    pub moved_m: (f64, f64),
    /// A label each, 0 = unexplored.
    pub labels: Vec<u8>,
    /// Seconds since each was heard of, 65535 = never.
    pub age_s: Vec<u16>,
    /// What else is known of them.
    pub layers: Vec<Layer>,
}

/// A quantity of each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// What it is.
    pub name: &'static str,
    /// Its unit, empty if it has none.
    pub unit: &'static str,
    /// Value of shade 0.
    pub min: f64,
    /// Value of shade 254.
    pub max: f64,
    /// What a level spans.
    pub step: f64,
    /// 0 to 254 from `min` to `max`, 255 not known.
    pub shades: Vec<u8>,
    /// Seconds since each was heard of, 65535 = never.
    pub age_s: Vec<u16>,
}

impl Layer {
    /// The value of a cell, if it is known.
    pub(super) fn value(&self, at: usize) -> Option<f64> {
        let shade = self.shades.get(at).filter(|shade| **shade < 255)?;
        Some(self.min + (self.max - self.min) * f64::from(*shade) / 254.0)
    }

    fn told(&self) -> state::Layer {
        state::Layer {
            name: self.name.to_owned(),
            unit: self.unit.to_owned(),
            min: self.min,
            max: self.max,
            step: self.step,
            data: base64::encode(&self.shades),
            age_s: ages(&self.age_s),
        }
    }
}

fn ages(seconds: &[u16]) -> String {
    base64::encode(&seconds.iter().flat_map(|age| age.to_le_bytes()).collect::<Vec<u8>>())
}

impl Cells {
    /// The map as the API tells it.
    pub(super) fn told(&self) -> Map {
        Map {
            version: self.version,
            at_s: self.at_s,
            x0: self.bounds.x,
            y0: self.bounds.y,
            width: self.bounds.width,
            height: self.bounds.height,
            cell_m: self.cell_m,
            labels: base64::encode(&self.labels),
            age_s: ages(&self.age_s),
            layers: self.layers.iter().map(Layer::told).collect(),
        }
    }

    /// Metres east and north in the world of a corner of the grid of cells, counted from the south-west of the map.
    fn corner_m(&self, column: u32, row: u32) -> (f64, f64) {
        let metres = |first: i32, n: u32, moved: f64| (f64::from(first) + f64::from(n)) * self.cell_m + moved;
        (metres(self.bounds.x, column, self.moved_m.0), metres(self.bounds.y, row, self.moved_m.1))
    }

    /// The explored cells.
    fn explored(&self) -> impl Iterator<Item = Explored> {
        let width = self.bounds.width.max(1) as usize;
        self.labels.iter().zip(&self.age_s).enumerate().filter(|(_, (label, _))| **label != 0).map(
            move |(at, (&label, &age_s))| {
                let (x, y) = self.corner_m((at % width) as u32, (at / width) as u32);
                Explored { at, x: x + self.cell_m / 2.0, y: y + self.cell_m / 2.0, label, age_s }
            },
        )
    }
}

/// An explored cell: which one, metres east and north of its middle, label, seconds since it was heard of.
struct Explored {
    at: usize,
    x: f64,
    y: f64,
    label: u8,
    age_s: u16,
}
