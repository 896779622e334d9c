//! Messages of ROS 2 as items.

mod grid_map;
mod image;
mod occupancy;

pub use grid_map::bands_of_grid_map;
pub use image::item_of_image;
pub use occupancy::{band_of_occupancy, item_of_occupancy};

use crate::{ItemTime, Refusal};
use scenecast_messages::geometry_msgs::Quaternion;
use scenecast_messages::std_msgs::Header;
use scenecast_protocol::map::LayerDescriptor;

/// Frames of reference that stand still, of ROS REP 105.
const STILL_FRAMES: [&str; 2] = ["map", "odom"];
/// Turn of a grid that is taken for none, radians: on 2000 cells less than half a cell.
const MAX_TURN_RAD: f64 = 1e-4;

/// Refuses a message in another frame of reference than `wanted`; without a wanted one, `map`, `odom` and none are taken.
fn check_frame(header: &Header, wanted: &str) -> Result<(), Refusal> {
    let frame = header.frame_id.trim_start_matches('/');
    let (is_taken, taken) = match wanted.trim_start_matches('/') {
        "" => (frame.is_empty() || STILL_FRAMES.contains(&frame), "map or odom, or that of labels.frame,".to_owned()),
        wanted => (frame == wanted, format!("{wanted:?}, that of labels.frame,")),
    };
    if is_taken { Ok(()) } else { Err(Refusal::Frame(header.frame_id.clone(), taken)) }
}

/// Refuses a grid that does not lie along east and north. A quaternion of zeros, as messages have that nobody filled in, is
/// no turn.
fn check_turn(q: &Quaternion) -> Result<(), Refusal> {
    let length = q.x.hypot(q.y).hypot(q.z).hypot(q.w);
    // The angle about the axis, whichever that is.
    let turn_rad = 2.0 * q.x.hypot(q.y).hypot(q.z).atan2(q.w.abs());
    match length < 1e-9 || turn_rad <= MAX_TURN_RAD {
        true => Ok(()),
        false => Err(Refusal::Turned(turn_rad.to_degrees())),
    }
}

/// The time of a header; that of the arrival if it has none.
fn time(header: &Header) -> ItemTime {
    match header.stamp.nanos() {
        nanos if nanos > 0 => ItemTime::Unix(nanos as f64 / 1e9),
        _ => ItemTime::Arrival,
    }
}

/// Metres within the bounds of a place on the map.
fn metres(what: &'static str, value: f64) -> Result<f64, Refusal> {
    if value.abs() <= 1e6 { Ok(value) } else { Err(Refusal::Range(what, value, "-1e6 to 1e6 m")) }
}

/// The edge of a cell.
fn edge(value: f64) -> Result<f64, Refusal> {
    if (1e-4..=1e4).contains(&value) { Ok(value) } else { Err(Refusal::Range("resolution", value, "1e-4 to 1e4 m")) }
}

/// A name for people as that of a band: `Elevation (m)` becomes `elevation__m_`.
fn band_name(name: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    name.chars().map(word).take(LayerDescriptor::MAX_NAME).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_move_with_the_robot_are_refused() {
        let of = |frame: &str, wanted| check_frame(&Header { frame_id: frame.to_owned(), ..Header::default() }, wanted);
        assert!(of("map", "").is_ok() && of("/odom", "").is_ok() && of("", "").is_ok() && of("world", "world").is_ok());
        let refused = of("base_link", "").unwrap_err().to_string();
        assert!(refused.contains("\"base_link\": map or odom"), "{refused}");
        assert!(of("map", "world").is_err() && of("", "world").is_err());
    }

    #[test]
    fn a_turned_grid_is_refused_with_its_angle() {
        assert!(check_turn(&Quaternion::from_yaw(0.0)).is_ok());
        assert!(check_turn(&Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 }).is_ok());
        assert!(check_turn(&Quaternion { x: 0.0, y: 0.0, z: 0.0, w: -1.0 }).is_ok());
        let refused = check_turn(&Quaternion::from_yaw(0.5)).unwrap_err().to_string();
        assert!(refused.contains("28.65 degrees"), "{refused}");
        assert!(check_turn(&Quaternion { x: f64::NAN, y: 0.0, z: 0.0, w: 1.0 }).is_err());
    }
}
