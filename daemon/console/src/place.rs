//! Where things are in the world, for the page.

use super::state;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use scenecast_surface::Surface;

/// Where x = y = 0 of the world is on the Earth; nothing while the surface's instruments do not know, and of a rehearsal that
/// is nowhere: both 0 is no place, as in the configuration.
pub(super) fn origin(surface: &Surface) -> Option<state::Origin> {
    let origin = surface.relay()?.plane().map(|p| p.origin()).filter(|o| (o.lat_deg, o.lon_deg) != (0.0, 0.0))?;
    Some(state::Origin { lat_deg: origin.lat_deg, lon_deg: origin.lon_deg })
}

/// By how much a map must be moved to lie where it belongs in the world.
pub(super) fn placement(placement: Placement) -> state::Placement {
    let Placement { version, origin } = placement;
    state::Placement { version, east_m: origin.east_m, north_m: origin.north_m }
}

/// The surface's GPS and what became of what it told; nothing without one.
pub(super) fn position(surface: &Surface, now: Instant) -> Option<state::Position> {
    let relay = surface.relay()?;
    let (gps, own) = (relay.gps(), relay.own(now));
    let fix = gps.fix();
    Some(state::Position {
        is_good: own.is_some(),
        x_m: own.map(|e| e.x_m),
        y_m: own.map(|e| e.y_m),
        sigma_m: own.map(|e| e.sigma_m()),
        lat_deg: fix.map(|f| f.place.lat_deg),
        lon_deg: fix.map(|f| f.place.lon_deg),
        at_s: fix.map(|f| f.at.as_secs_f64()),
        heading_deg: relay.heading_rad(now).map(|h| h.to_degrees().rem_euclid(360.0)),
        refused: gps.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
        outliers: relay.gps_outliers(),
        fixes: relay.fixes(),
        sightings_unused: relay.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
    })
}
