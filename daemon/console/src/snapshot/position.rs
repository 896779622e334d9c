//! The position of the surface, the origin of the world frame, and the placement of maps.

use crate::state::{MapPlacement, Origin, SurfacePosition};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use scenecast_surface::Surface;

/// The place of x = y = 0 on the Earth by the GPS of the surface. 0, 0 stands for a rehearsal without a
/// place, as in the configuration.
pub fn measured_origin(surface: &Surface) -> Option<Origin> {
    let origin = surface.relay()?.plane().map(|p| p.origin()).filter(|o| (o.lat_deg, o.lon_deg) != (0.0, 0.0))?;
    Some(Origin { lat_deg: origin.lat_deg, lon_deg: origin.lon_deg })
}

pub(super) fn placement(placement: Placement) -> MapPlacement {
    let Placement { version, origin } = placement;
    MapPlacement { version, east_m: origin.east_m, north_m: origin.north_m }
}

/// The position of the surface; `None` without a GPS.
pub(super) fn surface_position(surface: &Surface, now: Instant) -> Option<SurfacePosition> {
    let relay = surface.relay()?;
    let (gps, own) = (relay.gps(), relay.own(now));
    let fix = gps.fix();
    Some(SurfacePosition {
        is_valid: own.is_some(),
        x_m: own.map(|e| e.x_m),
        y_m: own.map(|e| e.y_m),
        sigma_m: own.map(|e| e.sigma_m()),
        lat_deg: fix.map(|f| f.place.lat_deg),
        lon_deg: fix.map(|f| f.place.lon_deg),
        at_s: fix.map(|f| f.at.as_secs_f64()),
        heading_deg: relay.heading_rad(now).map(|h| h.to_degrees().rem_euclid(360.0)),
        rejected: gps.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
        outliers: relay.gps_outliers(),
        fixes_sent: relay.fixes(),
        usbl_rejected: relay.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
    })
}
