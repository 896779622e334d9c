//! What a vehicle would do by weights that are not sent: its own planner, on the surface's map.

use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint};
use scenecast_protocol::directive::{Areas, Fence, Settings, SlotId, Utility};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, VehicleMode, VehicleStatus};
use scenecast_surface::state::{DryRun, FirstTarget, LegReason, PlanAims, PlanLeg, SurveyPass, seconds};
use scenecast_surface::{FenceOrder, Ground, LabelBook, OrderRefusal, Place, Purpose, Surface};
use scenecast_vehicle::planning::distance;
use scenecast_vehicle::{Alternative, Course, Steering, footprint, steering};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The length of the path that is planned, metres, and its most legs.
const MAX_M: f64 = 120.0;
const MAX_LEGS: usize = 80;
/// A path that is longer than the straight line by this factor, or than another path, is a detour.
const DETOUR: f64 = 1.5;

/// A dry run with everything that it needs, so that it may run on another thread.
pub struct DryRunTask {
    /// Of the survey and the camera: the surface is not told by the vehicle.
    config: Arc<Config>,
    area: Area,
    cell_m: f64,
    map: LabelGrid,
    labels: LabelBook,
    /// Where the vehicle is by now, as it has planned, in the map frame; and the map's origin in the world frame.
    from: Place,
    map_origin: Place,
    speed_m_s: f64,
    /// Places where the vehicle looked before and after it put the last utility in force.
    track: [Vec<Place>; 2],
    /// The utility in force, and the one to try.
    utility: [Utility; 2],
    orders: OrdersInForce,
    now: Instant,
    mode: VehicleMode,
    rests_on: String,
}

/// The orders that shape a path beside the utility.
struct OrdersInForce {
    fence: Fence,
    areas: Areas,
    destination: Option<DecimetrePoint>,
    settings: Settings,
}

impl DryRunTask {
    /// Takes what the surface knows of a vehicle that has reported its place.
    ///
    /// # Errors
    /// There is no such vehicle, or the weights or the fence are not allowed.
    pub fn new(
        surface: &Surface,
        config: Arc<Config>,
        vehicle: Address,
        (weights, terms, fence): (&BTreeMap<u8, f64>, (f64, f64), Option<&FenceOrder>),
        cell_m: f64,
        now: Instant,
    ) -> Result<Self, OrderRefusal> {
        let (utility, _) = surface.utility_of(vehicle, weights, terms)?;
        let unknown = || OrderRefusal::from(IssueError::NoVehicle);
        let record = surface.record(vehicle).ok_or_else(unknown)?;
        let view = surface.view(vehicle).ok_or_else(unknown)?;
        let (status, reported) = surface.status(vehicle).ok_or(OrderRefusal::NoPlaceYet)?;
        let map = surface.map(vehicle).cloned().unwrap_or_default();
        let since = view.slots().find(|slot| slot.id == SlotId::Utility).map(|slot| slot.changed);
        let is_before = |at: Instant| since.is_none_or(|since| at < since);
        let places = |before: bool| {
            record.track.iter().filter(|&(at, ..)| is_before(at) == before).map(|(_, x, y)| (x, y)).collect()
        };
        let fence = fence.map(FenceOrder::read).transpose()?;
        let in_force = || record.orders.fence.in_force.as_ref().map(|(_, fence)| fence.clone()).unwrap_or_default();
        let orders = OrdersInForce {
            fence: fence.unwrap_or_else(in_force),
            areas: record.orders.areas.in_force.as_ref().map(|(_, areas)| areas.clone()).unwrap_or_default(),
            destination: record.orders.destination.in_force.as_ref().and_then(|(_, to)| to.place),
            settings: record.orders.settings.in_force().copied().unwrap_or_default(),
        };
        let map_origin = status.placement.map_or((0.0, 0.0), |p| p.origin.xy());
        let cell_m = view.cell_m().unwrap_or(cell_m);
        let (cells, own) = (surface.current_cells(vehicle) as f64, f64::from(status.explored_cells).max(1.0));
        let share = (100.0 * cells / own).min(100.0).round();
        let age_s = now.since(*reported).as_secs_f64();
        let speed_m_s = record.track.speed_m_s().unwrap_or(config.survey.speed_m_s);
        let from = carried_on(status, speed_m_s * age_s);
        let (area, assumed) = area(&config, &orders.fence, &map, (from, map_origin, cell_m));
        Ok(Self {
            speed_m_s,
            rests_on: format!(
                "It rests on the surface's map, {share:.0} % of the vehicle's cells, the vehicle's place {age_s:.0} s ago carried on \
                 along its plan, {assumed}, and camera and clearance as configured at the surface."
            ),
            config,
            area,
            cell_m,
            map,
            labels: record.labels_in_view().clone(),
            from,
            map_origin,
            track: [places(true), places(false)],
            utility: [record.orders.utility.clone(), utility],
            orders,
            now,
            mode: status.mode,
        })
    }

