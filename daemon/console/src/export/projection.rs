//! Between metres in the world frame, latitude and longitude, and UTM; the projection in well-known text.

use scenecast_surface::state::Origin;

/// Semi-major axis of WGS 84, metres.
const A: f64 = 6_378_137.0;
/// The flattening of that ellipsoid.
const F: f64 = 1.0 / 298.257_223_563;

/// The transverse Mercator projection on WGS 84: the series of Krueger (1912) to the fourth order of the third flattening, as in
/// Karney (2011), "Transverse Mercator with an accuracy of a few nanometers". Within 4000 km of its meridian it is less than a
/// hundredth of a millimetre off.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TransverseMercator {
    lon0_deg: f64,
    scale: f64,
    false_m: (f64, f64),
}

/// The third flattening, and the powers of it up to the fourth.
const N: f64 = F / (2.0 - F);
const N2: f64 = N * N;
const N3: f64 = N2 * N;
const N4: f64 = N3 * N;
const ALPHA: [f64; 4] = [
    N / 2.0 - 2.0 * N2 / 3.0 + 5.0 * N3 / 16.0 + 41.0 * N4 / 180.0,
    13.0 * N2 / 48.0 - 3.0 * N3 / 5.0 + 557.0 * N4 / 1440.0,
    61.0 * N3 / 240.0 - 103.0 * N4 / 140.0,
    49_561.0 * N4 / 161_280.0,
];
const BETA: [f64; 4] = [
    N / 2.0 - 2.0 * N2 / 3.0 + 37.0 * N3 / 96.0 - N4 / 360.0,
    N2 / 48.0 + N3 / 15.0 - 437.0 * N4 / 1440.0,
    17.0 * N3 / 480.0 - 37.0 * N4 / 840.0,
    4397.0 * N4 / 161_280.0,
];
/// From the conformal latitude to the latitude.
const DELTA: [f64; 4] = [
    2.0 * N - 2.0 * N2 / 3.0 - 2.0 * N3 + 116.0 * N4 / 45.0,
    7.0 * N2 / 3.0 - 8.0 * N3 / 5.0 - 227.0 * N4 / 45.0,
    56.0 * N3 / 15.0 - 136.0 * N4 / 35.0,
    4279.0 * N4 / 630.0,
];
/// The radius of the sphere with the same meridian, metres.
const MERIDIAN_M: f64 = A / (1.0 + N) * (1.0 + N2 / 4.0 + N4 / 64.0);
/// The latitudes of UTM, degrees.
const UTM_LAT_DEG: std::ops::RangeInclusive<f64> = -80.0..=84.0;

/// The number of the zone of a place. The zones of the west of Norway and of Svalbard have widths of their own (NGA.STND.0037, section 7).
fn utm_zone(Origin { lat_deg, lon_deg }: Origin) -> u16 {
    let lon_deg = (lon_deg + 180.0).rem_euclid(360.0) - 180.0;
    let of = |lons: std::ops::Range<f64>| lons.contains(&lon_deg);
    let is_norway = (56.0..64.0).contains(&lat_deg) && of(3.0..12.0);
    if is_norway {
        return 32;
    }
    let is_svalbard = (72.0..=84.0).contains(&lat_deg);
    match () {
        () if is_svalbard && of(0.0..9.0) => 31,
        () if is_svalbard && of(9.0..21.0) => 33,
        () if is_svalbard && of(21.0..33.0) => 35,
        () if is_svalbard && of(33.0..42.0) => 37,
        () => (((lon_deg + 180.0) / 6.0) as u16).min(59) + 1,
    }
}

impl TransverseMercator {
    /// The projection of the mission: metres east and north of its origin.
    pub(crate) fn about(origin: Origin) -> Self {
        let plain = Self { lon0_deg: origin.lon_deg, scale: 1.0, false_m: (0.0, 0.0) };
        let (_, north) = plain.metres(origin.lon_deg, origin.lat_deg);
        Self { false_m: (0.0, -north), ..plain }
    }

    /// The UTM zone of a place, with its EPSG code; `None` near the poles.
    pub(super) fn utm(at: Origin) -> Option<(Self, u16)> {
        let zone = utm_zone(at);
        let is_south = at.lat_deg < 0.0;
        let lon0_deg = f64::from(zone) * 6.0 - 183.0;
        let found = Self { lon0_deg, scale: 0.9996, false_m: (500_000.0, if is_south { 1e7 } else { 0.0 }) };
        UTM_LAT_DEG.contains(&at.lat_deg).then_some((found, if is_south { 32_700 } else { 32_600 } + zone))
    }

