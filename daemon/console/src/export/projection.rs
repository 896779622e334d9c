//! From metres in the world frame to latitude and longitude, and the projection in well-known text.

use crate::state::Origin;

/// Semi-major axis of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// Its flattening.
const F: f64 = 1.0 / 298.257_223_563;

/// Longitude and latitude in degrees of a place in metres east and north of the origin.
///
/// The inverse transverse Mercator projection about the origin to the third order (Snyder, USGS Professional Paper
/// 1395, p. 63): within 10 km, at up to 75 degrees of latitude, it is less than a millimetre off.
pub(super) fn lon_lat(origin: Origin, x: f64, y: f64) -> (f64, f64) {
    let e2 = F * (2.0 - F);
    let (mut lat, lat0) = (origin.lat_deg.to_radians(), origin.lat_deg.to_radians());
    // The footpoint: the latitude that lies y metres along the meridian.
    for _ in 0..3 {
        lat = lat0 + y / meridian_radius((lat + lat0) / 2.0, e2);
    }
    let w2 = 1.0 - e2 * lat.sin().powi(2);
    let (n, m) = (A / w2.sqrt(), A * (1.0 - e2) / w2.powf(1.5));
    let (t, d) = (lat.tan(), x / n);
    let c = e2 / (1.0 - e2) * lat.cos().powi(2);
    let north = lat - n * t / m * (d * d / 2.0 - (5.0 + 3.0 * t * t + 10.0 * c) * d.powi(4) / 24.0);
    let east = (d - (1.0 + 2.0 * t * t + c) * d.powi(3) / 6.0) / lat.cos();
    (origin.lon_deg + east.to_degrees(), north.to_degrees())
}

fn meridian_radius(lat: f64, e2: f64) -> f64 {
    A * (1.0 - e2) / (1.0 - e2 * lat.sin().powi(2)).powf(1.5)
}

/// The coordinate system of the mission in well-known text (OGC 01-009, which every GIS reads).
pub(super) fn well_known_text(origin: Option<Origin>) -> String {
    let Some(Origin { lat_deg, lon_deg }) = origin else {
        return "LOCAL_CS[\"metres east and north of the mission's origin\",UNIT[\"metre\",1],AXIS[\"East\",EAST],\
                AXIS[\"North\",NORTH]]"
            .to_owned();
    };
    format!(
        "PROJCS[\"metres east and north of {lat_deg} {lon_deg}\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",\
         SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],\
         PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",{lat_deg}],\
         PARAMETER[\"central_meridian\",{lon_deg}],PARAMETER[\"scale_factor\",1],PARAMETER[\"false_easting\",0],\
         PARAMETER[\"false_northing\",0],UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_equal_those_of_proj() {
        // `cs2cs +proj=tmerc +lat_0=LAT +lon_0=-10.25 +k=1 +datum=WGS84` of PROJ 9.
        let known = [
            (0.0, 3000.0, 2000.0, -10.223050541142952, 0.0180873875207037),
            (60.17, -5000.0, 5000.0, -10.3401911809337, 60.21484638349258),
            (75.0, 10_000.0, -10_000.0, -9.90601332759209, 74.91014900090009),
            (-45.0, 10_000.0, -10_000.0, -10.122973001227178, -45.089911909317664),
        ];
        for (lat_deg, x, y, lon, lat) in known {
            let (found_lon, found_lat) = lon_lat(Origin { lat_deg, lon_deg: -10.25 }, x, y);
            let metres = (f64::hypot(found_lon - lon, found_lat - lat)) * 111_000.0;
            assert!(metres < 1e-3, "{x} {y} about {lat_deg}: {metres} m off");
        }
    }
}
