//! The position of the vehicle across a restart.

use super::Navigator;
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::wire::Placement;
use serde::{Deserialize, Serialize};

/// The position at the last fix, in decimetres so that it can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastPlace {
    /// East and north in the map frame, decimetres.
    at_dm: (i32, i32),
    /// Version, east and north of the placement, if there was one; decimetres.
    placement: Option<(u8, i32, i32)>,
}

fn dm(metres: f64) -> i32 {
    (metres * 10.0).round() as i32
}

fn metres(dm: i32) -> f64 {
    f64::from(dm) / 10.0
}

impl LastPlace {
    /// Takes the present position of a navigator.
    pub fn of(navigator: &Navigator) -> Self {
        let at = navigator.position();
        let placement = navigator.placement().map(|p| (p.version, dm(p.origin.east_m), dm(p.origin.north_m)));
        Self { at_dm: (dm(at.x_m), dm(at.y_m)), placement }
    }

    /// The same place on a new map, whose frame is that of the world at first.
    pub fn for_new_map(self) -> Self {
        let (_, east, north) = self.placement.unwrap_or_default();
        let at_dm = (self.at_dm.0.saturating_add(east), self.at_dm.1.saturating_add(north));
        Self { at_dm, placement: None }
    }

    /// The position in the map frame.
    pub fn at(self) -> MapPoint {
        MapPoint { x_m: metres(self.at_dm.0), y_m: metres(self.at_dm.1) }
    }

    /// The placement of the map in the world.
    pub fn placement(self) -> Option<Placement> {
        let (version, east, north) = self.placement?;
        Some(Placement { version, origin: WorldPoint { east_m: metres(east), north_m: metres(north) } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::time::Instant;

    #[test]
    fn golden_bytes_of_a_place() {
        let place = LastPlace { at_dm: (10, -1), placement: Some((2, 300, 0)) };
        assert_eq!(postcard::to_allocvec(&place).unwrap(), [20, 1, 1, 2, 216, 4, 0]);
    }

    #[test]
    fn a_restarted_vehicle_is_located_on_its_map_by_a_fix() {
        let at = Instant::from_secs_f64;
        let mut before = Navigator::new(0.0, 0.0, 10.0, 0.01).with_start_sigma(20.0);
        before.handle_odometry(50.0, 0.0, 0.0, 10.0, at(50.0));
        assert!(before.handle_fix(WorldPoint::new(57.0, 3.0), 0.5, at(50.0), at(51.0)).is_used());
        let last = LastPlace::of(&before);
        // The vehicle drifted 12 m to the north while its computer was off.
        let mut after = Navigator::resume(last, 10.0, 0.01);
        assert_eq!((after.position(), after.placement()), (MapPoint::new(50.0, 0.0), before.placement()));
        assert!(after.handle_fix(WorldPoint::new(57.0, 15.0), 0.5, at(1.0), at(1.0)).is_used());
        assert_eq!(after.placement(), before.placement(), "the map lies where it lay");
        let (x, y) = after.position().xy();
        assert!((x - 50.0).abs() < 0.5 && (y - 12.0).abs() < 0.5, "{x} {y}");
        let (x, y) = LastPlace::of(&before).for_new_map().at().xy();
        assert!((x - 57.0).abs() < 0.5 && (y - 3.0).abs() < 0.5, "a new map begins where it is in the world");
    }
}
