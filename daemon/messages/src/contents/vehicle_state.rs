//! A vehicle as messages of ROS 2: poses, paths and positions on the Earth, exemplars, the state of its parts.

use crate::Byte;
use crate::builtin_interfaces::Time;
use crate::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::geometry_msgs::{Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion};
use crate::nav_msgs::Path;
use crate::sensor_msgs::{CompressedImage, NavSatFix, NavSatStatus};
use crate::std_msgs::Header;
use image::codecs::jpeg::JpegEncoder;
use scenecast_core::LatLon;
use std::f64::consts::FRAC_PI_2;

/// The state of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// `DiagnosticStatus::OK`, `WARN`, `ERROR` or `STALE`.
    pub level: u8,
    /// The part, such as `link`.
    pub part: &'static str,
    /// The state of the part, in one line for people.
    pub message: String,
    pub values: Vec<(&'static str, String)>,
}

/// The states of the parts of a vehicle.
pub fn diagnostics(parts: impl IntoIterator<Item = Health>, vehicle: &str, header: Header) -> DiagnosticArray {
    let status = |Health { level, part, message, values }: Health| DiagnosticStatus {
        level: Byte(level),
        name: format!("scenecast/{vehicle}: {part}"),
        message,
        hardware_id: vehicle.to_owned(),
        values: values.into_iter().map(|(key, value)| KeyValue { key: key.to_owned(), value }).collect(),
    };
    DiagnosticArray { header, status: parts.into_iter().map(status).collect() }
}

/// Quality of the JPEG, of 100: it costs no acoustic bits.
const QUALITY: u8 = 90;
/// The longest edge of an exemplar, pixels.
const MAX_EDGE: u32 = 1024;

/// A JPEG of an exemplar, since viewers and `image_transport` read no WebP. `None` if the bytes are no WebP without
/// transparency, or the image is larger than any exemplar.
pub fn exemplar_jpeg(webp: &[u8], header: Header) -> Option<CompressedImage> {
    let features = webp::BitstreamFeatures::new(webp)?;
    if features.width().max(features.height()) > MAX_EDGE {
        return None;
    }
    let decoded = webp::Decoder::new(webp).decode().filter(|image| !image.is_alpha())?;
    let mut data = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut data, QUALITY);
    image::ImageEncoder::write_image(
        encoder,
        &decoded,
        decoded.width(),
        decoded.height(),
        image::ExtendedColorType::Rgb8,
    )
    .ok()?;
    Some(CompressedImage { header, format: "jpeg".to_owned(), data })
}

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
        camera_pose(self.position_m, -self.heading_rad)
    }
}

/// The pose of something that points `yaw_rad` counter-clockwise from north; metres east, north and up.
pub fn camera_pose([x, y, z]: [f64; 3], yaw_rad: f64) -> Pose {
    Pose { position: Point { x, y, z }, orientation: Quaternion::from_yaw(FRAC_PI_2 + yaw_rad) }
}

/// A pose with the standard deviation of its position, metres. The covariance has 0 for the depth and the angles, of which
/// scenecast has no estimate.
pub fn pose(place: &Place, sigma_m: f64, frame: &str) -> PoseWithCovarianceStamped {
    let mut covariance = [0.0; 36];
    // East and north: the first and the second element of the diagonal.
    (covariance[0], covariance[7]) = (sigma_m * sigma_m, sigma_m * sigma_m);
    PoseWithCovarianceStamped {
        header: super::header(place.stamp.clone(), frame),
        pose: PoseWithCovariance { pose: place.pose(), covariance },
    }
}

/// Places along a path, the oldest first.
pub fn path<'a>(places: impl IntoIterator<Item = &'a Place>, header: Header) -> Path {
    let frame = header.frame_id.clone();
    let stamped =
        |place: &Place| PoseStamped { header: super::header(place.stamp.clone(), &frame), pose: place.pose() };
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
    fn an_exemplar_becomes_a_jpeg_of_the_same_colours() {
        let pixels: Vec<u8> = [200, 100, 50].repeat(32 * 16);
        let webp = webp::Encoder::from_rgb(&pixels, 32, 16).encode(80.0);
        let message = exemplar_jpeg(&webp, Header::default()).unwrap();
        assert_eq!(message.format, "jpeg");
        let again = image::load_from_memory_with_format(&message.data, image::ImageFormat::Jpeg).unwrap().to_rgb8();
        assert_eq!(again.dimensions(), (32, 16));
        let close = |a: u8, b: u8| a.abs_diff(b) <= 12;
        assert!(again.pixels().all(|p| close(p[0], 200) && close(p[1], 100) && close(p[2], 50)));
        assert_eq!(exemplar_jpeg(b"no image", Header::default()), None);
        assert_eq!(exemplar_jpeg(&webp[..webp.len() / 2], Header::default()), None);
    }

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
