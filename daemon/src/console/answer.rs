//! What a browser may ask of the surface.

use super::base64;
use crate::asv::{ExemplarState, FenceOrder, LimitsOrder, Surface};
use crate::picture;
use scenecast_protocol::directive::{Constraints, SlotId};
use scenecast_protocol::map::{PlaneKind, PlaneReplica, Rect, Replica};
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A question or an order.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// A vehicle's map with the age of its cells.
    Map(u8),
    /// A vehicle's map as an indexed PNG.
    MapPng(u8),
    /// The image of a label.
    Exemplar(u8, u8),
    /// Send weights of labels, and of unseen cells and perplexity.
    Utility(u8, BTreeMap<u8, f64>, (f64, f64)),
    /// Ask the vehicle for an image of a label.
    Request(u8, u8),
    /// Tell the vehicle to stay, to abort, or to go on.
    Order(u8, Constraints),
    /// Send a fence.
    Fence(u8, FenceOrder),
    /// Send limits.
    Limits(u8, LimitsOrder),
    /// Change planner and refinement.
    Settings(u8, Option<String>, Option<u32>),
    /// Change the bit budget, and the least shares if there are any.
    Budget(u32, Option<Shares>),
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Reply {
    /// Found.
    Json(Value),
    /// A file with its content type.
    File(&'static str, Vec<u8>),
    /// Taken; on its way.
    Accepted(Value),
    /// There is no such thing.
    NotFound,
    /// Not allowed, and why.
    Refused(String),
}

/// Answers an ask.
pub fn answer(surface: &mut Surface, ask: Ask, cell_m: f64, now: Instant) -> Reply {
    let accepted = |slot: SlotId, result: Result<u16, String>| match result {
        Ok(version) => Reply::Accepted(json!({ "slot": slot.name(), "version": version })),
        Err(why) => Reply::Refused(why),
    };
    let address = |id: u8| Address::vehicle(id).filter(|&a| surface.desk(a).is_some());
    match ask {
        Ask::Map(id) => address(id).and_then(|a| map(surface, a, cell_m, now)).map_or(Reply::NotFound, Reply::Json),
        Ask::MapPng(id) => {
            let png = address(id).and_then(|a| surface.map(a)).and_then(|m| picture::encode(m).ok());
            png.map_or(Reply::NotFound, |png| Reply::File("image/png", png))
        }
        Ask::Exemplar(id, label) => {
            let desk = address(id).and_then(|a| surface.desk(a)).and_then(|d| d.exemplars.get(&label));
            match desk.map(|e| &e.state) {
                Some(ExemplarState::Here(webp)) => Reply::File("image/webp", webp.clone()),
                _ => Reply::NotFound,
            }
        }
        Ask::Budget(bps, shares) => match surface.set_budget(bps, shares, now) {
            Ok(()) => Reply::Accepted(json!({ "slot": SlotId::Budget.name() })),
            Err(why) => Reply::Refused(why),
        },
        Ask::Utility(id, weights, others) => match address(id) {
            Some(a) => accepted(SlotId::Utility, surface.set_utility(a, &weights, others, now)),
            None => Reply::NotFound,
        },
        Ask::Request(id, label) => match address(id) {
            Some(a) => accepted(SlotId::Requests, surface.request_exemplar(a, label, now)),
            None => Reply::NotFound,
        },
        Ask::Order(id, order) => match address(id) {
            Some(a) => accepted(SlotId::Constraints, surface.set_order(a, order, now)),
            None => Reply::NotFound,
        },
        Ask::Fence(id, fence) => match address(id) {
            Some(a) => accepted(SlotId::Fence, surface.set_fence(a, &fence, now)),
            None => Reply::NotFound,
        },
        Ask::Limits(id, limits) => match address(id) {
            Some(a) => accepted(SlotId::Limits, surface.set_limits(a, &limits, now)),
            None => Reply::NotFound,
        },
        Ask::Settings(id, planner, words) => match address(id) {
            Some(a) => accepted(SlotId::Settings, surface.set_settings(a, planner.as_deref(), words, now)),
            None => Reply::NotFound,
        },
    }
}

fn map(surface: &Surface, address: Address, cell_m: f64, now: Instant) -> Option<Value> {
    let grid = surface.map(address)?;
    let view = surface.view(address)?;
    let empty = Rect { x: 0, y: 0, width: 0, height: 0 };
    let bounds = grid.bounds().unwrap_or(empty);
    let labels: Vec<u8> = bounds.cells().map(|cell| grid.get(cell)).collect();
    let planes = PlaneKind::ALL.into_iter().filter_map(|kind| Some(plane(kind, view.plane(kind)?, bounds, now)));
    Some(json!({
        "version": view.map_version(),
        "x0": bounds.x,
        "y0": bounds.y,
        "width": bounds.width,
        "height": bounds.height,
        "cell_m": cell_m,
        "labels": base64::encode(&labels),
        "age_s": base64::encode(&ages(view.replica(), bounds, now)),
        "planes": planes.collect::<Vec<_>>(),
    }))
}

/// Seconds since each cell was heard of, two bytes each.
fn ages(replica: &Replica, bounds: Rect, now: Instant) -> Vec<u8> {
    let age = |cell| replica.heard(cell).map_or(u16::MAX, |at| now.since(at).as_secs().min(65_534) as u16);
    bounds.cells().flat_map(|cell| age(cell).to_le_bytes()).collect()
}

/// A plane: the middle of each cell's level, 0 to 254 between those of the lowest and of the highest level, 255 not known.
fn plane(kind: PlaneKind, replica: &PlaneReplica, bounds: Rect, now: Instant) -> Value {
    let (scale, shown) = (replica.scale(), replica.levels().shown());
    let levels: Vec<u8> = bounds.cells().map(|cell| shown.get(cell)).collect();
    let known = || levels.iter().copied().filter(|&level| level > 0);
    // A depth is shown on the scale of what there is, a confidence on its own.
    let (lowest, highest) = match kind {
        PlaneKind::Confidence => (1, scale.levels()),
        PlaneKind::Depth => (known().min().unwrap_or(1), known().max().unwrap_or(1)),
    };
    let middle = |level: u8| scale.bounds(level).map_or(0.0, |(low, high)| (low + high) / 2.0);
    let shade = |level: u8| match u32::from(level).checked_sub(u32::from(lowest)).filter(|_| level > 0) {
        Some(above) => ((above * 254) as f64 / f64::from((highest - lowest).max(1))).round() as u8,
        None => 255,
    };
    let step = scale.bounds(1).map_or(0.0, |(low, high)| high - low);
    json!({
        "name": kind.name(),
        "unit": if kind == PlaneKind::Depth { "m" } else { "" },
        "min": rounded(middle(lowest)),
        "max": rounded(middle(highest)),
        "step": rounded(step),
        "data": base64::encode(&levels.iter().map(|&level| shade(level)).collect::<Vec<_>>()),
        "age_s": base64::encode(&ages(replica.levels(), bounds, now)),
    })
}

/// Without the noise of binary fractions.
fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, PlaneChunk, PlaneScale, PlaneSource, StateSource};
    use scenecast_protocol::map_codec::Codec;
    use std::time::Duration;

    /// The plane as the surface has it after everything was said at 10 s.
    fn heard(scale: PlaneScale, cells: &[(Cell, f64)]) -> PlaneReplica {
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
    fn a_plane_is_told_by_the_middles_of_its_levels_and_what_is_not_known_is_not_told() {
        let bounds = Rect { x: 0, y: 0, width: 3, height: 1 };
        let cells = [(Cell::new(0, 0), 20.1), (Cell::new(2, 0), 22.9)];
        let depth = heard(PlaneScale::depth_around(20.0, 0.5), &cells);
        let told = plane(PlaneKind::Depth, &depth, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((&told["min"], &told["max"], &told["step"]), (&json!(20.25), &json!(22.75), &json!(0.5)));
        assert_eq!(told["data"], base64::encode(&[0, 255, 254]));
        assert_eq!(told["age_s"], base64::encode(&[3, 0, 255, 255, 3, 0]));
        let confidence = heard(PlaneScale::Confidence, &[(Cell::new(0, 0), 0.6), (Cell::new(1, 0), 1.0)]);
        let told = plane(PlaneKind::Confidence, &confidence, bounds, Instant::from_secs_f64(13.0));
        assert_eq!((&told["min"], &told["max"], &told["unit"]), (&json!(0.125), &json!(0.875), &json!("")));
        assert_eq!(told["data"], base64::encode(&[169, 254, 255]));
    }
}
