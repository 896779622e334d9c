//! Random orders, maps, drift and silence: no waypoint leads out of the fence, into a keep-out or beyond a limit.

use super::{Vehicle, VehicleOutput};
use crate::{Durable, MapChanges, Navigator};
use proptest::prelude::*;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint, WorldPoint};
use scenecast_protocol::directive::{
    Areas, CellBand, Change, Constraints, Destination, Fence, Limits, PlannerKind, Polygon, Reaction, RefusalReason,
    Settings, ShortDecimal, Slot, SlotId, Utility, WeightedArea,
};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Intent, ModeReason, VehicleMode};
use scenecast_worlds::{Motion, stretches_outside};
use std::time::Duration;

const AREA: Area = Area { west: 0.0, south: 0.0, east: 40.0, north: 30.0 };
const STEP_S: f64 = 0.5;

/// A vehicle in a kinematic simulation, and its orders.
struct Sea {
    vehicle: Vehicle,
    motion: Motion,
    now: Instant,
    fence: Fence,
    /// The limit of distance, and the metres used of it.
    limit: Option<(f64, f64)>,
    /// The autopilot ends its legs this far before their ends, metres.
    stops_before_m: f64,
}

fn profile(config: &Config) -> ModemProfile {
    scenecast_config::modem_profile(config, config.modem.bit_rate)
}

impl Sea {
    fn new(drift: f64, seed: u64) -> Self {
        let mut config = Config::default();
        config.camera.width_px = 320;
        config.camera.height_px = 240;
        let profile = profile(&config);
        let now = Instant::ZERO;
        let vehicle = crate::assemble(&config, None, profile, AREA, Durable::default(), seed, now).unwrap();
        let (x, y) = vehicle.navigator().position().xy();
        Self {
            vehicle,
            motion: Motion::new(x, y, 0.5, drift, seed),
            now,
            fence: Fence::default(),
            limit: None,
            stops_before_m: 0.0,
        }
    }

    fn order(&mut self, slot: Slot) {
        if self.vehicle.apply(slot.clone(), self.now).is_err() {
            return;
        }
        match slot {
            Slot::Fence(fence) => self.fence = fence,
            Slot::Limits(limits) => self.limit = limits.distance_m.map(|m| (f64::from(m), 0.0)),
            _ => {}
        }
    }

    fn see(&mut self, seed: u64) {
        let patch = |x: i32, y: i32| (((x / 9 + 3 * (y / 7)) as u64).wrapping_mul(seed | 1) >> 40) as u8 % 4 + 1;
        let (x, y) = self.vehicle.navigator().position().xy();
        let (x, y) = ((x / 0.25) as i32, (y / 0.25) as i32);
        let cells = (-6..6).flat_map(|dy| (-6..6).map(move |dx| (x + dx, y + dy)));
        let mut known: Vec<(Cell, u8)> = self.vehicle.cells().collect();
        known.extend(cells.map(|(x, y)| (Cell::new(x, y), patch(x, y))));
        self.vehicle.handle_changes(&MapChanges::of_labels(0, 4, known), self.now);
        self.vehicle.handle_persisted();
    }

