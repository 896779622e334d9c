//! A map in shared tiles, with its layers and with what is known of its labels.

use super::label_book::LabelBook;
use super::state::{ReplaySide, VehicleMarker};
use scenecast_protocol::map::{
    Cell, LabelGrid, LabelTree, LayerDescriptor, REPLICA_TILE, Rect, ReplicaTile, ReplicaTileKey, SharedTiles,
    UNEXPLORED,
};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A map of any extent, of which only tiles with received cells exist.
#[derive(Debug, Clone)]
pub struct MapCells {
    /// A number that grows with each change of a cell.
    pub version: u64,
    /// The moment of this map.
    pub at: Instant,
    /// The smallest rectangle around the explored cells.
    pub bounds: Option<Rect>,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// The shift from the map frame to the world frame, metres east and north.
    pub moved_m: (f64, f64),
    /// What the operator says of the labels.
    pub book: LabelBook,
    /// Which labels become one at coarser cuts, if that is known.
    pub tree: Option<LabelTree>,
    /// The markers that the operator has put on the map, each with its moment in UTC, where that is known.
    pub markers: Vec<(VehicleMarker, Option<String>)>,
    /// Whose map it is, and of when; `None` where that is not known.
    pub caption: Option<MapCaption>,
    /// The labels. The surface shares their tiles, so a clone costs little and stays as it is.
    pub tiles: SharedTiles,
    /// The layers beside the labels.
    pub layers: Vec<CellLayer>,
}

/// What a file of a map says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapCaption {
    /// The name of the mission; empty where it is not known.
    pub mission: String,
    /// The address of the vehicle.
    pub address: u8,
    /// Its name, which may be empty.
    pub name: String,
    /// The epoch, in which no label number changes its meaning.
    pub epoch: u8,
    /// The moment of the map in UTC, as in RFC 3339.
    pub utc: String,
    /// Whose knowledge it is; a surface has that of the operator.
    pub side: ReplaySide,
}

impl MapCaption {
    /// What it says, by key.
    pub fn facts(&self) -> [(&'static str, String); 6] {
        [
            ("mission", self.mission.clone()),
            ("epoch", self.epoch.to_string()),
            ("vehicle", self.address.to_string()),
            ("vehicle_name", self.name.clone()),
            ("utc", self.utc.clone()),
            ("known_by", self.side.name().to_owned()),
        ]
    }

    /// The same in words, on one line.
    pub fn title(&self) -> String {
        let name = if self.name.is_empty() { String::new() } else { format!(" ({})", self.name) };
        let what = match self.side {
            ReplaySide::Operator => "scenecast map",
            ReplaySide::Vehicle => "scenecast map as the vehicle knew it,",
            ReplaySide::Difference => "cells that differ between the maps of operator and vehicle,",
        };
        let title = format!("{what} of vehicle {}{name} at {}", self.address, self.utc);
        title.replace(char::is_control, " ")
    }
}

/// A quantity of each cell.
#[derive(Debug, Clone)]
pub struct CellLayer {
    /// Its name, unit and colours, and the use of its values.
    pub descriptor: LayerDescriptor,
    /// The level whose bounds are the first two of `edges`.
    pub lowest: u8,
    /// The bounds of this level and of those above it, one after the other, in units.
    pub edges: Vec<f64>,
    /// Its levels, shared like those of the labels.
    pub tiles: SharedTiles,
}

/// The tile of a cell, and its place in the tile.
pub fn tile_place(cell: Cell) -> (ReplicaTileKey, usize) {
    let (row, column) = (cell.y.div_euclid(REPLICA_TILE), cell.x.div_euclid(REPLICA_TILE));
    let place = cell.y.rem_euclid(REPLICA_TILE) * REPLICA_TILE + cell.x.rem_euclid(REPLICA_TILE);
    ((row, column), place as usize)
}

fn level(tiles: &SharedTiles, cell: Cell) -> u8 {
    let (key, place) = tile_place(cell);
    tiles.get(&key).map_or(0, |tile| tile.labels()[place])
}

impl CellLayer {
    /// The level of a cell, 0 = unknown.
    pub fn level(&self, cell: Cell) -> u8 {
        level(&self.tiles, cell)
    }

    /// The value of a cell: the middle of its level, if that is known.
    pub fn value(&self, cell: Cell) -> Option<f64> {
        self.descriptor.middle(self.level(cell))
    }
}

impl MapCells {
    /// A map of labels without layers and times of reception, at the start of the mission.
    pub fn of_labels(grid: &LabelGrid, cell_m: f64) -> Self {
        Self {
            version: 1,
            at: Instant::ZERO,
            bounds: grid.bounds(),
            cell_m,
            moved_m: (0.0, 0.0),
            book: LabelBook::default(),
            tree: None,
            markers: Vec::new(),
            caption: None,
            tiles: ReplicaTile::tiles_of(grid),
            layers: Vec::new(),
        }
    }

    /// The map with its tree cut at `count` labels, each of which stands for those that have joined it.
    #[must_use]
    pub fn cut(mut self, count: usize) -> Self {
        if let Some(tree) = &self.tree {
            let group = |label: u8| tree.group_of(label, count);
            self.book = self.book.grouped(group, &self.counts());
            self.tiles.values_mut().for_each(|tile| *tile = Arc::new(tile.relabelled(group)));
        }
        self
    }

    /// The number of cells of each label.
    pub fn counts(&self) -> BTreeMap<u8, u32> {
        let mut counts = BTreeMap::new();
        let labels = self.tiles.values().flat_map(|tile| tile.labels().iter()).filter(|label| **label != UNEXPLORED);
        labels.for_each(|label| *counts.entry(*label).or_default() += 1);
        counts
    }

    /// The bounds, empty for an empty map.
    pub fn rectangle(&self) -> Rect {
        self.bounds.unwrap_or(Rect { x: 0, y: 0, width: 0, height: 0 })
    }

    /// The south-west corner of a cell in the world, metres east and north.
    pub fn corner_m(&self, x: i64, y: i64) -> (f64, f64) {
        (x as f64 * self.cell_m + self.moved_m.0, y as f64 * self.cell_m + self.moved_m.1)
    }

    /// The label of a cell, 0 = unexplored.
    pub fn label(&self, cell: Cell) -> u8 {
        level(&self.tiles, cell)
    }
}