    /// Plans the path.
    pub fn run(self) -> DryRun {
        let mut steering = self.steering();
        let pass_m = steering.pass_m();
        let pass =
            (pass_m > 0.0).then(|| SurveyPass { metres: pass_m.round(), time_s: (pass_m / self.speed_m_s).round() });
        let (legs, other) = self.fly(&mut steering);
        let weight = |label: u8| self.utility[1].weight(label);
        let reach_m = footprint(&self.config).reach();
        let ground = Ground { map: &self.map, cell_m: self.cell_m, weight: &weight, reach_m };
        let now_s = seconds(self.now);
        let aims = ground.aims(self.from, &legs, now_s, self.speed_m_s);
        let starts = std::iter::once(self.from).chain(legs.iter().map(|leg| leg.0));
        let metres: f64 = starts.zip(&legs).map(|(a, (b, _))| distance(a, *b)).sum();
        DryRun {
            from: self.from,
            metres: (metres * 10.0).round() / 10.0,
            at_s: now_s,
            text: self.text(&aims, other, now_s),
            rests_on: self.rests_on,
            aims,
            pass,
        }
    }

    /// The vehicle's steering, after the looks and with the orders that the surface knows of.
    fn steering(&self) -> Steering {
        let mut steering = steering(&self.config, self.area, self.cell_m);
        steering.set_placement(self.map_origin.0, self.map_origin.1);
        steering.set_fence(&self.orders.fence);
        steering.set_areas(self.orders.areas.clone());
        steering.set_choices(self.orders.settings.planner.value(), self.orders.settings.at_end.value());
        let [before, after] = &self.track;
        self.look(&mut steering, before.iter().copied());
        // The looks at a label count from when it was weighed.
        let nothing = Utility { epoch: self.utility[0].epoch, ..Utility::default() };
        if self.utility[0] != nothing {
            let _ = steering.next(self.to_world(self.from), (&self.map, 0), Some(&self.utility[0]), f64::INFINITY);
        }
        self.look(&mut steering, before.last().into_iter().chain(after).copied());
        steering.set_destination(self.orders.destination);
        steering
    }

