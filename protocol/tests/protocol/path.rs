//! The planned path at the surface is the vehicle's, in virtual time.

use crate::pair::{LinkedEnds, LossyChannel, Setup, auv, patchy, utility};
use proptest::prelude::*;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Class;
use scenecast_protocol::wire::{PlannedPath, VehicleStatus};
use std::time::Duration;

const STILL: LossyChannel = LossyChannel {
    loss: 0.0,
    duplication: 0.0,
    reordering: 0.0,
    corruption: 0.0,
    talker: 0.0,
    propagation: Duration::from_millis(300),
};

/// A plan whose every point has its number.
fn plan(number: u32, points: usize) -> VehicleStatus {
    let x = f64::from(number);
    let points = (1..=points).map(|i| MapPoint::new(x, i as f64)).collect();
    let path = PlannedPath { points, continues: false };
    VehicleStatus { labels: 3, waypoint: Some(MapPoint::new(x, 0.0)), path, ..VehicleStatus::default() }
}

fn received(pair: &LinkedEnds) -> Option<&VehicleStatus> {
    pair.surface.vehicle(auv()).unwrap().status().map(|(status, _)| status)
}

/// Whether the surface has the waypoint and the path of the vehicle's plan, as far as a pose has it.
fn is_received(pair: &LinkedEnds) -> bool {
    let plan = &pair.status;
    received(pair).is_some_and(|received| {
        let n = received.path.points.len();
        let is_whole = n == plan.path.points.len().min(PlannedPath::MAX_POINTS);
        is_whole && received.waypoint == plan.waypoint && received.path.points[..] == plan.path.points[..n]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::cases(40) as u32))]

    #[test]
    fn the_shown_path_is_one_whole_plan_never_an_older(
        seed: u64,
        loss in 0.0..0.8f64,
        frame_bytes in prop_oneof![Just(96usize), Just(256), Just(1000)],
        steps in proptest::collection::vec((0u8..6, 0usize..10), 12),
    ) {
        let channel = LossyChannel { loss, duplication: 0.2, reordering: 0.2, corruption: 0.1, ..STILL };
        let mut pair = LinkedEnds::new(seed, Setup::new(frame_bytes, 10_000, Codec::Context), channel);
        let mut latest = 0;
        for (step, (action, places)) in steps.into_iter().enumerate() {
            let map = patchy(24, step as u64);
            pair.vehicle.set_map(map.iter(), pair.now);
            for second in 1..=15 {
                pair.status = plan(step as u32 * 15 + second, places);
                if action > 2 {
                    pair.vehicle.owe_pose(pair.now);
                }
                pair.run(pair.now + Duration::from_secs(1), false);
                let Some((received, x)) = received(&pair).and_then(|t| Some((t, t.waypoint?.x_m))) else { continue };
                prop_assert!(received.path.points.iter().all(|p| p.x_m == x), "{:?} of two plans", received.path);
                prop_assert!(x as u32 >= latest, "plan {} after {}", x, latest);
                latest = x as u32;
            }
            match action {
                0 => pair.restart_vehicle(&map),
                1 => pair.restart_surface(),
                _ => {}
            }
        }
        pair.channel = STILL;
        pair.run(pair.now + Duration::from_secs(60), false);
        prop_assert!(is_received(&pair), "{:?} is not {:?}", received(&pair).map(|t| &t.path), pair.status.path);
    }
}

#[test]
fn a_path_from_before_an_applied_order_is_hidden() {
    let mut pair = LinkedEnds::new(3, Setup::new(256, 10_000, Codec::Context), STILL);
    pair.status = plan(1, 5);
    pair.run(pair.now + Duration::from_secs(30), false);
    assert!(is_received(&pair));
    pair.surface.issue(auv(), utility(5), pair.now).unwrap();
    let mut runs = 0;
    while is_received(&pair) {
        assert!(
            received(&pair).unwrap().slots.iter().all(|s| s.version_low == 0),
            "applied, and the old path is shown"
        );
        pair.run(pair.now + Duration::from_millis(100), false);
        runs += 1;
        assert!(runs < 100, "the report never came");
    }
    let status = received(&pair).unwrap();
    assert_eq!((status.waypoint, &status.path), (None, &PlannedPath::default()));
    pair.status = plan(2, 5);
    pair.vehicle.owe_pose(pair.now);
    pair.run(pair.now + Duration::from_secs(5), false);
    assert!(is_received(&pair), "the new one comes at once");
}

#[test]
fn a_path_takes_at_most_a_hundredth_of_the_budget() {
    for budget_bps in [100, 1000, 10_000].into_iter().take(crate::cases(4) as usize) {
        let hour = |places: usize| {
            let mut pair = LinkedEnds::new(9, Setup::new(256, budget_bps, Codec::Context), STILL);
            for minute in 0..60 {
                // Differences of 25 bits.
                pair.status = plan(minute, places);
                let far = |(i, point): (usize, &mut MapPoint)| point.x_m = if i % 2 == 0 { 8e5 } else { -8e5 };
                pair.status.path.points.iter_mut().enumerate().for_each(far);
                pair.vehicle.set_map(patchy(60, minute.into()).iter(), pair.now);
                pair.run(pair.now + Duration::from_secs(60), false);
            }
            assert!(received(&pair).is_some_and(|t| t.path.continues == (places > PlannedPath::MAX_POINTS)));
            pair.vehicle.stats().bytes_by_class[&Class::Status] * 8
        };
        let (without, with) = (hour(0), hour(8));
        assert!(with > without, "no path is sent");
        let share = (with - without) as f64 / f64::from(budget_bps * 3600);
        assert!(share < 0.01, "{share} of {budget_bps} bit/s");
    }
}
