//! The estimate of the vehicle's position.

mod filter;
mod odometer;

pub use odometer::LastPlace;

use filter::Filter;
use odometer::{Odometer, Origin};
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;

/// Dead reckoning in the map frame, and the placement of the map frame in the world.
///
/// The map is binned in the **map frame**, in which the position never jumps. A fix has two effects. The error so far
/// moves the [`Placement`] of the map frame in the world, and with it the whole map, so that no cell is binned again.
/// The part of the error that comes from the sensors (a wrong compass, a wrong log, a current) corrects the dead
/// reckoning from then on, so that later fixes move the placement less and less.
#[derive(Debug)]
pub struct Navigator {
    at: MapPoint,
    heading_rad: f64,
    depth_m: f64,
    filter: Filter,
    odometer: Odometer,
    /// The position by dead reckoning, without corrections by registration.
    dead_reckoned: MapPoint,
    /// Once a frame was registered, the place of the map's origin in the world is a mean of all fixes.
    origin: Origin,
    is_registered: bool,
    /// Path since the last registered frame, metres.
    unregistered_m: f64,
    placement: Option<Placement>,
    last_fix: Option<Instant>,
    /// Fixes that corrected the estimate.
    fixes_used: u64,
    /// Whether the vehicle may have moved while it was off. The first fix then corrects the position on the map.
    is_displaced: bool,
    /// Whether a pose or a displacement was measured since the start.
    is_measured: bool,
    /// The number of refused fixes in a row that agreed with each other, and the deviation of the last one in metres.
    refused: (u32, (f64, f64)),
}

/// The decision about a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FixVerdict {
    Used,
    /// It is older than the memory of the odometer.
    TooOld,
    /// A number is not finite or out of range.
    Invalid,
    /// It is too far from the estimate.
    Outlier,
}

impl FixVerdict {
    pub fn is_used(self) -> bool {
        self == Self::Used
    }
}

impl Navigator {
    /// Maximum age of a fix, seconds.
    const MEMORY_S: f64 = 120.0;
    /// The squared Mahalanobis distance with two degrees of freedom that one of a thousand good fixes exceeds.
    const GATE: f64 = 13.8;
    /// The number of refused fixes in a row that agree with each other after which they are trusted.
    const MIN_AGREEING: u32 = 4;
    /// The placement is changed when it has moved by this distance, metres.
    const MIN_SHIFT_M: f64 = 0.2;
    /// Standard deviation of the drift while the vehicle was off, metres.
    const RESUMED_SIGMA_M: f64 = 50.0;
    /// Drift of registered frames, metres for each metre of path.
    const REGISTERED_DRIFT: f64 = 0.0005;
    /// The maximum distance of a mission from its origin, metres.
    const MAX_DISTANCE_M: f64 = 800_000.0;

    /// Starts at `(x_m, y_m)` without uncertainty. `drift` is the expected error in metres for each metre of path.
    pub fn new(x_m: f64, y_m: f64, depth_m: f64, drift: f64) -> Self {
        Self {
            at: MapPoint { x_m, y_m },
            heading_rad: 0.0,
            depth_m,
            filter: Filter::new((x_m, y_m), drift),
            odometer: Odometer::default(),
            dead_reckoned: MapPoint { x_m, y_m },
            origin: Origin::new((0.0, 0.0), 0.0),
            is_registered: false,
            unregistered_m: 0.0,
            placement: None,
            last_fix: None,
            fixes_used: 0,
            is_displaced: false,
            is_measured: false,
            refused: (0, (0.0, 0.0)),
        }
    }

    /// Continues on the map of an earlier run, near its position at the last fix. The first fix moves
    /// the vehicle, not the map.
    pub fn resume(last: LastPlace, depth_m: f64, drift: f64) -> Self {
        let at = last.at();
        let mut navigator = Self::new(at.x_m, at.y_m, depth_m, drift).with_start_sigma(Self::RESUMED_SIGMA_M);
        let world = Placement::map_to_world(last.placement(), at);
        let shift = (world.east_m - at.x_m, world.north_m - at.y_m);
        navigator.filter.shift(shift.0, shift.1);
        navigator.origin = Origin::new(shift, Self::RESUMED_SIGMA_M);
        (navigator.placement, navigator.is_displaced) = (last.placement(), true);
        navigator
    }

    /// Adds the standard deviation of the start position, metres.
    pub fn with_start_sigma(mut self, sigma_m: f64) -> Self {
        self.filter.add_uncertainty(sigma_m);
        self.origin.add_uncertainty(sigma_m);
        self
    }

