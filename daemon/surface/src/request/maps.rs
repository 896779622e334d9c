//! Maps of vehicles, of the present and of earlier runs.

use super::Reply;
use crate::Surface;
use crate::layers::cell_layers;
use crate::map_cells::{MapCaption, MapCells};
use crate::record::VehicleMemory;
use crate::state::{CellHistory, FormerLabel, seconds};
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;

/// The labels that a cell had before, of what the surface has kept about the vehicle.
pub fn former_labels(kept: Option<&VehicleMemory>, cell: Cell) -> Reply {
    let Some(kept) = kept else { return Reply::NotFound };
    let former = kept.former_labels(cell).map(|(label, until)| FormerLabel { label, until_s: seconds(until) });
    Reply::FormerLabels(CellHistory { former: former.collect() })
}

/// The cells of an archived map. Their ages count from the last one that was received.
pub fn archived_cells(map: &VehicleMemory, cell_m: f64, caption: Option<MapCaption>) -> MapCells {
    let (labels, layers) = (map.map().labels(), map.map().layers().map(|(_, layer)| layer).collect::<Vec<_>>());
    MapCells {
        version: map.archived().map_or(0, |(_, cells)| cells),
        at: labels.updated().unwrap_or_default(),
        bounds: labels.bounds(),
        cell_m,
        moved_m: map.placement_m().unwrap_or((0.0, 0.0)),
        book: map.labels().clone(),
        tree: map.tree(),
        markers: map.markers().map(|marker| (crate::snapshot::marker(marker), None)).collect(),
        caption,
        tiles: labels.tiles().clone(),
        layers: cell_layers(&layers),
    }
}

/// The map, whose tiles the surface shares: the link waits for a list of tiles and not for a copy of their cells.
pub(super) fn map(surface: &Surface, vehicle: Address, cell_m: f64, now: Instant) -> Option<Reply> {
    let view = surface.view(vehicle)?;
    // The vehicle states the edge of its cells; the configured one holds until then.
    let cell_m = view.cell_m().unwrap_or(cell_m);
    Some(Reply::Map(MapCells {
        version: surface.map_version(vehicle),
        at: now,
        bounds: surface.map_bounds(vehicle),
        cell_m,
        moved_m: (0.0, 0.0),
        book: crate::LabelBook::default(),
        tree: None,
        markers: Vec::new(),
        caption: None,
        tiles: surface.map_tiles(vehicle)?,
        layers: cell_layers(&surface.map_layers(vehicle)),
    }))
}