    /// Half a second. Checks every new leg of the vehicle.
    fn step(&mut self) {
        self.now = self.now + Duration::from_secs_f64(STEP_S);
        self.vehicle.steer(self.now);
        let at = self.vehicle.navigator().position();
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Waypoint(to) => {
                    let navigator = self.vehicle.navigator();
                    self.check(navigator.to_world(at).xy(), navigator.to_world(to).xy());
                    self.check_path();
                    let leg = (to.x_m - at.x_m, to.y_m - at.y_m);
                    let part = 1.0 - (self.stops_before_m / leg.0.hypot(leg.1).max(1e-9)).min(1.0);
                    self.motion.set_target(Some((at.x_m + part * leg.0, at.y_m + part * leg.1)));
                }
                VehicleOutput::Hold => self.motion.set_target(None),
                VehicleOutput::Surface => self.motion.come_up(),
                _ => {}
            }
        }
        let o = self.motion.step(at.xy(), STEP_S);
        self.vehicle.handle_odometry(o.dx_m, o.dy_m, o.heading_rad, self.vehicle.navigator().depth_m(), self.now);
        if let Some((_, used)) = &mut self.limit {
            *used += o.dx_m.hypot(o.dy_m);
        }
    }

    fn check(&self, from: (f64, f64), to: (f64, f64)) {
        let is_back = stretches_outside(&[from, from], &self.fence) > 0;
        assert!(stretches_outside(&[to, to], &self.fence) == 0, "{to:?} is outside of {:?}", self.fence);
        // From outside the fence, the vehicle returns in a straight line.
        assert!(is_back || stretches_outside(&[from, to], &self.fence) == 0, "{from:?} to {to:?}: {:?}", self.fence);
        let returns = self.vehicle.mode().0 == VehicleMode::Return;
        if let Some((limit, used)) = self.limit.filter(|_| !returns) {
            let leg = (to.0 - from.0).hypot(to.1 - from.1);
            assert!(used + leg <= limit, "{used} m and {leg} m more are beyond {limit} m");
        }
    }

    /// Checks the path that is reported after the waypoint.
    fn check_path(&self) {
        let (vehicle, navigator) = (&self.vehicle, self.vehicle.navigator());
        let waypoint = navigator.to_world(vehicle.waypoint().unwrap()).xy();
        let path: Vec<(f64, f64)> = vehicle.path().points.iter().map(|&p| navigator.to_world(p).xy()).collect();
        let way: Vec<(f64, f64)> = std::iter::once(waypoint).chain(path).collect();
        assert_eq!(stretches_outside(&way, &self.fence), 0, "{way:?} leaves {:?}", self.fence);
        let returns = vehicle.mode().0 == VehicleMode::Return;
        if let Some((limit, used)) = self.limit.filter(|_| !returns) {
            let legs: f64 = way.windows(2).map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1)).sum();
            assert!(used + legs <= limit, "{used} m and {legs} m more are beyond {limit} m");
        }
    }
}

fn fence() -> impl Strategy<Value = Slot> {
    let corner = |x: std::ops::Range<i32>, y: std::ops::Range<i32>| (x, y).prop_map(|(x, y)| DecimetrePoint::new(x, y));
    let outline =
        (corner(-20..8, -20..8), corner(150..410, -20..8), corner(150..410, 120..310), corner(-20..8, 120..310));
    let keep_out = (0i32..350, 0i32..250, 10i32..120).prop_map(|(x, y, r)| {
        let at = |dx: i32, dy: i32| DecimetrePoint::new(x + dx, y + dy);
        Polygon(vec![at(-r, -r), at(r, -r / 2), at(r / 3, r)])
    });
    let home = proptest::option::of(corner(0..200, 0..150));
    (outline, proptest::collection::vec(keep_out, 0..4), home).prop_map(|((a, b, c, d), keep_outs, return_point)| {
        Slot::Fence(Fence { fence: Some(Polygon(vec![a, b, c, d])), keep_outs, return_point })
    })
}

fn order() -> impl Strategy<Value = Slot> {
    let reaction =
        || proptest::sample::select(vec![None, Some(Reaction::Hold), Some(Reaction::Return), Some(Reaction::Surface)]);
    let limits = (
        proptest::option::of(10u32..300),
        proptest::option::of(60u32..2000),
        proptest::option::of(5u16..400),
        reaction(),
        reaction(),
    );
    prop_oneof![
        4 => fence(),
        2 => limits.prop_map(|(distance_m, time_s, silence_s, on_silence, on_breach)| {
            Slot::Limits(Limits { distance_m, time_s, silence_s, on_silence, on_breach, ..Limits::default() })
        }),
        2 => (-100i8..=100, -100i8..=100, -100i8..=100, -20i8..=100).prop_map(|(a, b, c, exploration)| {
            Slot::Utility(Utility { epoch: 0, exploration, curiosity: c / 2, weights: [(1, a), (2, b), (3, c)].into() })
        }),
        1 => proptest::option::of((-20i32..420, -20i32..320)).prop_map(|place| {
            let place = place.map(|(x, y)| DecimetrePoint::new(x, y));
            Slot::Destination(Destination { place })
        }),
        1 => (0i32..300, 0i32..200, -100i8..=100).prop_map(|(x, y, weight)| {
            let corners = [(x, y), (x + 90, y), (x + 40, y + 80)].map(|(x, y)| DecimetrePoint::new(x, y));
            Slot::Areas(Areas(vec![WeightedArea { outline: Polygon(corners.into()), weight }]))
        }),
        1 => (any::<bool>(), prop::bool::weighted(0.2)).prop_map(|(hold, abort)| Slot::Constraints(Constraints { hold, abort })),
        1 => Just(Slot::Constraints(Constraints::default())),
        1 => proptest::sample::select(vec![None, Some(PlannerKind::Lawnmower), Some(PlannerKind::Greedy), Some(PlannerKind::Horizon)])
            .prop_map(|planner| Slot::Settings(Settings { planner: planner.map_or(Change::Configured, Change::To), ..Settings::default() })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if std::env::var_os("SCENECAST_FULL").is_some() { 24 } else { 12 }))]
    #[test]
    fn no_waypoint_leaves_the_fence_or_exceeds_a_limit(
        orders in proptest::collection::vec((0u32..160, order()), 1..12),
        drift in 0.0f64..0.05, seed: u64, fixes: bool, stops_before_m in prop_oneof![Just(0.0), 0.0f64..2.5],
    ) {
        let mut sea = Sea { stops_before_m, ..Sea::new(drift, seed) };
        sea.see(seed);
        for (steps, slot) in orders {
            sea.order(slot);
            for step in 0..steps {
                sea.step();
                if step % 8 == 0 {
                    sea.see(seed);
                }
                if fixes && step % 20 == 0 {
                    let (x, y) = (sea.motion.x_m, sea.motion.y_m);
                    sea.vehicle.navigator.handle_fix(WorldPoint::new(x, y), 0.3, sea.now, sea.now);
                }
            }
        }
    }
}

