//! The layers of a map as they are told: what the surface knows of each cell beside its label.

use super::export::Layer;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{LayerKind, LayerReplica, Rect, Replica};
use scenecast_protocol::time::Instant;

/// The layers of which anything was heard.
pub(super) fn layers(view: &PeerView<'_>, bounds: Rect, now: Instant) -> Vec<Layer> {
    LayerKind::ALL.into_iter().filter_map(|kind| Some(layer(kind, view.layer(kind)?, bounds, now))).collect()
}

/// Seconds since each cell was heard of, 65535 = never.
pub(super) fn ages(replica: &Replica, bounds: Rect, now: Instant) -> Vec<u16> {
    let age = |at: Instant| now.since(at).as_secs().min(65_534) as u16;
    bounds.cells().map(|cell| replica.heard(cell).map_or(u16::MAX, age)).collect()
}

/// A layer: the middle of each cell's level, 0 to 254 between those of the lowest and of the highest level, 255 not known.
fn layer(kind: LayerKind, replica: &LayerReplica, bounds: Rect, now: Instant) -> Layer {
    let (scale, shown) = (replica.scale(), replica.levels().shown());
    let levels: Vec<u8> = bounds.cells().map(|cell| shown.get(cell)).collect();
    let known = || levels.iter().copied().filter(|&level| level > 0);
    // A confidence is shown on its own scale, the others on that of what there is.
    let (lowest, highest) = match kind {
        LayerKind::Confidence => (1, scale.levels()),
        LayerKind::Depth | LayerKind::Curiosity => (known().min().unwrap_or(1), known().max().unwrap_or(1)),
    };
    let middle = |level: u8| scale.bounds(level).map_or(0.0, |(low, high)| (low + high) / 2.0);
    let shade = |level: u8| match u32::from(level).checked_sub(u32::from(lowest)).filter(|_| level > 0) {
        Some(above) => ((above * 254) as f64 / f64::from((highest - lowest).max(1))).round() as u8,
        None => 255,
    };
    let step = scale.bounds(1).map_or(0.0, |(low, high)| high - low);
    Layer {
        name: kind.name(),
        unit: unit(kind),
        min: rounded(middle(lowest)),
        max: rounded(middle(highest)),
        step: rounded(step),
        shades: levels.iter().map(|&level| shade(level)).collect(),
        age_s: ages(replica.levels(), bounds, now),
    }
}

fn unit(kind: LayerKind) -> &'static str {
    match kind {
        LayerKind::Confidence => "",
        LayerKind::Depth => "m",
        LayerKind::Curiosity => "bit",
    }
}

/// Without the noise of binary fractions.
fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LayerChunk, LayerScale, LayerSource, StateSource};
    use scenecast_protocol::map_codec::Codec;
    use std::time::Duration;

    /// The layer as the surface has it after everything was said at 10 s.
    fn heard(scale: LayerScale, cells: &[(Cell, f64)]) -> LayerReplica {
        let at = Instant::from_secs_f64(10.0);
        let mut source = LayerSource::new(scale, Codec::Png, Duration::ZERO);
        source.set(cells.iter().copied(), at);
        let (chunk, _) = source.next_chunk(1000, at).unwrap();
        let Some(LayerChunk::Patch(scale, patch)) = LayerChunk::decode(&chunk) else { panic!("no patch") };
        let mut replica = LayerReplica::new(scale);
        assert!(replica.apply(1, scale, patch, at));
        replica
    }

    #[test]
    fn a_layer_is_told_by_the_middles_of_its_levels_and_what_is_not_known_is_not_told() {
        let bounds = Rect { x: 0, y: 0, width: 3, height: 1 };
        let cells = [(Cell::new(0, 0), 20.1), (Cell::new(2, 0), 22.9)];
        let depth = heard(LayerScale::depth_around(20.0, 0.5), &cells);
        let told = layer(LayerKind::Depth, &depth, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((told.min, told.max, told.step), (20.25, 22.75, 0.5));
        assert_eq!((told.shades.clone(), told.age_s.clone()), (vec![0, 255, 254], vec![3, u16::MAX, 3]));
        assert_eq!([0, 1, 2].map(|at| told.value(at)), [Some(20.25), None, Some(22.75)]);
        let confidence = heard(LayerScale::Confidence, &[(Cell::new(0, 0), 0.6), (Cell::new(1, 0), 1.0)]);
        let told = layer(LayerKind::Confidence, &confidence, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((told.min, told.max, told.unit), (0.125, 0.875, ""));
        assert_eq!(told.shades, [169, 254, 255]);
        let curiosity = heard(LayerScale::Curiosity, &[(Cell::new(0, 0), 4.2), (Cell::new(1, 0), 8.0)]);
        let told = layer(LayerKind::Curiosity, &curiosity, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((told.min, told.max, told.step, told.unit), (4.5, 8.5, 1.0, "bit"));
        assert_eq!((told.shades, told.age_s), (vec![0, 254, 255], vec![3, 3, u16::MAX]));
    }
}
