//! The cells of a map one by one, and in JSON.

use super::ExportError;
use crate::bodies::{LayerBody, MapBody};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_protocol::map::{Cell, Quantity, REPLICA_TILE, Rect, ReplicaTile, ReplicaTileKey, SharedTiles};
use scenecast_protocol::time::Instant;
use scenecast_surface::state::seconds;
use scenecast_surface::{CellLayer, MapCells, tile_place};
use std::collections::BTreeMap;

/// The most cells of a map or a region in JSON.
pub(crate) const MAX_JSON_CELLS: u64 = 1 << 20;

/// Base64 of levels and of ages in whole seconds, 65535 = never, of the cells of a region.
fn region_body(tiles: &SharedTiles, level: impl Fn(Cell) -> u8, region: Rect, now: Instant) -> (String, String) {
    let levels: Vec<u8> = region.cells().map(level).collect();
    let mut ages: Vec<u8> = Vec::new();
    let mut held: Option<(ReplicaTileKey, Vec<u16>)> = None;
    for cell in region.cells() {
        let (key, place) = tile_place(cell);
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

fn layer_body(layer: &CellLayer, region: Rect, now: Instant) -> LayerBody {
    let CellLayer { descriptor, lowest, edges, tiles } = layer;
    let (data, age_s) = region_body(tiles, |cell| layer.level(cell), region, now);
    LayerBody {
        name: descriptor.name.clone().into_owned(),
        unit: descriptor.unit.clone().into_owned(),
        is_depth: descriptor.quantity == Quantity::Depth,
        palette: descriptor.palette.name().to_owned(),
        spread: descriptor.spread.name().to_owned(),
        lowest: *lowest,
        edges: edges.clone(),
        data,
        age_s,
    }
}

/// The cells of a region, by default of the bounds. The error is one line for people.
pub(crate) fn map_body(cells: &MapCells, region: Option<Rect>) -> Result<MapBody, ExportError> {
    let region = region.unwrap_or(cells.rectangle());
    if region.area() > MAX_JSON_CELLS {
        let Rect { width, height, .. } = region;
        return Err(ExportError::LargeJson { width, height });
    }
    let (labels, age_s) = region_body(&cells.tiles, |cell| cells.label(cell), region, cells.at);
    Ok(MapBody {
        version: cells.version,
        at_s: seconds(cells.at),
        x0: region.x,
        y0: region.y,
        width: region.width,
        height: region.height,
        cell_m: cells.cell_m,
        labels,
        age_s,
        layers: cells.layers.iter().map(|layer| layer_body(layer, region, cells.at)).collect(),
    })
}

/// An explored cell: its centre in metres east and north in the world, its label, seconds since it was received.
pub(super) struct ExploredCell {
    pub(super) cell: Cell,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) label: u8,
    pub(super) age_s: Option<u16>,
}

/// The explored cells, row by row from the south, each row from the west.
pub(super) fn explored(cells: &MapCells) -> impl Iterator<Item = ExploredCell> + '_ {
    let mut rows: BTreeMap<i32, Vec<(i32, &ReplicaTile)>> = BTreeMap::new();
    for (&(row, column), tile) in &cells.tiles {
        rows.entry(row).or_default().push((column, tile));
    }
    rows.into_iter().flat_map(move |(row, tiles)| explored_in_row(cells, row, &tiles))
}

fn explored_in_row(map: &MapCells, row: i32, tiles: &[(i32, &ReplicaTile)]) -> Vec<ExploredCell> {
    let received: Vec<Vec<Option<Instant>>> = tiles.iter().map(|(_, tile)| tile.received().collect()).collect();
    let mut found = Vec::new();
    for line in 0..REPLICA_TILE {
        for (&(column, tile), received) in tiles.iter().zip(&received) {
            let from = (line * REPLICA_TILE) as usize;
            let cells = tile.labels()[from..].iter().zip(&received[from..]).take(REPLICA_TILE as usize);
            found.extend((0i32..).zip(cells).filter(|(_, (label, _))| **label != 0).map(|(x, (&label, &at))| {
                let cell = Cell::new(column.wrapping_mul(REPLICA_TILE) + x, row.wrapping_mul(REPLICA_TILE) + line);
                let (west, south) = map.corner_m(i64::from(cell.x), i64::from(cell.y));
                let half = map.cell_m / 2.0;
                let age_s = at.map(|at| age_s(at, map.at));
                ExploredCell { cell, x: west + half, y: south + half, label, age_s }
            }));
        }
    }
    found
}
