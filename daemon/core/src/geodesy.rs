//! Places: positions on the Earth, the tangent plane at the mission's origin, rectangles and outlines in it, and the frame of a
//! vessel's body.

use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Fence, FenceFault, Polygon};
use std::f64::consts::PI;

/// Latitude and longitude on the WGS-84 ellipsoid, at its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatLon {
    pub lat_deg: f64,
    pub lon_deg: f64,
}

/// Maximum distance of a place in an order from the mission's origin, metres; a farther one is a typing error.
pub const MAX_DISTANCE_M: f64 = 100_000.0;

impl LatLon {
    /// A place; `None` if there is none of these coordinates.
    pub fn new(lat_deg: f64, lon_deg: f64) -> Option<Self> {
        let is_place = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0;
        is_place.then_some(Self { lat_deg, lon_deg })
    }
}

/// The world frame of a mission: the plane that touches the ellipsoid at its origin, x east and y north in metres.
///
/// Heights are left out: the sea is at height 0 and a mission within some kilometres, where the plane departs from the
/// ellipsoid by metres in height and by millimetres in place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentPlane {
    origin: LatLon,
    /// Of the origin, metres from the Earth's middle.
    ecef: [f64; 3],
}

/// Semi-major axis, metres (NIMA TR8350.2).
const A: f64 = 6_378_137.0;
const F: f64 = 1.0 / 298.257_223_563;
const E2: f64 = F * (2.0 - F);

impl TangentPlane {
    pub fn new(origin: LatLon) -> Self {
        Self { origin, ecef: to_ecef(origin) }
    }

    /// Where it touches the Earth.
    pub fn origin(&self) -> LatLon {
        self.origin
    }

    /// Distance of a place from the origin through the Earth, metres. Unlike [`Self::to_plane`] it does not return to 0
    /// at the antipode.
    pub fn distance_m(&self, place: LatLon) -> f64 {
        let to = to_ecef(place);
        (0..3).map(|i| (to[i] - self.ecef[i]).powi(2)).sum::<f64>().sqrt()
    }

    /// East and north of the origin, metres.
    pub fn to_plane(&self, place: LatLon) -> (f64, f64) {
        let to = to_ecef(place);
        let [dx, dy, dz] = [to[0] - self.ecef[0], to[1] - self.ecef[1], to[2] - self.ecef[2]];
        let (sin_lat, cos_lat) = self.origin.lat_deg.to_radians().sin_cos();
        let (sin_lon, cos_lon) = self.origin.lon_deg.to_radians().sin_cos();
        let east = cos_lon * dy - sin_lon * dx;
        let north = cos_lat * dz - sin_lat * (cos_lon * dx + sin_lon * dy);
        (east, north)
    }

    /// The place at sea level that lies `x_m` east and `y_m` north of the origin; right to a millimetre within 50 km.
    pub fn to_place(&self, x_m: f64, y_m: f64) -> LatLon {
        let mut place = self.origin;
        // Newton's method: what the radii of curvature leave over shrinks by far more than a hundred each time.
        for _ in 0..5 {
            let (x, y) = self.to_plane(place);
            let (meridian, parallel) = radii(place.lat_deg);
            place.lat_deg += ((y_m - y) / meridian).to_degrees();
            place.lon_deg += ((x_m - x) / parallel.max(1.0)).to_degrees();
        }
        place.lat_deg = place.lat_deg.clamp(-90.0, 90.0);
        place.lon_deg = (place.lon_deg + 180.0).rem_euclid(360.0) - 180.0;
        place
    }
}

/// Earth-centred coordinates of a place at height 0, metres.
fn to_ecef(place: LatLon) -> [f64; 3] {
    let (sin_lat, cos_lat) = place.lat_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = place.lon_deg.to_radians().sin_cos();
    let n = A / (1.0 - E2 * sin_lat * sin_lat).sqrt();
    [n * cos_lat * cos_lon, n * cos_lat * sin_lon, n * (1.0 - E2) * sin_lat]
}

/// Metres a radian of latitude and of longitude.
fn radii(lat_deg: f64) -> (f64, f64) {
    let (sin, cos) = lat_deg.to_radians().sin_cos();
    let w2 = 1.0 - E2 * sin * sin;
    (A * (1.0 - E2) / w2.powf(1.5), A / w2.sqrt() * cos)
}

/// The angle in -pi..=pi that is the same direction.
pub fn wrap_rad(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}

/// An offset in the frame of a vessel's body, metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyOffset {
    /// The part towards the bow.
    pub forward_m: f64,
    /// To the right of an observer who looks forward.
    pub starboard_m: f64,
    pub down_m: f64,
}

impl From<[f64; 3]> for BodyOffset {
    fn from([forward_m, starboard_m, down_m]: [f64; 3]) -> Self {
        Self { forward_m, starboard_m, down_m }
    }
}

/// Limits of the survey, metres from the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    pub west: f64,
    pub south: f64,
    pub east: f64,
    pub north: f64,
}

impl Area {
    /// The area without a border of `margin` metres, at least its middle.
    pub fn shrunk(&self, margin: f64) -> Self {
        let (cx, cy) = ((self.west + self.east) / 2.0, (self.south + self.north) / 2.0);
        Self {
            west: (self.west + margin).min(cx),
            south: (self.south + margin).min(cy),
            east: (self.east - margin).max(cx),
            north: (self.north - margin).max(cy),
        }
    }

