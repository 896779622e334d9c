//! The plan that the operator is shown is the vehicle's, through losses, a new utility and a hold.

use super::Mission;
use super::tuned_tests::mission;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::wire::{PlannedPath, VehicleMode};
use std::collections::VecDeque;
use std::time::Duration;

/// Waypoint and path in decimetres.
type Plan = (Option<(i32, i32)>, Vec<(i32, i32)>);

fn plan(waypoint: Option<MapPoint>, path: &PlannedPath) -> Plan {
    let dm = |p: MapPoint| ((p.x_m * 10.0).round() as i32, (p.y_m * 10.0).round() as i32);
    (waypoint.map(dm), path.points.iter().copied().map(dm).collect())
}

impl Mission {
    /// Continues the mission and checks that each plan shown to the operator is one that the vehicle `had` at most 40 s
    /// before. Returns the number of new plans.
    fn watch_plans(&mut self, had: &mut VecDeque<Plan>, seconds: u32) -> usize {
        let mut seen: Vec<Plan> = Vec::new();
        for _ in 0..seconds * 5 {
            self.advance(self.now() + Duration::from_millis(200)).unwrap();
            had.push_back(plan(self.vehicle().waypoint(), self.vehicle().path()));
            if had.len() > 200 {
                had.pop_front();
            }
            let Some(shown) = self.shown_plan() else { continue };
            // The shown plan is empty after an applied order, or it is a whole plan of the vehicle.
            assert!(shown == Plan::default() || had.contains(&shown), "{shown:?} is no plan of the vehicle");
            if seen.last() != Some(&shown) {
                seen.push(shown);
            }
        }
        seen.len()
    }

    fn shown_plan(&self) -> Option<Plan> {
        let (status, _) = self.surface().view(self.address)?.status()?;
        Some(plan(status.waypoint, &status.path))
    }
}

#[test]
fn the_shown_plan_is_the_vehicles_and_soon_the_current_one() {
    let mut mission = mission(&["channel.loss=0.1"]);
    let mut had = VecDeque::new();
    assert!(mission.watch_plans(&mut had, 90) > 1, "the legs of the lawnmower");
    let (address, now) = (mission.address, mission.now());
    mission.surface_mut().set_utility(address, &[(1, 0.8)].into(), (0.2, 0.0), now).unwrap();
    assert!(mission.watch_plans(&mut had, 120) > 4, "the planner replaces its plan");
    mission.surface.surface_mut().set_hold(address, true, mission.times.now).unwrap();
    mission.watch_plans(&mut had, 60);
    let (status, _) = mission.surface().view(address).unwrap().status().unwrap();
    assert_eq!((status.mode, mission.shown_plan()), (VehicleMode::Hold, Some(Plan::default())));
    mission.surface.surface_mut().set_hold(address, false, mission.times.now).unwrap();
    // The vehicle may have passed the first places of its plan while the report was under way.
    let places = |(waypoint, path): Plan| waypoint.into_iter().chain(path).collect::<Vec<_>>();
    let in_force = |m: &Mission| {
        let current = places(plan(m.vehicle().waypoint(), m.vehicle().path()));
        !current.is_empty() && m.shown_plan().is_some_and(|shown| places(shown).ends_with(&current))
    };
    // One frame in ten is lost, so that the order or the pose after it may go out twice.
    let give_up = mission.now() + Duration::from_secs(20);
    while !in_force(&mission) {
        assert!(mission.now() < give_up, "{:?} after 20 seconds", mission.shown_plan());
        mission.advance(mission.now() + Duration::from_millis(200)).unwrap();
    }
}
