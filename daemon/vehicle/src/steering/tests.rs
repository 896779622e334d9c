//! The choice of waypoints: legs, goals and purposes.

use super::*;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{Areas, Polygon, WeightedArea};

const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 12.0 };
const FOOTPRINT: Footprint = Footprint { across: 4.0, along: 3.0, leg_overlap: 0.0 };

fn steering(kind: PlannerKind) -> Steering {
    Steering::new(AREA, FOOTPRINT, 0.25, kind, 1.0)
}

/// Steers from waypoint to waypoint, and returns them.
fn drive(steering: &mut Steering, map: &LabelGrid, utility: Option<&Utility>, legs: usize) -> Vec<Point> {
    let mut at = steering.start();
    let mut track = vec![at];
    for version in 0..legs {
        let Course::Go(to) = steering.next(at, (map, version as u64), utility, f64::INFINITY) else { break };
        at = to;
        track.push(at);
        steering.handle_view(at);
    }
    track
}

#[test]
fn the_lawnmower_covers_the_area_and_stays_inside_it() {
    let legs = drive(&mut steering(PlannerKind::Horizon), &LabelGrid::default(), None, 20);
    assert!(legs.iter().all(|&(x, y)| (0.0..=20.0).contains(&x) && (0.0..=12.0).contains(&y)), "{legs:?}");
    assert!(legs.iter().any(|l| l.1 > 9.0) && legs.iter().any(|l| l.1 < 2.0), "{legs:?}");
}

#[test]
fn a_return_point_outside_the_area_adds_no_leg() {
    let mut steering = steering(PlannerKind::Lawnmower);
    let fence = Fence { return_point: Some(DecimetrePoint::new(-600, -400)), ..Fence::default() };
    steering.set_fence(&fence);
    let track = drive(&mut steering, &LabelGrid::default(), None, 40);
    let legs: Vec<_> = track.into_iter().skip_while(|at| at.0 < 0.0).collect();
    assert!(legs.iter().all(|&(x, y)| (0.0..=20.0).contains(&x) && (0.0..=12.0).contains(&y)), "{legs:?}");
    assert!(legs.iter().any(|l| l.1 > 9.0) && legs.iter().any(|l| l.1 < 2.0), "{legs:?}");
}

#[test]
fn a_fence_that_leaves_a_leg_as_it_is_keeps_the_progress() {
    let map = LabelGrid::default();
    let around = |margin: i32| -> Polygon {
        let (low, east, north) = (-10 * margin, 10 * (20 + margin), 10 * (12 + margin));
        Polygon([(low, low), (east, low), (east, north), (low, north)].map(|(x, y)| DecimetrePoint::new(x, y)).into())
    };
    let block = Polygon([(20, 10), (40, 10), (40, 20), (20, 20)].map(|(x, y)| DecimetrePoint::new(x, y)).into());
    let return_point = Some(DecimetrePoint::new(100, 60));
    for fence in [
        Fence { fence: Some(around(1)), ..Fence::default() },
        Fence { fence: Some(around(9)), return_point, ..Fence::default() },
        Fence { keep_outs: vec![block], ..Fence::default() },
    ] {
        let mut steering = steering(PlannerKind::Horizon);
        let track = drive(&mut steering, &map, None, 6);
        let at = track[6];
        let Course::Go(expected) = steering.next(at, (&map, 6), None, f64::INFINITY) else { panic!("no leg") };
        steering.set_fence(&fence);
        let Course::Go(next) = steering.next(at, (&map, 7), None, f64::INFINITY) else { panic!("no leg") };
        assert!(distance(next, expected) < 0.1, "{next:?} instead of {expected:?} from {at:?}: {fence:?}");
    }
}

#[test]
fn a_leg_left_for_a_destination_is_flown_from_there() {
    let map = LabelGrid::default();
    let mut steering = steering(PlannerKind::Horizon);
    let track = drive(&mut steering, &map, None, 6);
    let (begin, Course::Go(end)) = (track[6], steering.next(track[6], (&map, 6), None, f64::INFINITY)) else {
        panic!("no leg")
    };
    let left = ((begin.0 * 2.0 + end.0) / 3.0, begin.1);
    steering.set_destination(Some(DecimetrePoint::new(40, 20)));
    let mut at = left;
    while let Some(Course::Go(to)) = steering.next_detour(at, f64::INFINITY) {
        at = to;
    }
    assert!(distance(at, (4.0, 2.0)) < 0.6, "{at:?}");
    let mut after = Vec::new();
    while after.last() != Some(&end) && after.len() < 9 {
        let Course::Go(to) = steering.next(at, (&map, 7), None, f64::INFINITY) else { panic!("no way back") };
        after.push(to);
        at = to;
    }
    let back = after.iter().position(|&to| distance(to, left) <= steering.grounds.lattice().step_m());
    assert!(back.is_some_and(|back| back + 1 < after.len()), "left {left:?} of {begin:?} to {end:?}: {after:?}");
}