#[test]
fn a_survey_goes_on_where_the_autopilot_stops_short() {
    for (stops_before_m, goes_on) in [(0.0, true), (0.7, true), (1.8, true), (4.0, false)] {
        let mut sea = Sea { stops_before_m, ..Sea::new(0.0, 1) };
        let mut metres = 0.0;
        for _ in 0..2400 {
            let before = sea.vehicle.navigator().position();
            sea.step();
            metres += before.distance_m(sea.vehicle.navigator().position());
        }
        assert_eq!(metres > 300.0, goes_on, "{stops_before_m} m before: {metres} m in 20 minutes");
    }
}

#[test]
fn a_survey_of_one_place_ends_as_arrived() {
    let mut config = Config::default();
    (config.camera.width_px, config.camera.height_px) = (400, 400);
    let width = 400.0 * config.camera.metres_per_pixel;
    let area = Area { west: 0.0, south: 0.0, east: width, north: width };
    let profile = profile(&config);
    let mut vehicle = crate::assemble(&config, None, profile, area, Durable::default(), 1, Instant::ZERO).unwrap();
    vehicle.steer(Instant::ZERO);
    assert_eq!(vehicle.mode(), (VehicleMode::Hold, ModeReason::Survey));
    assert!(vehicle.status(Instant::ZERO).has_arrived());
}

/// A fence from the origin to (20, 20) m with a return point at (5, 5) m.
fn small_fence() -> Fence {
    let place = |x: i32, y: i32| DecimetrePoint::new(10 * x, 10 * y);
    let fence = Polygon(vec![place(-1, -1), place(20, -1), place(20, 20), place(-1, 20)]);
    Fence { fence: Some(fence), keep_outs: Vec::new(), return_point: Some(place(5, 5)) }
}

/// A position that jumps out of the fence is a breach once it stays there.
fn until_it_persists(sea: &mut Sea) {
    sea.step();
    assert_eq!(sea.vehicle.mode().1, ModeReason::Survey, "it may be a false value");
    let end = sea.now + Duration::from_secs(3);
    while sea.now < end {
        sea.step();
    }
}

#[test]
fn one_position_outside_the_fence_is_no_breach_but_a_way_out_is() {
    let mut sea = Sea::new(0.0, 1);
    sea.order(Slot::Fence(small_fence()));
    sea.step();
    let at = sea.vehicle.navigator.position();
    sea.vehicle.navigator.set_pose(25.0, 5.0, 0.0, 16.0, sea.now);
    sea.step();
    sea.vehicle.navigator.set_pose(at.x_m, at.y_m, 0.0, 16.0, sea.now);
    (0..50).for_each(|_| sea.step());
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Survey, ModeReason::Survey));
    sea.vehicle.navigator.set_pose(19.9, 5.0, 0.0, 16.0, sea.now);
    sea.step();
    sea.vehicle.navigator.set_pose(20.1, 5.0, 0.0, 16.0, sea.now);
    sea.step();
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Return, ModeReason::Fence));
}

