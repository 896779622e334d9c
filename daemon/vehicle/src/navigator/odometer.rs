//! The path of the last minutes as the sensors measured it, the map's origin in the world, and the position across a restart.

use super::Navigator;
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// A measured displacement without correction, and the length of its path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Displacement {
    pub(super) dx_m: f64,
    pub(super) dy_m: f64,
    pub(super) length_m: f64,
}

/// Remembers the path of the last minutes, so that a late fix is compared with the position at its time.
#[derive(Debug, Default)]
pub(super) struct Odometer {
    /// Sums since the start, with their times.
    track: VecDeque<(Instant, Displacement)>,
}

impl Odometer {
    /// Maximum number of steps that are kept.
    const MAX: usize = 20_000;

    fn last(&self) -> Displacement {
        self.track.back().map_or_else(Displacement::default, |(_, path)| *path)
    }

    pub(super) fn handle_travel(&mut self, dx_m: f64, dy_m: f64, now: Instant, memory_s: f64) {
        let last = self.last();
        let path =
            Displacement { dx_m: last.dx_m + dx_m, dy_m: last.dy_m + dy_m, length_m: last.length_m + dx_m.hypot(dy_m) };
        self.track.push_back((now, path));
        let is_old = |at: Instant| now.since(at).as_secs_f64() > memory_s;
        // One older entry stays, so that times after it can be interpolated.
        while self.track.len() > Self::MAX || self.track.get(1).is_some_and(|(at, _)| is_old(*at)) {
            self.track.pop_front();
        }
    }

    /// The displacement from `taken` to now; `None` if `taken` is further back than `memory_s`.
    pub(super) fn since(&self, taken: Instant, now: Instant, memory_s: f64) -> Option<Displacement> {
        if now.since(taken).as_secs_f64() > memory_s {
            return None;
        }
        let after = self.track.partition_point(|(at, _)| *at <= taken);
        let before = after.checked_sub(1).and_then(|i| self.track.get(i));
        let then = match (before, self.track.get(after)) {
            (Some((a_at, a)), Some((b_at, b))) => {
                let whole = b_at.since(*a_at).as_secs_f64();
                let share = if whole > 0.0 { taken.since(*a_at).as_secs_f64() / whole } else { 0.0 };
                let between = |a: f64, b: f64| a + (b - a) * share;
                Displacement {
                    dx_m: between(a.dx_m, b.dx_m),
                    dy_m: between(a.dy_m, b.dy_m),
                    length_m: between(a.length_m, b.length_m),
                }
            }
            (Some((_, last)), None) => *last,
            // Before the first step the vehicle was at its start.
            (None, Some(_)) if self.track.len() < Self::MAX => Displacement::default(),
            (None, Some(_)) => return None,
            (None, None) => Displacement::default(),
        };
        let last = self.last();
        Some(Displacement {
            dx_m: last.dx_m - then.dx_m,
            dy_m: last.dy_m - then.dy_m,
            length_m: last.length_m - then.length_m,
        })
    }
}

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

/// A fix that is further from the mean than so many standard deviations counts less.
const HUBER: f64 = 1.5;

/// A mean of the differences between fixes and the map. A registered map does not drift, so that all fixes count alike.
#[derive(Debug)]
pub(super) struct Origin {
    at: (f64, f64),
    variance_m2: f64,
}

impl Origin {
    /// An origin at a place, known to `sigma_m` metres in each direction.
    pub(super) fn new(at: (f64, f64), sigma_m: f64) -> Self {
        Self { at, variance_m2: sigma_m * sigma_m }
    }

    pub(super) fn at(&self) -> (f64, f64) {
        self.at
    }

    pub(super) fn add_uncertainty(&mut self, sigma_m: f64) {
        self.variance_m2 += sigma_m * sigma_m;
    }

    /// The map has drifted by `sigma_m` more, in the same direction as before.
    pub(super) fn drift(&mut self, sigma_m: f64) {
        self.variance_m2 = (self.variance_m2.max(0.0).sqrt() + sigma_m).powi(2);
    }

    /// A fix says that the origin is `at`, with a standard deviation in metres.
    pub(super) fn correct(&mut self, at: (f64, f64), sigma_m: f64) {
        let off = (at.0 - self.at.0, at.1 - self.at.1);
        let expected = (self.variance_m2 + sigma_m * sigma_m).sqrt();
        let doubt = (off.0.hypot(off.1) / (HUBER * std::f64::consts::SQRT_2 * expected)).max(1.0);
        let gain = self.variance_m2 / (self.variance_m2 + (doubt * sigma_m).powi(2)).max(1e-12);
        self.at = (self.at.0 + gain * off.0, self.at.1 + gain * off.1);
        self.variance_m2 *= 1.0 - gain;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::time::Instant;

    #[test]
    fn the_path_since_a_time_is_interpolated_and_forgotten() {
        let at = Instant::from_secs_f64;
        let mut odometer = Odometer::default();
        for s in 1..=300 {
            odometer.handle_travel(1.0, 0.5, at(f64::from(s)), 120.0);
        }
        let path = odometer.since(at(250.5), at(300.0), 120.0).unwrap();
        assert!((path.dx_m - 49.5).abs() < 1e-9 && (path.dy_m - 24.75).abs() < 1e-9);
        assert_eq!(odometer.since(at(179.0), at(300.0), 120.0), None);
        assert!(odometer.since(at(180.5), at(300.0), 120.0).is_some());
        assert!(odometer.track.len() <= 123, "{}", odometer.track.len());
        assert_eq!(odometer.since(at(310.0), at(310.0), 120.0), Some(Displacement::default()));
    }

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

    #[test]
    fn all_fixes_count_alike_and_an_outlier_counts_little() {
        let mut origin = Origin::new((0.0, 0.0), 50.0);
        for i in 0..100 {
            let noise = [0.4, -0.4, 0.3, -0.5, 0.2][i % 5];
            origin.correct((3.0 + noise, -2.0 - noise), 0.5);
        }
        let (x, y) = origin.at();
        assert!((x - 3.0).abs() < 0.02 && (y + 2.0).abs() < 0.02, "{x} {y}");
        origin.correct((13.0, -2.0), 0.5);
        assert!((origin.at().0 - x).abs() < 0.05, "{}", origin.at().0);
    }

    #[test]
    fn a_map_that_drifts_follows_new_fixes() {
        let mut origin = Origin::new((0.0, 0.0), 0.1);
        origin.drift(5.0);
        origin.correct((1.0, 0.0), 0.5);
        assert!(origin.at().0 > 0.95, "{}", origin.at().0);
    }
}