#[test]
fn a_fence_in_the_middle_of_a_leg_leaves_out_what_was_flown() {
    let map = LabelGrid::default();
    let mut steering = steering(PlannerKind::Horizon);
    let track = drive(&mut steering, &map, None, 6);
    let Course::Go(end) = steering.next(track[6], (&map, 6), None, f64::INFINITY) else { panic!("no leg") };
    let half = ((track[6].0 + end.0) / 2.0, end.1);
    let block = Polygon([(20, 10), (40, 10), (40, 20), (20, 20)].map(|(x, y)| DecimetrePoint::new(x, y)).into());
    steering.set_fence(&Fence { keep_outs: vec![block], ..Fence::default() });
    let mut at = half;
    let mut visited = Vec::new();
    for _ in 0..20 {
        let Course::Go(to) = steering.next(at, (&map, 7), None, f64::INFINITY) else { break };
        visited.push(to);
        at = to;
        if to.1 > 10.0 && visited.len() > 3 {
            break;
        }
    }
    assert!(distance(*visited.last().unwrap(), track[0]) > 8.0, "{visited:?}");
    assert!(visited.iter().all(|to| to.1 > end.1 - 0.1), "nothing is flown again: {visited:?}");
    assert!(visited.iter().any(|to| distance(*to, end) < 0.1), "the leg is finished: {visited:?}");
}

#[test]
fn an_adaptive_plan_has_a_purpose_while_anything_is_of_interest() {
    let mut map = LabelGrid::default();
    (0..48).for_each(|y| {
        (0..40).for_each(|x| {
            map.set(Cell::new(x, y), if x > 20 { 2 } else { 1 });
        })
    });
    let mut steering = steering(PlannerKind::Horizon);
    drive(&mut steering, &map, None, 2);
    assert_eq!(steering.intent(), None, "a lawnmower has no purpose of its own");
    let favour = Utility { weights: [(2, 100)].into(), ..Utility::default() };
    drive(&mut steering, &map, Some(&favour), 1);
    assert_eq!(steering.intent(), Some(Intent::LabelAgain(2)), "it is known floor of that label");
    steering.replan();
    let explore = Utility { exploration: 100, ..Utility::default() };
    drive(&mut steering, &map, Some(&explore), 1);
    assert_eq!(steering.intent(), Some(Intent::Unseen));
    steering.replan();
    let averse = Utility { exploration: -10, weights: [(1, -50), (2, -50)].into(), ..Utility::default() };
    drive(&mut steering, &map, Some(&averse), 1);
    assert_eq!(steering.intent(), None, "nothing pays");
}

#[test]
fn a_favoured_label_draws_the_vehicle_to_it() {
    let mut map = LabelGrid::default();
    for y in 0..48 {
        for x in 0..80 {
            map.set(Cell::new(x, y), if x > 60 && y > 30 { 2 } else { 1 });
        }
    }
    let weights = [(2, 100), (1, -5)].into_iter().collect();
    let utility = Utility { weights, ..Utility::default() };
    for kind in [PlannerKind::Greedy, PlannerKind::Horizon] {
        let track = drive(&mut steering(kind), &map, Some(&utility), 12);
        assert!(track.iter().any(|to| to.0 > 14.0 && to.1 > 7.0), "{kind:?}: {track:?}");
    }
}

#[test]
fn a_weighted_area_attracts_or_repels_without_a_utility() {
    let map: LabelGrid = (0..48 * 80).map(|i| (Cell::new(i % 80, i / 80), 1)).collect();
    let corners = [(140, 70), (195, 70), (195, 115), (140, 115)].map(|(x, y)| DecimetrePoint::new(x, y));
    let area = |weight| Areas(vec![WeightedArea { outline: Polygon(corners.into()), weight }]);
    let mut steering = steering(PlannerKind::Horizon);
    steering.set_areas(area(80));
    let track = drive(&mut steering, &map, None, 12);
    assert_eq!(steering.intent(), Some(Intent::Area(1)));
    assert!(track.iter().any(|&(x, y)| x > 13.0 && y > 6.0), "{track:?}");
    let mut steering = self::steering(PlannerKind::Horizon);
    steering.set_areas(area(-100));
    let utility = Utility { weights: [(1, 50)].into(), ..Utility::default() };
    let track = drive(&mut steering, &map, Some(&utility), 12);
    assert!(!track.iter().any(|&(x, y)| x > 15.0 && y > 8.0), "{track:?}");
}

#[test]
fn what_was_passed_over_before_it_was_favoured_is_visited_first() {
    let is_patch = |(x, y): Point| x < 3.0 && y > 8.0;
    let map: LabelGrid = (0..48 * 44)
        .map(|i| (Cell::new(i % 44, i / 44), (0.25 * f64::from(i % 44), 0.25 * f64::from(i / 44))))
        .map(|(cell, at)| (cell, if is_patch(at) { 2 } else { 1 }))
        .collect();
    let favour = |weight| Utility { weights: [(2, weight)].into(), ..Utility::default() };
    let mut steering = steering(PlannerKind::Horizon);
    // Several passes over the patch, and unseen floor beside the vehicle.
    for pass in 0..6 {
        (0..24).for_each(|i| steering.handle_view((f64::from(i) / 2.0, 8.0 + 0.5 * f64::from(pass))));
    }
    let mut at = (10.0, 4.0);
    let mut fly = |steering: &mut Steering, utility: &Utility, legs: u64| {
        (0..legs)
            .map(|version| {
                let Course::Go(to) = steering.next(at, (&map, version), Some(utility), f64::INFINITY) else {
                    return at;
                };
                at = to;
                steering.handle_view(at);
                at
            })
            .collect::<Vec<Point>>()
    };
    let track = fly(&mut steering, &favour(80), 12);
    assert!(track[0].0 < 10.0 && track.iter().any(|&to| is_patch(to)), "{track:?}");
    // The same order again forgets no looks: the survey goes on to unseen floor.
    fly(&mut steering, &favour(80), 40);
    let track = fly(&mut steering, &favour(80), 20);
    assert!(track.iter().any(|&(x, _)| x > 12.0), "{track:?}");
}