    /// The position in the map frame.
    pub fn position(&self) -> MapPoint {
        self.at
    }

    /// Whether a sensor has measured a pose or a displacement since the start; before, the pose is that of the configuration
    /// or of an earlier run.
    pub fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// The position by dead reckoning since the start, which registration does not correct.
    pub fn dead_reckoned(&self) -> MapPoint {
        self.dead_reckoned
    }

    /// The best estimate of the position in the world frame.
    pub fn world(&self) -> WorldPoint {
        if self.is_registered {
            let (east_m, north_m) = self.origin.at();
            return WorldPoint { east_m: self.at.x_m + east_m, north_m: self.at.y_m + north_m };
        }
        let (east_m, north_m) = self.filter.position();
        WorldPoint { east_m, north_m }
    }

    /// The placement of the map frame in the world, as reported; `None` until a fix has moved it.
    pub fn placement(&self) -> Option<Placement> {
        self.placement
    }

    /// Converts a point of the map frame into the world frame, by the current placement.
    pub fn to_world(&self, at: MapPoint) -> WorldPoint {
        Placement::map_to_world(self.placement, at)
    }

    /// Converts a point of the world frame into the map frame, by the current placement.
    pub fn to_map(&self, at: WorldPoint) -> MapPoint {
        Placement::world_to_map(self.placement, at)
    }

    /// Heading clockwise from north, radians.
    pub fn heading_rad(&self) -> f64 {
        self.heading_rad
    }

    /// Depth below the surface, metres.
    pub fn depth_m(&self) -> f64 {
        self.depth_m
    }

    /// Standard deviation of the position in the world, metres.
    pub fn sigma_m(&self) -> f64 {
        self.filter.sigma_m()
    }

    /// The number of fixes that corrected the estimate.
    pub fn fixes_used(&self) -> u64 {
        self.fixes_used
    }

    /// The time at which the last fix was used.
    pub fn last_fix(&self) -> Option<Instant> {
        self.last_fix
    }