    /// The camera sees the floor along a track in the map frame.
    fn look(&self, steering: &mut Steering, track: impl Iterator<Item = Place>) {
        let mut last: Option<Place> = None;
        for to in track {
            let from = last.replace(to).unwrap_or(to);
            let parts = (distance(from, to) / self.cell_m.max(0.5)).ceil().clamp(1.0, 500.0) as usize;
            for part in 1..=parts {
                let share = part as f64 / parts as f64;
                steering.handle_view((from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)));
            }
        }
    }

    /// The waypoints on a map that stays as it is, in the map frame, and what the first plan may leave aside.
    fn fly(&self, steering: &mut Steering) -> (Vec<(Place, Purpose)>, Option<Alternative>) {
        let (mut at, mut metres, mut legs, mut other) = (self.to_world(self.from), 0.0, Vec::new(), None);
        while metres < MAX_M && legs.len() < MAX_LEGS {
            let detour = steering.next_detour(at, f64::INFINITY);
            let next = || steering.next(at, (&self.map, 1), Some(&self.utility[1]), f64::INFINITY);
            let Course::Go(to) = detour.unwrap_or_else(next) else { break };
            if detour.is_none() && legs.is_empty() {
                other = steering.alternative(at, &self.map, &self.utility[1]);
            }
            let purpose = Purpose::Survey(steering.intent());
            metres += distance(at, to);
            self.look(steering, [self.to_map(at), self.to_map(to)].into_iter());
            legs.push((self.to_map(to), purpose));
            at = to;
        }
        (legs, other)
    }

    fn to_world(&self, (x, y): Place) -> Place {
        (x + self.map_origin.0, y + self.map_origin.1)
    }

    fn to_map(&self, (x, y): Place) -> Place {
        (x - self.map_origin.0, y - self.map_origin.1)
    }

    fn text(&self, aims: &PlanAims, other: Option<Alternative>, now_s: f64) -> String {
        let held = match self.mode {
            VehicleMode::Survey => "",
            _ => " It does not survey now, so it would begin once it is ordered to.",
        };
        let Some(first) = &aims.first else {
            return format!("With these weights the vehicle would hold: nothing of interest is left to it.{held}");
        };
        let name = |reason, label| named(reason, label, &self.labels);
        let target = name(first.reason, first.label);
        let goes = if first.along_m <= 2.0 * footprint(&self.config).reach() {
            format!("look at {target}, where it is now")
        } else {
            format!("go to {target}, {}", self.way(first, now_s))
        };
        let at = aims.legs.iter().position(|leg| (leg.reason, leg.label) == (first.reason, first.label));
        let is_other = |leg: &&PlanLeg| (leg.reason, leg.label) != (first.reason, first.label);
        let then = at.and_then(|at| aims.legs[at..].iter().find(is_other));
        let then = then.map_or_else(String::new, |leg| format!(", then look at {}", name(leg.reason, leg.label)));
        let other = other.map_or_else(String::new, |other| self.left_aside(&other, first));
        format!("With these weights the vehicle would {goes}{then}.{other}{held}")
    }

    /// Distance, direction and time to a target.
    fn way(&self, first: &FirstTarget, now_s: f64) -> String {
        let metres = distance(self.from, first.at);
        let by = match first.along_m > DETOUR * metres {
            true => format!(", by a path of {:.0} m over other floor", first.along_m),
            false => String::new(),
        };
        format!("{}, in about {:.0} s{by}", self.where_is(first.at), first.arrival_s - now_s)
    }

    /// Distance and direction to a place.
    fn where_is(&self, place: Place) -> String {
        let direction = direction(place.0 - self.from.0, place.1 - self.from.1);
        format!("{:.0} m to the {direction}", distance(self.from, place))
    }

    /// Why the vehicle does not go to the nearest known floor of a favoured label first; empty if it does.
    fn left_aside(&self, other: &Alternative, first: &FirstTarget) -> String {
        if first.reason == LegReason::Label && first.along_m <= DETOUR * other.metres {
            return String::new();
        }
        let mut favoured = self.utility[1].weights.iter().filter(|(_, weight)| **weight > 0);
        let floor = match (favoured.next(), favoured.next()) {
            (Some((&label, _)), None) => named(LegReason::Label, Some(label), &self.labels),
            _ => "a favoured label".to_owned(),
        };
        format!(
            " Known floor of {floor} lies {}: a metre of the way there is expected to show {:.2} m², each counted by its weight, a metre of this \
             path {:.2} m².",
            self.where_is(self.to_map(other.at)),
            other.gain_a_metre,
            other.of_plan
        )
    }
}