#[test]
fn a_breach_is_reported_until_the_operator_answers() {
    let mut sea = Sea::new(0.0, 1);
    sea.order(Slot::Fence(small_fence()));
    sea.step();
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Survey, ModeReason::Survey));
    sea.vehicle.navigator.set_pose(25.0, 5.0, 0.0, 16.0, sea.now);
    until_it_persists(&mut sea);
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Return, ModeReason::Fence));
    assert_eq!(sea.vehicle.durable().limits.breach, 2);
    (0..200).for_each(|_| sea.step());
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Hold, ModeReason::Fence), "back at the return point");
    sea.order(Slot::Constraints(Constraints::default()));
    sea.step();
    assert_eq!(sea.vehicle.mode().0, VehicleMode::Survey);
}

#[test]
fn an_order_clears_the_path_until_a_new_one_is_planned() {
    let mut sea = Sea::new(0.0, 1);
    sea.see(1);
    sea.step();
    let survey = sea.vehicle.path().clone();
    assert!(survey.points.len() > 3 && sea.vehicle.waypoint().is_some(), "{survey:?}");
    sea.order(Slot::Fence(small_fence()));
    assert_eq!((sea.vehicle.waypoint(), sea.vehicle.path().points.len()), (None, 0), "not of the old plan");
    sea.step();
    assert!(!sea.vehicle.path().points.is_empty() && sea.vehicle.path() != &survey);
    sea.order(Slot::Constraints(Constraints { hold: true, abort: false }));
    sea.step();
    assert_eq!((sea.vehicle.waypoint(), sea.vehicle.path().points.len()), (None, 0));
    sea.order(Slot::Constraints(Constraints { hold: false, abort: true }));
    sea.order(Slot::Limits(Limits { on_abort: Some(Reaction::Return), ..Limits::default() }));
    sea.vehicle.navigator.set_pose(17.0, 17.0, 0.0, 16.0, sea.now);
    sea.step();
    assert_eq!(sea.vehicle.mode().0, VehicleMode::Return);
    assert_eq!(sea.vehicle.path().points.last(), Some(&MapPoint::new(5.0, 5.0)), "home");
}

#[test]
fn a_fence_stays_in_the_world_when_a_fix_moves_the_map() {
    let mut sea = Sea::new(0.0, 1);
    sea.vehicle.navigator = Navigator::new(10.0, 10.0, 16.0, 0.01).with_start_sigma(20.0);
    sea.order(Slot::Fence(small_fence()));
    sea.step();
    let fix = |sea: &mut Sea, x, y| sea.vehicle.navigator.handle_fix(WorldPoint::new(x, y), 0.1, sea.now, sea.now);
    assert!(fix(&mut sea, 18.0, 10.0).is_used());
    sea.step();
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Survey, ModeReason::Survey));
    let east = sea.vehicle.waypoint().unwrap().x_m;
    assert!(east < 12.0, "{east}: 20 m east of the origin is 12 m east on its map now");
    // Its dead reckoning stays inside the fence all the time.
    sea.vehicle.navigator = Navigator::new(10.0, 10.0, 16.0, 0.01).with_start_sigma(20.0);
    assert!(fix(&mut sea, 24.0, 10.0).is_used());
    until_it_persists(&mut sea);
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Return, ModeReason::Fence));
    let (x, y) = (0..200)
        .map(|_| sea.step())
        .last()
        .map(|()| sea.vehicle.navigator())
        .map(|n| n.to_world(n.position()).xy())
        .unwrap();
    assert!((x - 5.0).hypot(y - 5.0) < 1.0, "({x}, {y}): the return point is of the world, too");
}

#[test]
fn silence_and_abort_trigger_their_reactions() {
    let mut sea = Sea::new(0.0, 1);
    let limits = Limits { silence_s: Some(30), on_silence: Some(Reaction::Surface), ..Limits::default() };
    sea.order(Slot::Limits(limits));
    (0..70).for_each(|_| sea.step());
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Surface, ModeReason::Silence));
    let mut sea = Sea::new(0.0, 1);
    sea.order(Slot::Limits(Limits { on_abort: Some(Reaction::Hold), ..Limits::default() }));
    sea.order(Slot::Constraints(Constraints { hold: false, abort: true }));
    sea.step();
    assert_eq!(sea.vehicle.mode(), (VehicleMode::Abort, ModeReason::Order));
}