    /// The vehicle's own sensors measured a displacement since the last call: metres east and north. A negative depth counts as
    /// the surface, as in the status on the link.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        if ![dx_m, dy_m, heading_rad, depth_m].into_iter().all(f64::is_finite) {
            return;
        }
        (self.heading_rad, self.depth_m) = (heading_rad, depth_m.max(0.0));
        self.is_measured = true;
        self.unregistered_m += dx_m.hypot(dy_m);
        let (x, y) = self.filter.handle_travel(dx_m, dy_m);
        self.travel(x, y);
        self.odometer.handle_travel(dx_m, dy_m, now, Self::MEMORY_S);
    }

    fn travel(&mut self, dx_m: f64, dy_m: f64) {
        let moved = |at: MapPoint| MapPoint { x_m: at.x_m + dx_m, y_m: at.y_m + dy_m };
        (self.at, self.dead_reckoned) = (moved(self.at), moved(self.dead_reckoned));
    }

    /// A camera frame that was taken at `dead_reckoned` is at `placed` on the map. `is_seen` tells whether it overlaps
    /// with an earlier one.
    pub fn handle_registration(&mut self, dead_reckoned: MapPoint, placed: MapPoint, is_seen: bool, now: Instant) {
        let all = [dead_reckoned.x_m, dead_reckoned.y_m, placed.x_m, placed.y_m];
        if !all.into_iter().all(f64::is_finite) {
            return;
        }
        self.is_registered |= is_seen;
        let before = (self.at.x_m - self.dead_reckoned.x_m, self.at.y_m - self.dead_reckoned.y_m);
        let after = (placed.x_m - dead_reckoned.x_m, placed.y_m - dead_reckoned.y_m);
        let (dx, dy) = (after.0 - before.0, after.1 - before.1);
        self.at = MapPoint { x_m: self.at.x_m + dx, y_m: self.at.y_m + dy };
        self.filter.shift(dx, dy);
        self.odometer.handle_travel(dx, dy, now, Self::MEMORY_S);
        let path = std::mem::replace(&mut self.unregistered_m, 0.0);
        let drift = if is_seen { Self::REGISTERED_DRIFT } else { self.filter.drift() };
        self.origin.drift(drift * path);
    }

    /// The vehicle may have travelled so far in any direction without a measurement.
    pub fn handle_unmeasured(&mut self, metres: f64) {
        // The distance is the root mean square over two directions, so each gets its share of the variance.
        self.filter.add_uncertainty(metres.max(0.0) / std::f64::consts::SQRT_2);
        self.origin.add_uncertainty(metres.max(0.0) / std::f64::consts::SQRT_2);
    }

    /// Sets the dead-reckoned pose from another source, such as a recorded mission. A negative depth counts as the surface.
    pub fn set_pose(&mut self, x_m: f64, y_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        (self.is_displaced, self.is_measured) = (false, true);
        let (dx, dy) = (x_m - self.dead_reckoned.x_m, y_m - self.dead_reckoned.y_m);
        (self.heading_rad, self.depth_m) = (heading_rad, depth_m.max(0.0));
        self.unregistered_m += dx.hypot(dy);
        let off = (self.at.x_m - self.dead_reckoned.x_m, self.at.y_m - self.dead_reckoned.y_m);
        self.dead_reckoned = MapPoint { x_m, y_m };
        self.at = MapPoint { x_m: x_m + off.0, y_m: y_m + off.1 };
        self.filter.shift(dx, dy);
        self.odometer.handle_travel(dx, dy, now, Self::MEMORY_S);
    }

    /// Takes a fix: the position in the world frame at the time `taken`, with its standard deviation in metres.
    pub fn handle_fix(&mut self, at: WorldPoint, sigma_m: f64, taken: Instant, now: Instant) -> FixVerdict {
        let (x_m, y_m) = at.xy();
        let is_place = x_m.abs() <= Self::MAX_DISTANCE_M && y_m.abs() <= Self::MAX_DISTANCE_M;
        if !is_place || !sigma_m.is_finite() || sigma_m < 0.0 {
            return FixVerdict::Invalid;
        }
        let Some(since) = self.odometer.since(taken.min(now), now, Self::MEMORY_S) else { return FixVerdict::TooOld };
        let sigma = sigma_m.clamp(0.1, 1e4);
        let expected = self.filter.expect(&since, sigma);
        let off = (x_m - expected.at.0, y_m - expected.at.1);
        if expected.distance2(off) > Self::GATE && !self.confirms_refused(off, sigma) {
            return FixVerdict::Outlier;
        }
        self.refused = (0, (0.0, 0.0));
        self.filter.correct(&since, (x_m, y_m), sigma);
        let then = (self.at.x_m - since.dx_m, self.at.y_m - since.dy_m);
        self.origin.correct((x_m - then.0, y_m - then.1), sigma);
        self.last_fix = Some(now);
        if std::mem::take(&mut self.is_displaced) {
            self.displace();
        }
        self.place();
        self.fixes_used += 1;
        FixVerdict::Used
    }

    /// Fixes that all deviate by the same vector are right and the estimate is wrong, so its uncertainty is raised.
    fn confirms_refused(&mut self, off: (f64, f64), sigma: f64) -> bool {
        let (row, before) = self.refused;
        let agrees = row > 0 && (off.0 - before.0).hypot(off.1 - before.1) < 4.0 * sigma + 1.0;
        let row = if agrees { row + 1 } else { 1 };
        self.refused = (row, off);
        if row >= Self::MIN_AGREEING {
            self.filter.add_uncertainty(off.0.hypot(off.1));
        }
        row >= Self::MIN_AGREEING
    }

    /// Moves the vehicle on the map to where the fixes say that it is.
    fn displace(&mut self) {
        let (east_m, north_m) = self.filter.position();
        let at = self.to_map(WorldPoint { east_m, north_m });
        let by = (at.x_m - self.at.x_m, at.y_m - self.at.y_m);
        self.dead_reckoned = MapPoint { x_m: self.dead_reckoned.x_m + by.0, y_m: self.dead_reckoned.y_m + by.1 };
        self.at = at;
        self.origin = Origin::new((east_m - at.x_m, north_m - at.y_m), self.filter.sigma_m());
    }

    fn place(&mut self) {
        let world = self.world();
        let origin = WorldPoint { east_m: world.east_m - self.at.x_m, north_m: world.north_m - self.at.y_m };
        let before = self.placement.map_or(WorldPoint::default(), |p| p.origin);
        if before.distance_m(origin) >= Self::MIN_SHIFT_M {
            self.placement = Some(Placement::moved_to(self.placement, origin));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(s)
    }

    /// A vehicle that travelled east for a minute at 1 m/s by dead reckoning.
    fn under_way() -> Navigator {
        let mut nav = Navigator::new(0.0, 0.0, 18.0, 0.1);
        for s in 1..=60 {
            nav.handle_odometry(1.0, 0.0, 0.0, 18.0, at(f64::from(s)));
        }
        nav
    }

    #[test]
    fn a_negative_depth_counts_as_the_surface() {
        let mut nav = under_way();
        nav.handle_odometry(1.0, 0.0, 0.0, -0.05, at(61.0));
        assert_eq!(nav.depth_m(), 0.0);
        nav.set_pose(0.0, 0.0, 0.0, 2.5, at(62.0));
        assert_eq!(nav.depth_m(), 2.5);
        nav.set_pose(0.0, 0.0, 0.0, -1.3, at(63.0));
        assert_eq!(nav.depth_m(), 0.0);
    }

    #[test]
    fn a_late_fix_corrects_the_error_of_its_own_time() {
        let mut nav = under_way();
        assert!(nav.sigma_m() > 0.5);
        // At 30 s the estimate was 30 m and the truth 33 m. Now it is near 66 m if the log is wrong, and near 63 m
        // otherwise.
        assert_eq!(nav.handle_fix(WorldPoint::new(33.0, 0.0), 0.1, at(30.0), at(60.0)), FixVerdict::Used);
        assert!((63.0..67.0).contains(&nav.world().east_m), "{:?}", nav.world());
        assert_eq!(nav.handle_fix(WorldPoint::new(0.0, 0.0), 0.1, at(30.0), at(600.0)), FixVerdict::TooOld);
    }

    #[test]
    fn a_fix_between_two_steps_is_interpolated() {
        let mut nav = under_way();
        nav.handle_fix(WorldPoint::new(30.5, 0.0), 0.1, at(30.5), at(60.0));
        assert!((nav.world().east_m - 60.0).abs() < 0.05, "{:?}", nav.world());
    }

    #[test]
    fn a_fix_moves_the_placement_but_not_the_map() {
        let mut nav = under_way();
        assert_eq!((nav.position(), nav.placement()), (MapPoint::new(60.0, 0.0), None));
        nav.handle_fix(WorldPoint::new(60.0, 3.0), 0.1, at(60.0), at(60.0));
        assert_eq!(nav.position(), MapPoint::new(60.0, 0.0), "no jump in the map's frame");
        let first = nav.placement().unwrap();
        assert_eq!(first.version, 1);
        let (x, y) = first.to_world(nav.position()).xy();
        assert!((x - 60.0).abs() < 0.3 && (y - 3.0).abs() < 0.3, "{x} {y}");
        nav.handle_fix(WorldPoint::new(60.0, 3.0), 0.1, at(60.0), at(60.0));
        assert_eq!(nav.placement().unwrap().version, 1, "a move that is not worth telling");
    }

    #[test]
    fn a_start_position_is_not_measured() {
        let mut nav = Navigator::new(3.0, 4.0, 18.0, 0.02);
        nav.handle_odometry(f64::NAN, 0.0, 0.0, 18.0, at(1.0));
        assert!(!nav.is_measured() && under_way().is_measured());
        nav.set_pose(3.0, 4.0, 0.0, 18.0, at(2.0));
        assert!(nav.is_measured());
    }

    #[test]
    fn registration_moves_the_vehicle_on_the_map_but_not_the_map() {
        let mut nav = under_way();
        nav.handle_fix(WorldPoint::new(60.0, 3.0), 0.1, at(60.0), at(60.0));
        let placement = nav.placement();
        nav.handle_registration(MapPoint::new(60.0, 0.0), MapPoint::new(57.0, 1.0), true, at(61.0));
        assert_eq!((nav.position(), nav.dead_reckoned()), (MapPoint::new(57.0, 1.0), MapPoint::new(60.0, 0.0)));
        assert_eq!(nav.placement(), placement);
        // The next step is added to the registered position, and a pose of a recording is one by dead reckoning.
        nav.handle_odometry(1.0, 0.0, 0.0, 18.0, at(62.0));
        let east = nav.position().x_m - nav.dead_reckoned().x_m;
        nav.set_pose(70.0, 0.0, 0.0, 18.0, at(63.0));
        assert!((nav.position().x_m - 67.0).abs() < 1e-9 && (east + 3.0).abs() < 1e-9, "{:?}", nav.position());
    }

    #[test]
    fn fixes_calibrate_the_sensors_and_straighten_the_track() {
        // A compass error of two degrees on a path of 1 km to the east.
        let mut nav = Navigator::new(0.0, 0.0, 18.0, 0.03);
        let (sin, cos) = 2f64.to_radians().sin_cos();
        let mut error = Vec::new();
        for s in 1..=1000 {
            nav.handle_odometry(cos, sin, 0.0, 18.0, at(f64::from(s)));
            if s % 10 == 0 && s <= 800 {
                nav.handle_fix(WorldPoint::new(f64::from(s), 0.0), 2.0, at(f64::from(s)), at(f64::from(s) + 1.0));
            }
            error.push((nav.world().east_m - f64::from(s)).hypot(nav.world().north_m));
        }
        let without = 200.0 * 2.0 * (1f64.to_radians()).sin();
        assert!(error[999] < 0.4 * without, "{} m after 200 m without a fix; {without} m uncorrected", error[999]);
    }

    #[test]
    fn absurd_fixes_and_outliers_change_nothing() {
        let mut nav = under_way();
        nav.handle_fix(WorldPoint::new(60.0, 0.0), 1.0, at(60.0), at(60.0));
        let before = nav.world();
        for (x, y, sigma, verdict) in [
            (f64::NAN, 0.0, 1.0, FixVerdict::Invalid),
            (0.0, f64::INFINITY, 1.0, FixVerdict::Invalid),
            (60.0, 0.0, f64::NAN, FixVerdict::Invalid),
            (1e7, 0.0, 1.0, FixVerdict::Invalid),
            (60.0, 90.0, 1.0, FixVerdict::Outlier),
            (-40.0, 0.0, 1.0, FixVerdict::Outlier),
        ] {
            assert_eq!(nav.handle_fix(WorldPoint::new(x, y), sigma, at(60.0), at(61.0)), verdict, "{x} {y} {sigma}");
        }
        assert_eq!(nav.world(), before);
    }

    #[test]
    fn unmeasured_motion_is_uncertain_until_a_fix() {
        let mut nav = under_way();
        nav.handle_fix(WorldPoint::new(60.0, 0.0), 1.0, at(60.0), at(60.0));
        let before = nav.sigma_m();
        nav.handle_unmeasured(30.0);
        assert!((20.0..25.0).contains(&nav.sigma_m()), "{} m, {before} m before", nav.sigma_m());
        assert_eq!(
            nav.handle_fix(WorldPoint::new(60.0, 25.0), 1.0, at(61.0), at(61.0)),
            FixVerdict::Used,
            "no outlier any more"
        );
        assert!(nav.sigma_m() < 2.0);
    }

    #[test]
    fn agreeing_outliers_are_trusted_in_the_end() {
        let mut nav = under_way();
        let verdicts: Vec<_> = (0..6)
            .map(|i| nav.handle_fix(WorldPoint::new(60.0, 200.0), 1.0, at(60.0), at(61.0 + f64::from(i))))
            .collect();
        assert_eq!(verdicts[..4], [FixVerdict::Outlier, FixVerdict::Outlier, FixVerdict::Outlier, FixVerdict::Used]);
        assert!((nav.world().north_m - 200.0).abs() < 2.0, "{:?}", nav.world());
    }

    #[test]
    fn a_vehicle_that_never_moved_takes_fixes_of_its_memory() {
        let mut nav = Navigator::new(0.0, 0.0, 5.0, 0.01).with_start_sigma(10.0);
        assert_eq!(nav.handle_fix(WorldPoint::new(8.0, -3.0), 1.0, at(4.0), at(5.0)), FixVerdict::Used);
        assert!((nav.world().east_m - 8.0).abs() < 0.3, "{:?}", nav.world());
    }

    proptest! {
        #[test]
        fn any_fixes_and_steps_keep_the_estimate_finite(
            steps in proptest::collection::vec((any::<f64>(), any::<f64>(), any::<f64>(), -2000.0..2000.0f64, 0.0..300.0f64), 1..60),
        ) {
            let mut nav = Navigator::new(0.0, 0.0, 5.0, 0.01);
            for (i, (a, b, sigma, place, age)) in steps.into_iter().enumerate() {
                let now = at(200.0 + i as f64);
                nav.handle_odometry(a % 3.0, b % 3.0, 0.0, 5.0, now);
                nav.handle_fix(WorldPoint::new(a, b), sigma, now, now);
                nav.handle_fix(WorldPoint::new(place, -place), sigma % 10.0, at((200.0 + i as f64 - age).max(0.0)), now);
                prop_assert!(nav.world().east_m.is_finite() && nav.world().north_m.is_finite() && nav.sigma_m().is_finite());
            }
        }
    }
}