fn named(reason: LegReason, label: Option<u8>, book: &LabelBook) -> String {
    let label = label.map_or_else(String::new, |label| {
        let name = book.get(&book.shown_as(label)).and_then(|entry| entry.name.as_ref());
        format!("label {label}{}", name.map_or_else(String::new, |name| format!(" ({name})")))
    });
    match reason {
        LegReason::Label => label,
        LegReason::Expected => format!("unseen floor where {label} is expected"),
        LegReason::Unseen => "unseen floor".to_owned(),
        LegReason::Unusual => "unusual places".to_owned(),
        LegReason::Area => "the weighted area".to_owned(),
        LegReason::Destination => "the destination".to_owned(),
        LegReason::Return => "the return point".to_owned(),
        LegReason::Survey => "the survey".to_owned(),
    }
}

/// The direction in words.
fn direction(east: f64, north: f64) -> &'static str {
    const NAMES: [&str; 8] = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];
    let eighths = (east.atan2(north) / std::f64::consts::FRAC_PI_4).round() as i64;
    NAMES[eighths.rem_euclid(8) as usize]
}

/// Where a vehicle is `metres` along its plan from the place that it reported.
fn carried_on(status: &VehicleStatus, mut metres: f64) -> Place {
    let mut at = status.position.xy();
    for to in status.ahead().map(MapPoint::xy) {
        let leg_m = distance(at, to);
        if leg_m > metres {
            let share = metres / leg_m;
            return (at.0 + share * (to.0 - at.0), at.1 + share * (to.1 - at.1));
        }
        (at, metres) = (to, metres - leg_m);
    }
    at
}

