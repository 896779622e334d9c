//! The layers of a map in addition to the labels, from the levels that the surface has received.

use crate::export::CellLayer;
use scenecast_protocol::map::{LayerReplica, Rect, Replica, Spread};
use scenecast_protocol::time::Instant;

/// The layers of a map.
pub(crate) fn layers(layers: &[&LayerReplica], bounds: Rect, now: Instant) -> Vec<CellLayer> {
    layers.iter().map(|replica| layer(replica, bounds, now)).collect()
}

/// Seconds since each cell was received, 65535 = never.
pub(crate) fn ages(replica: &Replica, bounds: Rect, now: Instant) -> Vec<u16> {
    let age = |at: Instant| now.since(at).as_secs().min(65_534) as u16;
    bounds.cells().map(|cell| replica.received_at(cell).map_or(u16::MAX, age)).collect()
}

/// A layer with the bounds of the levels over which its colours are spread: those on the map, or all of its scale.
fn layer(replica: &LayerReplica, bounds: Rect, now: Instant) -> CellLayer {
    let (descriptor, shown) = (replica.descriptor(), replica.levels().shown());
    let levels: Vec<u8> = bounds.cells().map(|cell| shown.get(cell)).collect();
    let known = || levels.iter().copied().filter(|&level| level > 0);
    let (lowest, highest) = match descriptor.spread {
        Spread::Scale => (1, descriptor.levels),
        Spread::Present | Spread::Common => (known().min().unwrap_or(1), known().max().unwrap_or(1)),
    };
    let ends = |level: u8| descriptor.bounds(level).unwrap_or_default();
    let mut edges: Vec<f64> = (lowest..=highest).map(|level| rounded(ends(level).0)).collect();
    edges.push(rounded(ends(highest).1));
    CellLayer { descriptor: descriptor.clone(), lowest, edges, levels, age_s: ages(replica.levels(), bounds, now) }
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
        let bounds = Rect { x: 0, y: 0, width: 3, height: 1 };
        let cells = [(Cell::new(0, 0), 20.1), (Cell::new(2, 0), 22.9)];
        let depth = received(LayerDescriptor::depth_around(20.0, 0.5), &cells);
        let found = layer(&depth, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.edges.as_slice(), found.lowest), ([20.0, 20.5, 21.0, 21.5, 22.0, 22.5, 23.0].as_slice(), 41));
        assert_eq!((found.levels.clone(), found.age_s.clone()), (vec![41, 0, 46], vec![3, u16::MAX, 3]));
        assert_eq!([0, 1, 2].map(|at| found.value(at)), [Some(20.25), None, Some(22.75)]);
        let cells = [(Cell::new(0, 0), 0.6), (Cell::new(1, 0), 1.0)];
        let found = layer(&received(built_in(LayerId::CONFIDENCE), &cells), bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.edges, found.lowest), (vec![0.0, 0.25, 0.5, 0.75, 1.0], 1));
        assert_eq!(found.levels, [3, 4, 0]);
        let cells = [(Cell::new(0, 0), 4.2), (Cell::new(1, 0), 8.0)];
        let found = layer(&received(built_in(LayerId::CURIOSITY), &cells), bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.edges, found.lowest), (vec![4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 5));
        assert_eq!((found.levels, found.age_s), (vec![5, 9, 0], vec![3, 3, u16::MAX]));
    }
}