#[test]
fn the_last_good_fence_survives_a_refusal_and_a_restart() {
    let mut sea = Sea::new(0.0, 1);
    sea.order(Slot::Fence(small_fence()));
    let far = Fence {
        fence: small_fence()
            .fence
            .map(|p| Polygon(p.0.iter().map(|v| DecimetrePoint { east_dm: v.east_dm + 900, ..*v }).collect())),
        ..Fence::default()
    };
    sea.order(Slot::Fence(far));
    assert_eq!(sea.fence, small_fence(), "a fence that the vehicle is outside of is refused");
    let config = Config::default();
    let durable = sea.vehicle.durable().clone();
    let again = crate::assemble(&config, None, profile(&config), AREA, durable, 1, sea.now).unwrap();
    assert!(!again.guidance.steering().bounds().holds((25.0, 5.0)));
    assert!(again.guidance.steering().bounds().holds((15.0, 5.0)));
    assert_eq!(again.guidance.steering().return_place(), (5.0, 5.0));
}

#[test]
fn bad_settings_are_refused_and_good_ones_survive_a_restart() {
    let figure = |value: f64| Change::To(ShortDecimal::new(value).unwrap());
    let mut sea = Sea::new(0.0, 1);
    let asked = Settings {
        planner: Change::To(PlannerKind::Greedy),
        cells: Change::To(CellBand::Coarse),
        gamma: figure(1e-5),
        frames_per_s: figure(0.2),
        ..Settings::default()
    };
    let tuned = |vehicle: &mut Vehicle| {
        let outputs = std::iter::from_fn(|| vehicle.poll_output());
        outputs.filter_map(|o| if let VehicleOutput::Tune(settings) = o { Some(settings) } else { None }).last()
    };
    assert_eq!(sea.vehicle.apply(Slot::Settings(asked), sea.now), Ok(()));
    assert_eq!(tuned(&mut sea.vehicle), Some(asked));
    for settings in [
        Settings { alpha: figure(1e4), ..Settings::default() },
        Settings { frames_per_s: figure(0.001), gamma: figure(0.1), ..Settings::default() },
        Settings { refine_words_per_s: figure(1e9), ..Settings::default() },
    ] {
        assert_eq!(sea.vehicle.apply(Slot::Settings(settings), sea.now), Err(RefusalReason::OutOfRange));
        assert_eq!((*sea.vehicle.settings(), tuned(&mut sea.vehicle)), (asked, None));
    }
    let more = Settings { alpha: figure(0.3), gamma: Change::Configured, ..Settings::default() };
    assert_eq!(sea.vehicle.apply(Slot::Settings(more), sea.now), Ok(()));
    let config = Config::default();
    let durable = sea.vehicle.durable().clone();
    let again = crate::assemble(&config, None, profile(&config), AREA, durable, 1, sea.now).unwrap();
    assert_eq!(again.settings(), &asked.then(&more));
}

#[test]
fn a_destination_is_reached_and_then_no_longer_in_force() {
    let mut sea = Sea::new(0.0, 3);
    let place = DecimetrePoint::new(300, 200);
    let order = Slot::Destination(Destination { place: Some(place) });
    sea.order(order.clone());
    assert_eq!(sea.vehicle.link.in_force(SlotId::Destination), Some(&order));
    (0..20).for_each(|_| sea.step());
    assert_eq!(sea.vehicle.guidance.intent(), Some(Intent::Destination));
    assert_eq!(sea.vehicle.durable().goals.destination(), Some(place));
    let away_m = |sea: &Sea| {
        let navigator = sea.vehicle.navigator();
        navigator.to_world(navigator.position()).distance_m(place.to_world())
    };
    let mut least_m = f64::INFINITY;
    for _ in 0..400 {
        sea.step();
        least_m = least_m.min(away_m(&sea));
    }
    assert!(least_m < 0.6, "{least_m} m");
    assert_eq!(
        (sea.vehicle.durable().goals.destination(), sea.vehicle.link.in_force(SlotId::Destination)),
        (None, None)
    );
    assert_eq!(sea.vehicle.mode().0, VehicleMode::Survey);
    assert!(away_m(&sea) > 1.0, "the survey is resumed");
    let corners = [(-900, -900), (900, -900), (900, 900), (-900, 900)].map(|(x, y)| DecimetrePoint::new(x, y));
    sea.order(Slot::Fence(Fence { fence: Some(Polygon(corners.into())), ..Fence::default() }));
    let outside = Slot::Destination(Destination { place: Some(DecimetrePoint::new(9000, 9000)) });
    assert_eq!(sea.vehicle.apply(outside, sea.now), Err(RefusalReason::Contradiction));
}
