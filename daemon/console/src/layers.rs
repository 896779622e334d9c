//! The layers of a map in addition to the labels, from the levels that the surface has received.

use crate::export::CellLayer;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{PlaneKind, PlaneReplica, Rect, Replica};
use scenecast_protocol::time::Instant;

/// The layers of which a value was received.
pub(crate) fn layers(view: &PeerView<'_>, bounds: Rect, now: Instant) -> Vec<CellLayer> {
    PlaneKind::ALL.into_iter().filter_map(|kind| Some(layer(kind, view.plane(kind)?, bounds, now))).collect()
}

/// Seconds since each cell was received, 65535 = never.
pub(crate) fn ages(replica: &Replica, bounds: Rect, now: Instant) -> Vec<u16> {
    let age = |at: Instant| now.since(at).as_secs().min(65_534) as u16;
    bounds.cells().map(|cell| replica.heard(cell).map_or(u16::MAX, age)).collect()
}

/// A layer: the middle of each cell's level as a shade, 0 for the lowest level to 254 for the highest, 255 = unknown.
fn layer(kind: PlaneKind, replica: &PlaneReplica, bounds: Rect, now: Instant) -> CellLayer {
    let (scale, shown) = (replica.scale(), replica.levels().shown());
    let levels: Vec<u8> = bounds.cells().map(|cell| shown.get(cell)).collect();
    let known = || levels.iter().copied().filter(|&level| level > 0);
    // Confidence has a fixed scale. The scale of other layers spans the levels on the map.
    let (lowest, highest) = match kind {
        PlaneKind::Confidence => (1, scale.levels()),
        PlaneKind::Depth | PlaneKind::Curiosity => (known().min().unwrap_or(1), known().max().unwrap_or(1)),
    };
    let middle = |level: u8| scale.bounds(level).map_or(0.0, |(low, high)| (low + high) / 2.0);
    let shade = |level: u8| match u32::from(level).checked_sub(u32::from(lowest)).filter(|_| level > 0) {
        Some(above) => ((above * 254) as f64 / f64::from((highest - lowest).max(1))).round() as u8,
        None => 255,
    };
    let step = scale.bounds(1).map_or(0.0, |(low, high)| high - low);
    CellLayer {
        name: kind.name(),
        unit: unit(kind),
        min: rounded(middle(lowest)),
        max: rounded(middle(highest)),
        step: rounded(step),
        shades: levels.iter().map(|&level| shade(level)).collect(),
        age_s: ages(replica.levels(), bounds, now),
    }
}

fn unit(kind: PlaneKind) -> &'static str {
    match kind {
        PlaneKind::Confidence => "",
        PlaneKind::Depth => "m",
        PlaneKind::Curiosity => "bit",
    }
}

/// Rounded, since binary fractions have noise in the last digits.
fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, PlaneChunk, PlaneScale, PlaneSource, StateSource};
    use scenecast_protocol::map_codec::Codec;
    use std::time::Duration;

    /// The layer at the surface after all values were received at 10 s.
    fn received(scale: PlaneScale, cells: &[(Cell, f64)]) -> PlaneReplica {
        let at = Instant::from_secs_f64(10.0);
        let mut source = PlaneSource::new(scale, Codec::Png, Duration::ZERO);
        source.set(cells.iter().copied(), at);
        let (chunk, _) = source.next_chunk(1000, at).unwrap();
        let Some(PlaneChunk::Patch(scale, patch)) = PlaneChunk::decode(&chunk) else { panic!("no patch") };
        let mut replica = PlaneReplica::new(scale);
        assert!(replica.apply(1, scale, patch, at));
        replica
    }

    #[test]
    fn a_layer_has_the_middle_of_each_known_level() {
        let bounds = Rect { x: 0, y: 0, width: 3, height: 1 };
        let cells = [(Cell::new(0, 0), 20.1), (Cell::new(2, 0), 22.9)];
        let depth = received(PlaneScale::depth_around(20.0, 0.5), &cells);
        let found = layer(PlaneKind::Depth, &depth, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.min, found.max, found.step), (20.25, 22.75, 0.5));
        assert_eq!((found.shades.clone(), found.age_s.clone()), (vec![0, 255, 254], vec![3, u16::MAX, 3]));
        assert_eq!([0, 1, 2].map(|at| found.value(at)), [Some(20.25), None, Some(22.75)]);
        let confidence = received(PlaneScale::Confidence, &[(Cell::new(0, 0), 0.6), (Cell::new(1, 0), 1.0)]);
        let found = layer(PlaneKind::Confidence, &confidence, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.min, found.max, found.unit), (0.125, 0.875, ""));
        assert_eq!(found.shades, [169, 254, 255]);
        let curiosity = received(PlaneScale::Curiosity, &[(Cell::new(0, 0), 4.2), (Cell::new(1, 0), 8.0)]);
        let found = layer(PlaneKind::Curiosity, &curiosity, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((found.min, found.max, found.step, found.unit), (4.5, 8.5, 1.0, "bit"));
        assert_eq!((found.shades, found.age_s), (vec![0, 254, 255], vec![3, 3, u16::MAX]));
    }
}
