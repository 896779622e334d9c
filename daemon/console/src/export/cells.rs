//! A map in shared tiles, its cells one by one, and its form in JSON.

use super::ExportError;
use crate::state::{LayerBody, MapBody, ReplaySide, VehicleMarker};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_protocol::map::{
    Cell, LabelGrid, LabelTree, LayerDescriptor, Quantity, REPLICA_TILE, Rect, ReplicaTile, ReplicaTileKey, UNEXPLORED,
};
use scenecast_protocol::time::Instant;
use scenecast_surface::LabelBook;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Tiles by row and column. The surface shares them, so a clone costs little and stays as it is.
pub(crate) use scenecast_protocol::map::SharedTiles as Tiles;

/// The most cells of a map or a region in JSON.
pub(crate) const MAX_JSON_CELLS: u64 = 1 << 20;

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
    pub(crate) tiles: Tiles,
    pub(crate) layers: Vec<CellLayer>,
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
    pub(super) fn facts(&self) -> [(&'static str, String); 6] {
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
    pub(super) fn title(&self) -> String {
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
    pub(crate) descriptor: LayerDescriptor,
    /// The level whose bounds are the first two of `edges`.
    pub(crate) lowest: u8,
    /// The bounds of this level and of those above it, one after the other, in units.
    pub(crate) edges: Vec<f64>,
    pub(crate) tiles: Tiles,
}

/// The tile of a cell, and its place in the tile.
pub(crate) fn place_of(cell: Cell) -> (ReplicaTileKey, usize) {
    let (row, column) = (cell.y.div_euclid(REPLICA_TILE), cell.x.div_euclid(REPLICA_TILE));
    let place = cell.y.rem_euclid(REPLICA_TILE) * REPLICA_TILE + cell.x.rem_euclid(REPLICA_TILE);
    ((row, column), place as usize)
}

fn level(tiles: &Tiles, cell: Cell) -> u8 {
    let (key, place) = place_of(cell);
    tiles.get(&key).map_or(0, |tile| tile.labels()[place])
}

/// Base64 of levels and of ages in whole seconds, 65535 = never, of the cells of a region.
fn region_body(tiles: &Tiles, region: Rect, now: Instant) -> (String, String) {
    let levels: Vec<u8> = region.cells().map(|cell| level(tiles, cell)).collect();
    let mut ages: Vec<u8> = Vec::new();
    let mut held: Option<(ReplicaTileKey, Vec<u16>)> = None;
    for cell in region.cells() {
        let (key, place) = place_of(cell);
        if held.as_ref().is_none_or(|(of, _)| *of != key) {
            let age = |at: Option<Instant>| at.map_or(u16::MAX, |at| age_s(at, now));
            held = Some((key, tiles.get(&key).map_or_else(Vec::new, |t| t.received().map(age).collect())));
        }
        let age = held.as_ref().and_then(|(_, ages)| ages.get(place)).copied().unwrap_or(u16::MAX);
        ages.extend(age.to_le_bytes());
    }
    (STANDARD.encode(levels), STANDARD.encode(ages))
}

fn age_s(at: Instant, now: Instant) -> u16 {
    now.since(at).as_secs().min(65_534) as u16
}

impl CellLayer {
    /// Its name, unit and colours, and the use of its values.
    pub fn descriptor(&self) -> &LayerDescriptor {
        &self.descriptor
    }

    /// The value of a cell: the middle of its level, if that is known.
    pub fn value(&self, cell: Cell) -> Option<f64> {
        self.descriptor.middle(level(&self.tiles, cell))
    }

    fn body(&self, region: Rect, now: Instant) -> LayerBody {
        let layer = &self.descriptor;
        let (data, age_s) = region_body(&self.tiles, region, now);
        LayerBody {
            name: layer.name.clone().into_owned(),
            unit: layer.unit.clone().into_owned(),
            is_depth: layer.quantity == Quantity::Depth,
            palette: layer.palette.name().to_owned(),
            spread: layer.spread.name().to_owned(),
            lowest: self.lowest,
            edges: self.edges.clone(),
            data,
            age_s,
        }
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
    pub(super) fn counts(&self) -> BTreeMap<u8, u32> {
        let mut counts = BTreeMap::new();
        let labels = self.tiles.values().flat_map(|tile| tile.labels().iter()).filter(|label| **label != UNEXPLORED);
        labels.for_each(|label| *counts.entry(*label).or_default() += 1);
        counts
    }

    /// The cells of a region, by default of the bounds. The error is one line for people.
    pub(crate) fn body(&self, region: Option<Rect>) -> Result<MapBody, ExportError> {
        let region = region.unwrap_or(self.rectangle());
        if region.area() > MAX_JSON_CELLS {
            let Rect { width, height, .. } = region;
            return Err(ExportError::LargeJson { width, height });
        }
        let (labels, age_s) = region_body(&self.tiles, region, self.at);
        Ok(MapBody {
            version: self.version,
            at_s: crate::snapshot::seconds(self.at),
            x0: region.x,
            y0: region.y,
            width: region.width,
            height: region.height,
            cell_m: self.cell_m,
            labels,
            age_s,
            layers: self.layers.iter().map(|layer| layer.body(region, self.at)).collect(),
        })
    }

    /// The bounds, empty for an empty map.
    pub(crate) fn rectangle(&self) -> Rect {
        self.bounds.unwrap_or(Rect { x: 0, y: 0, width: 0, height: 0 })
    }

    /// The south-west corner of a cell in the world, metres east and north.
    pub(super) fn corner_m(&self, x: i64, y: i64) -> (f64, f64) {
        (x as f64 * self.cell_m + self.moved_m.0, y as f64 * self.cell_m + self.moved_m.1)
    }

    /// The layers beside the labels.
    pub fn layers(&self) -> &[CellLayer] {
        &self.layers
    }

    /// The label of a cell, 0 = unexplored.
    pub fn label(&self, cell: Cell) -> u8 {
        level(&self.tiles, cell)
    }

    /// The explored cells, row by row from the south, each row from the west.
    pub(super) fn explored(&self) -> impl Iterator<Item = ExploredCell> + '_ {
        let mut rows: BTreeMap<i32, Vec<(i32, &ReplicaTile)>> = BTreeMap::new();
        for (&(row, column), tile) in &self.tiles {
            rows.entry(row).or_default().push((column, tile));
        }
        rows.into_iter().flat_map(move |(row, tiles)| self.explored_in_row(row, &tiles))
    }

    fn explored_in_row(&self, row: i32, tiles: &[(i32, &ReplicaTile)]) -> Vec<ExploredCell> {
        let received: Vec<Vec<Option<Instant>>> = tiles.iter().map(|(_, tile)| tile.received().collect()).collect();
        let mut found = Vec::new();
        for line in 0..REPLICA_TILE {
            for (&(column, tile), received) in tiles.iter().zip(&received) {
                let from = (line * REPLICA_TILE) as usize;
                let cells = tile.labels()[from..].iter().zip(&received[from..]).take(REPLICA_TILE as usize);
                found.extend((0i32..).zip(cells).filter(|(_, (label, _))| **label != 0).map(|(x, (&label, &at))| {
                    let cell = Cell::new(column.wrapping_mul(REPLICA_TILE) + x, row.wrapping_mul(REPLICA_TILE) + line);
                    let (west, south) = self.corner_m(i64::from(cell.x), i64::from(cell.y));
                    let half = self.cell_m / 2.0;
                    let age_s = at.map(|at| age_s(at, self.at));
                    ExploredCell { cell, x: west + half, y: south + half, label, age_s }
                }));
            }
        }
        found
    }
}

/// An explored cell: its centre in metres east and north in the world, its label, seconds since it was received.
pub(super) struct ExploredCell {
    pub(super) cell: Cell,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) label: u8,
    pub(super) age_s: Option<u16>,
}
