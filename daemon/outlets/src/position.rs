//! Poses, paths and positions on the Earth.

use scenecast_core::LatLon;
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::geometry_msgs::{
    Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion,
};
use scenecast_messages::nav_msgs::Path;
use scenecast_messages::sensor_msgs::{NavSatFix, NavSatStatus};
use scenecast_messages::std_msgs::Header;
use std::f64::consts::FRAC_PI_2;

/// A place of a vehicle at one time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Place {
    pub stamp: Time,
    /// Metres east, north and up; up is negative below the surface.
    pub position_m: [f64; 3],
    /// Heading in radians, clockwise from north.
    pub heading_rad: f64,
}

impl Place {
    fn pose(&self) -> Pose {
        let [x, y, z] = self.position_m;
        Pose { position: Point { x, y, z }, orientation: Quaternion::from_yaw(FRAC_PI_2 - self.heading_rad) }
    }
}

/// A pose with the standard deviation of its position, metres. The covariance has 0 for the depth and the angles, of which
/// scenecast has no estimate.
pub fn pose(place: &Place, sigma_m: f64, frame: &str) -> PoseWithCovarianceStamped {
    let mut covariance = [0.0; 36];
    // East and north: the first and the second element of the diagonal.
    (covariance[0], covariance[7]) = (sigma_m * sigma_m, sigma_m * sigma_m);
    PoseWithCovarianceStamped {
        header: crate::header(place.stamp.clone(), frame),
        pose: PoseWithCovariance { pose: place.pose(), covariance },
    }
}

/// Places along a path, the oldest first.
pub fn path<'a>(places: impl IntoIterator<Item = &'a Place>, header: Header) -> Path {
    let frame = header.frame_id.clone();
    let stamped =
        |place: &Place| PoseStamped { header: crate::header(place.stamp.clone(), &frame), pose: place.pose() };
    Path { poses: places.into_iter().map(stamped).collect(), header }
}

/// A position on the Earth with its standard deviation, metres. The altitude is NaN: depth counts from the water, and the
/// message counts from the ellipsoid.
pub fn fix(place: LatLon, sigma_m: f64, header: Header) -> NavSatFix {
    let mut position_covariance = [0.0; 9];
    (position_covariance[0], position_covariance[4]) = (sigma_m * sigma_m, sigma_m * sigma_m);
    NavSatFix {
        header,
        status: NavSatStatus { status: NavSatStatus::STATUS_FIX, service: NavSatStatus::SERVICE_GPS },
        latitude: place.lat_deg,
        longitude: place.lon_deg,
        altitude: f64::NAN,
        position_covariance,
        position_covariance_type: NavSatFix::COVARIANCE_TYPE_APPROXIMATED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::SQRT_2;

    #[test]
    fn headings_from_north_become_angles_from_east() {
        let at = |heading_deg: f64| {
            let place =
                Place { heading_rad: heading_deg.to_radians(), position_m: [1.0, 2.0, -3.0], ..Place::default() };
            pose(&place, 0.5, "map")
        };
        let east = at(90.0).pose.pose.orientation;
        assert!((east.w - 1.0).abs() < 1e-12 && east.z.abs() < 1e-12);
        let north = at(0.0).pose.pose.orientation;
        assert!((north.w - SQRT_2 / 2.0).abs() < 1e-12 && (north.z - SQRT_2 / 2.0).abs() < 1e-12);
        let message = at(0.0);
        assert_eq!(message.pose.pose.position, Point { x: 1.0, y: 2.0, z: -3.0 });
        assert_eq!(
            (message.pose.covariance[0], message.pose.covariance[7], message.pose.covariance[14]),
            (0.25, 0.25, 0.0)
        );
    }

    #[test]
    fn a_fix_has_latitude_and_longitude_and_no_altitude() {
        let fix = fix(LatLon::new(29.5, 34.9).unwrap(), 2.0, Header::default());
        assert_eq!((fix.latitude, fix.longitude, fix.position_covariance[4]), (29.5, 34.9, 4.0));
        assert!(fix.altitude.is_nan());
    }
}