    /// The projected place of a longitude and latitude in degrees.
    pub(super) fn metres(&self, lon_deg: f64, lat_deg: f64) -> (f64, f64) {
        let (lat, lon) = (lat_deg.to_radians(), (lon_deg - self.lon0_deg).to_radians());
        let e = (F * (2.0 - F)).sqrt();
        let t = (lat.sin().atanh() - e * (e * lat.sin()).atanh()).sinh();
        let (xi, eta) = (t.atan2(lon.cos()), (lon.sin() / f64::hypot(t, lon.cos())).asinh());
        let (mut north, mut east) = (xi, eta);
        for (k, a) in (1..).map(|j| 2.0 * f64::from(j)).zip(ALPHA) {
            north += a * (k * xi).sin() * (k * eta).cosh();
            east += a * (k * xi).cos() * (k * eta).sinh();
        }
        let radius = self.scale * MERIDIAN_M;
        (self.false_m.0 + radius * east, self.false_m.1 + radius * north)
    }

    /// Longitude and latitude in degrees of a projected place. Near 180 degrees the longitude goes on beyond.
    pub(crate) fn lon_lat(&self, x: f64, y: f64) -> (f64, f64) {
        let radius = self.scale * MERIDIAN_M;
        let (xi, eta) = ((y - self.false_m.1) / radius, (x - self.false_m.0) / radius);
        let (mut north, mut east) = (xi, eta);
        for (k, b) in (1..).map(|j| 2.0 * f64::from(j)).zip(BETA) {
            north -= b * (k * xi).sin() * (k * eta).cosh();
            east -= b * (k * xi).cos() * (k * eta).sinh();
        }
        let conformal = (north.sin() / east.cosh()).asin();
        let steps = (1..).map(|j| 2.0 * f64::from(j)).zip(DELTA);
        let lat = conformal + steps.map(|(k, d)| d * (k * conformal).sin()).sum::<f64>();
        let lon = east.sinh().atan2(north.cos());
        (self.lon0_deg + lon.to_degrees(), lat.to_degrees())
    }
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
            let projection = TransverseMercator::about(Origin { lat_deg, lon_deg: -10.25 });
            let (found_lon, found_lat) = projection.lon_lat(x, y);
            let metres = (f64::hypot(found_lon - lon, found_lat - lat)) * 111_000.0;
            assert!(metres < 1e-3, "{x} {y} about {lat_deg}: {metres} m off");
            let (east, north) = projection.metres(lon, lat);
            assert!(f64::hypot(east - x, north - y) < 1e-3, "{x} {y} about {lat_deg}: {east} {north}");
        }
    }

    #[test]
    fn each_place_has_the_utm_zone_of_its_meridian_and_hemisphere() {
        let zone = |lat_deg, lon_deg| TransverseMercator::utm(Origin { lat_deg, lon_deg }).map(|(_, epsg)| epsg);
        assert_eq!(
            (zone(60.17, -10.25), zone(-45.0, 179.9), zone(0.0, -180.0)),
            (Some(32_629), Some(32_760), Some(32_601))
        );
        assert_eq!([zone(84.1, 0.0), zone(-80.1, 0.0), zone(-90.0, 0.0)], [None; 3]);
        // Bergen, its sea to the west, Trondheim, Longyearbyen, and the bounds of the zones of Norway and Svalbard.
        let zones = |lat_deg: f64, lons: &[f64]| lons.iter().map(|lon| zone(lat_deg, *lon)).collect::<Vec<_>>();
        let north = |zones: &[u16]| zones.iter().map(|zone| Some(32_600 + zone)).collect::<Vec<_>>();
        assert_eq!(zones(60.39, &[2.9, 3.0, 5.32, 11.9, 12.0]), north(&[31, 32, 32, 32, 33]));
        assert_eq!(zones(63.43, &[4.0, 10.4]), north(&[32, 32]));
        assert_eq!([zones(55.9, &[5.0]), zones(64.0, &[5.0])].concat(), north(&[31, 31]));
        let svalbard = north(&[30, 31, 31, 33, 33, 35, 35, 37, 37, 38]);
        assert_eq!(zones(78.22, &[-0.1, 0.0, 8.9, 9.0, 20.9, 21.0, 32.9, 33.0, 41.9, 42.0]), svalbard);
        assert_eq!([zones(71.9, &[10.0]), zones(84.0, &[10.0])].concat(), north(&[32, 33]));
        let (utm, _) = TransverseMercator::utm(Origin { lat_deg: 60.17, lon_deg: -10.25 }).unwrap();
        // On the central meridian of zone 29, 1 degree of latitude from the equator: 0.9996 of the meridian's length.
        let (east, north) = utm.metres(-9.0, 1.0);
        assert!((east - 500_000.0).abs() < 1e-6 && (north - 0.9996 * 110_574.388_5).abs() < 1e-2, "{east} {north}");
    }
}
