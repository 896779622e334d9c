//! Maps of vehicles, of the present and of earlier runs.

use super::Reply;
use crate::Surface;
use crate::map_cells::{CellLayer, MapCaption, MapCells};
use crate::record::VehicleMemory;
use crate::state::{CellHistory, FormerLabel, seconds};
use scenecast_protocol::map::{Cell, LayerReplica, Spread};
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

/// The layers of a map.
pub fn cell_layers(layers: &[&LayerReplica]) -> Vec<CellLayer> {
    layers.iter().map(|replica| layer(replica)).collect()
}

/// A layer with the bounds of the levels over which its colours are spread: those on the map, or all of its scale.
fn layer(replica: &LayerReplica) -> CellLayer {
    let descriptor = replica.descriptor();
    let known = || replica.levels().counts().map(|(level, _)| level);
    let (lowest, highest) = match descriptor.spread {
        Spread::Scale => (1, descriptor.levels),
        Spread::Present | Spread::Common => (known().min().unwrap_or(1), known().max().unwrap_or(1)),
    };
    let ends = |level: u8| descriptor.bounds(level).unwrap_or_default();
    let mut edges: Vec<f64> = (lowest..=highest).map(|level| rounded(ends(level).0)).collect();
    edges.push(rounded(ends(highest).1));
    CellLayer { descriptor: descriptor.clone(), lowest, edges, tiles: replica.levels().tiles().clone() }
}

/// Rounded, since binary fractions have noise in the last digits.
fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LayerDescriptor, LayerId, LayerSet, LayerSource, StateSource};
    use scenecast_protocol::map_codec::Codec;
    use scenecast_protocol::time::Instant;
    use std::time::Duration;

    /// The layer at the surface after all values were received at 10 s.
    fn received(descriptor: LayerDescriptor, cells: &[(Cell, f64)]) -> LayerReplica {
        let at = Instant::from_secs_f64(10.0);
        let mut source = LayerSource::new(LayerId::DEPTH, descriptor.clone(), Codec::Png, Duration::ZERO);
        source.set(cells.iter().copied(), at);
        let (_, announced) = source.next_chunk(1000, at).unwrap();
        source.handle_fate(announced, true, at);
        let (chunk, _) = source.next_chunk(1000, at).unwrap();
        let mut replica = LayerReplica::new(descriptor);
        assert!(replica.apply(1, &chunk[1..], at));
        replica
    }

    fn built_in(id: LayerId) -> LayerDescriptor {
        LayerSet::default().get(id).unwrap().clone()
    }

    #[test]
    fn a_layer_has_the_bounds_of_its_levels() {
        let levels = |found: &CellLayer| [0, 1, 2].map(|x| found.tiles[&(0, 0)].labels()[x]);
        let cells = [(Cell::new(0, 0), 20.1), (Cell::new(2, 0), 22.9)];
        let found = layer(&received(LayerDescriptor::depth_around(20.0, 0.5), &cells));
        assert_eq!((found.edges.as_slice(), found.lowest), ([20.0, 20.5, 21.0, 21.5, 22.0, 22.5, 23.0].as_slice(), 41));
        assert_eq!(levels(&found), [41, 0, 46]);
        let at: Vec<Option<Instant>> = found.tiles[&(0, 0)].received().take(3).collect();
        assert_eq!(at, [Some(Instant::from_secs_f64(10.0)), None, Some(Instant::from_secs_f64(10.0))]);
        assert_eq!([0, 1, 2].map(|x| found.value(Cell::new(x, 0))), [Some(20.25), None, Some(22.75)]);
        let cells = [(Cell::new(0, 0), 0.6), (Cell::new(1, 0), 1.0)];
        let found = layer(&received(built_in(LayerId::CONFIDENCE), &cells));
        assert_eq!((found.edges.clone(), found.lowest), (vec![0.0, 0.25, 0.5, 0.75, 1.0], 1));
        assert_eq!(levels(&found), [3, 4, 0]);
        let cells = [(Cell::new(0, 0), 4.2), (Cell::new(1, 0), 8.0)];
        let found = layer(&received(built_in(LayerId::CURIOSITY), &cells));
        assert_eq!((found.edges.clone(), found.lowest), (vec![4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 5));
        assert_eq!(levels(&found), [5, 9, 0]);
    }
}
