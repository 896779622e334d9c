//! Where things are in the world, for the page.

use crate::asv::Surface;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Where x = y = 0 of the world is on the Earth; null while nobody knows.
pub(super) fn origin(surface: &Surface) -> Value {
    let plane = surface.relay().and_then(|r| r.plane());
    plane.map_or(Value::Null, |p| json!({ "lat_deg": p.origin().lat_deg, "lon_deg": p.origin().lon_deg }))
}

/// By how much a map must be moved to lie where it belongs in the world.
pub(super) fn placement(placement: Option<Placement>) -> Value {
    placement.map_or(Value::Null, |p| json!({ "version": p.version, "east_m": p.east_m, "north_m": p.north_m }))
}

/// The surface's GPS and what became of what it told; null without one.
pub(super) fn position(surface: &Surface, now: Instant) -> Value {
    let Some(relay) = surface.relay() else { return Value::Null };
    let gps = relay.gps();
    let fix = gps.fix();
    let own = relay.own(now);
    let refused: BTreeMap<&str, u64> = gps.faults().map(|(f, n)| (f.name(), n)).collect();
    let unused: BTreeMap<&str, u64> = relay.faults().map(|(f, n)| (f.name(), n)).collect();
    json!({
        "is_good": own.is_some(),
        "x_m": own.map(|e| e.x_m),
        "y_m": own.map(|e| e.y_m),
        "sigma_m": own.map(|e| e.sigma_m()),
        "lat_deg": fix.map(|f| f.place.lat_deg),
        "lon_deg": fix.map(|f| f.place.lon_deg),
        "at_s": fix.map(|f| f.at.as_secs_f64()),
        "heading_deg": relay.heading_rad(now).map(|h| h.to_degrees().rem_euclid(360.0)),
        "refused": refused,
        "outliers": relay.gps_outliers(),
        "fixes": relay.fixes(),
        "sightings_unused": unused,
    })
}