/// The area of the survey in the world frame, and where it is from: the configuration, or else the fence, or else what the map shows.
fn area(
    config: &Config,
    fence: &Fence,
    map: &LabelGrid,
    (at, map_origin, cell_m): (Place, Place, f64),
) -> (Area, &'static str) {
    if let Some(area) = config.survey.area_m {
        return (area, "the area configured at the surface");
    }
    let around = |places: &[Place]| {
        places.iter().fold(None, |area: Option<Area>, &(x, y)| {
            let Area { west, south, east, north } = area.unwrap_or(Area { west: x, south: y, east: x, north: y });
            Some(Area { west: west.min(x), south: south.min(y), east: east.max(x), north: north.max(y) })
        })
    };
    let corners: Vec<Place> = fence.fence.iter().flat_map(|f| f.0.iter().map(|p| p.to_world().xy())).collect();
    if let Some(area) = around(&corners) {
        return (area, "the area of the fence");
    }
    let margin = 2.0 * footprint(config).across;
    let corner = |cell: Cell| (f64::from(cell.x) * cell_m + map_origin.0, f64::from(cell.y) * cell_m + map_origin.1);
    let mut places = vec![(at.0 + map_origin.0, at.1 + map_origin.1)];
    places.extend(map.iter().map(|(cell, _)| corner(cell)));
    let area = around(&places).unwrap_or(Area { west: 0.0, south: 0.0, east: 0.0, north: 0.0 });
    (area.shrunk(-margin), "an area around the map, as none is configured at the surface")
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::directive::Polygon;
    use scenecast_surface::record::StoredLabel;

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 60.0, north: 40.0 };

    /// Sand of label 1, with coral of label 4 in the west, all of it seen; the vehicle is in the east.
    fn task(weights: &[(u8, i8)]) -> DryRunTask {
        let label = |x: i32| if x < 40 { 4 } else { 1 };
        let map = (0..160).flat_map(|y| (0..240).map(move |x| (Cell::new(x, y), label(x)))).collect();
        let coral = StoredLabel { name: Some("coral".to_owned()), ..StoredLabel::default() };
        let orders = OrdersInForce {
            fence: Fence::default(),
            areas: Areas::default(),
            destination: None,
            settings: Settings::default(),
        };
        DryRunTask {
            config: Arc::new(Config::default()),
            area: AREA,
            cell_m: 0.25,
            map,
            labels: [(4, coral)].into_iter().collect(),
            from: (40.0, 20.0),
            map_origin: (0.0, 0.0),
            speed_m_s: 0.5,
            track: [Vec::new(), Vec::new()],
            utility: [Utility::default(), Utility { weights: weights.iter().copied().collect(), ..Utility::default() }],
            orders,
            now: Instant::ZERO,
            mode: VehicleMode::Survey,
            rests_on: String::new(),
        }
    }

    #[test]
    fn the_vehicle_would_go_to_the_label_that_is_weighed() {
        let run = task(&[(4, 90)]).run();
        let first = run.aims.first.expect("a target");
        assert_eq!((first.reason, first.label), (LegReason::Label, Some(4)));
        assert!(first.at.0 < 15.0 && (20.0..40.0).contains(&first.along_m), "{first:?}");
        assert!(run.text.contains("go to label 4 (coral)") && run.text.contains("west, in about"), "{}", run.text);
        assert!(run.aims.targets.iter().all(|&(_, _, last)| last < 40) && !run.aims.targets.is_empty());
    }

    #[test]
    fn a_fence_keeps_the_path_inside() {
        let corner = |x, y| DecimetrePoint::new(10 * x, 10 * y);
        let fence = Polygon(vec![corner(20, 0), corner(60, 0), corner(60, 40), corner(20, 40)]);
        let mut task = task(&[(4, 90)]);
        task.orders.fence.fence = Some(fence);
        let run = task.run();
        assert!(run.aims.legs.iter().all(|leg| leg.to.0 >= 20.0), "{:?}", run.aims.legs);
    }

    #[test]
    fn a_destination_goes_before_the_weights() {
        let mut task = task(&[(4, 90)]);
        task.orders.destination = Some(DecimetrePoint::new(500, 350));
        let leg = task.run().aims.legs.swap_remove(0);
        assert_eq!((leg.reason, leg.to), (LegReason::Destination, (50.0, 35.0)));
    }

    #[test]
    fn a_path_over_other_floor_says_what_both_ways_gain() {
        let mut unseen_around = task(&[(4, 20)]);
        unseen_around.utility[1].exploration = 100;
        unseen_around.map = unseen_around.map.iter().filter(|(cell, _)| cell.x < 130 && cell.y < 90).collect();
        unseen_around.from = (30.0, 20.0);
        let text = unseen_around.run().text;
        let gains: Vec<f64> = text.split(" m²").filter_map(|part| part.rsplit_once(' ')?.1.parse().ok()).collect();
        assert!(text.contains("Known floor of label 4 (coral) lies") && gains.len() == 2, "{text}");
        assert!(gains[0] < gains[1], "{text}");
        assert!(!task(&[(4, 90)]).run().text.contains("Known floor"), "it goes there first");
    }

    #[test]
    fn without_anything_to_gain_the_vehicle_would_hold() {
        let task = task(&[(1, -50), (4, -50)]);
        assert!(task.run().text.contains("would hold: nothing of interest is left"));
    }

    #[test]
    fn an_old_place_is_carried_on_along_the_plan() {
        let path = scenecast_protocol::wire::PlannedPath { points: vec![MapPoint::new(10.0, 10.0)], continues: false };
        let waypoint = Some(MapPoint::new(10.0, 0.0));
        let status = VehicleStatus { waypoint, path, ..VehicleStatus::default() };
        assert_eq!([4.0, 14.0, 99.0].map(|m| carried_on(&status, m)), [(4.0, 0.0), (10.0, 4.0), (10.0, 10.0)]);
    }

    #[test]
    fn directions_are_named_clockwise_from_north() {
        let places = [(0.0, 1.0), (1.0, 1.0), (-1.0, -1.1), (-1.0, 0.1)];
        assert_eq!(places.map(|(e, n)| direction(e, n)), ["north", "north-east", "south-west", "west"]);
    }
}