    /// From west to east and from south to north, metres.
    pub fn size_m(&self) -> (f64, f64) {
        (self.east - self.west, self.north - self.south)
    }

    /// The part of the area that lies in another one; `None` if there is none.
    pub fn common(&self, other: &Self) -> Option<Self> {
        let common = Self {
            west: self.west.max(other.west),
            south: self.south.max(other.south),
            east: self.east.min(other.east),
            north: self.north.min(other.north),
        };
        (common.west <= common.east && common.south <= common.north).then_some(common)
    }

    pub fn moved(&self, east_m: f64, north_m: f64) -> Self {
        Self {
            west: self.west + east_m,
            south: self.south + north_m,
            east: self.east + east_m,
            north: self.north + north_m,
        }
    }

    /// Whether a place lies inside or on the edge.
    pub fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.west..=self.east).contains(&x) && (self.south..=self.north).contains(&y)
    }

    /// The share of the area that cells of `cell_m` metres with these middles cover, 0 to 1.
    pub fn covered(&self, middles: impl Iterator<Item = (f64, f64)>, cell_m: f64) -> f64 {
        let (width_m, height_m) = self.size_m();
        let inside = middles.filter(|&middle| self.contains(middle)).count();
        (inside as f64 * cell_m * cell_m / (width_m * height_m).max(1e-9)).min(1.0)
    }
}

/// Why corners and places, as they are typed, are no fence, outline or place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    #[error("{what}: it is smaller than a metre; it takes metres east and north of the origin, not degrees")]
    Small { what: String },
    #[error("{what}: [{x}, {y}] is no place within 100 km of the mission's origin")]
    Far { what: String, x: f64, y: f64 },
    #[error(transparent)]
    Fence(#[from] FenceFault),
}

/// The fence with these parts.
pub fn fence_of(
    fence: Option<&[[f64; 2]]>,
    keep_outs: &[Vec<[f64; 2]>],
    return_point: Option<[f64; 2]>,
) -> Result<Fence, PlaceError> {
    let fence = Fence {
        fence: fence.map(|corners| outline_of("fence", corners)).transpose()?,
        keep_outs: keep_outs.iter().map(|corners| outline_of("keep_outs", corners)).collect::<Result<_, _>>()?,
        return_point: return_point.map(|at| place_of("return_point", at)).transpose()?,
    };
    fence.check()?;
    Ok(fence)
}

/// The outline with these corners, which is not checked yet.
pub fn outline_of(what: &str, corners: &[[f64; 2]]) -> Result<Polygon, PlaceError> {
    const LEAST_M: f64 = 1.0;
    let extent = |axis: fn(&[f64; 2]) -> f64| {
        let (low, high) =
            corners.iter().map(axis).fold((f64::INFINITY, -f64::INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    // Latitudes and longitudes of an outline of 100 km lie within a degree of each other.
    if corners.len() > 2 && extent(|c| c[0]) < LEAST_M && extent(|c| c[1]) < LEAST_M {
        return Err(PlaceError::Small { what: what.to_owned() });
    }
    corners.iter().map(|&corner| place_of(what, corner)).collect::<Result<_, _>>().map(Polygon)
}

/// The place, if it is near the origin.
pub fn place_of(what: &str, [x, y]: [f64; 2]) -> Result<DecimetrePoint, PlaceError> {
    let far = || PlaceError::Far { what: what.to_owned(), x, y };
    let near = Some(WorldPoint::new(x, y)).filter(|_| x.hypot(y) <= MAX_DISTANCE_M);
    near.and_then(DecimetrePoint::nearest).ok_or_else(far)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_minute_of_latitude_is_about_a_sea_mile() {
        let plane = TangentPlane::new(LatLon::new(29.5, 34.92).unwrap());
        let (x, y) = plane.to_plane(LatLon::new(29.5 + 1.0 / 60.0, 34.92).unwrap());
        assert!(x.abs() < 1e-6 && (y - 1847.4).abs() < 1.0, "{x} {y}");
        // 1" of longitude at the equator is the length of the equator, 40 075 016.686 m, over 1 296 000.
        let equator = TangentPlane::new(LatLon::new(0.0, 0.0).unwrap());
        let (x, _) = equator.to_plane(LatLon::new(0.0, 1.0 / 3600.0).unwrap());
        assert!((x - 40_075_016.686 / 1_296_000.0).abs() < 1e-4, "{x}");
    }

    #[test]
    fn there_is_no_place_beyond_the_poles_or_of_no_number() {
        assert_eq!(LatLon::new(90.1, 0.0), None);
        assert_eq!(LatLon::new(0.0, f64::NAN), None);
        assert_eq!(LatLon::new(f64::INFINITY, 0.0), None);
    }

    proptest! {
        #[test]
        fn a_place_comes_back_through_the_plane(
            lat in -80.0..80.0f64, lon in -180.0..180.0f64, x in -20_000.0..20_000.0f64, y in -20_000.0..20_000.0f64,
        ) {
            let plane = TangentPlane::new(LatLon::new(lat, lon).unwrap());
            let (back_x, back_y) = plane.to_plane(plane.to_place(x, y));
            prop_assert!((back_x - x).abs() < 1e-3 && (back_y - y).abs() < 1e-3, "{} {}", back_x - x, back_y - y);
        }
    }
}
