//! What came of the orders about the way of a vehicle, by its path while they were in force.

use super::dive::{Dive, DiveVehicle};
use super::order_step::OrderKey;
use super::track_point::TrackPoint;
use super::trouble::is_because;
use super::{Escaped, words};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::{Event, OrderStatus};
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Fence, Polygon, SlotId, WeightedArea};
use scenecast_protocol::wire::{ModeReason, VehicleMode};
use scenecast_surface::state::VehicleState;
use scenecast_surface::{AreasOrder, DestinationOrder, FenceOrder};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Farther from its place, a vehicle has not arrived there, metres.
const ARRIVED_M: f64 = 3.0;
/// A vehicle that holds stays within this distance, metres.
const STANDS_M: f64 = 2.0;

/// What an order asks of the way of a vehicle.
enum Aim {
    /// To be over the sea floor of the first labels, and not over that of the others.
    Labels(BTreeSet<u8>, BTreeSet<u8>),
    /// To be in the first areas, and not in the others.
    Areas(Vec<Polygon>, Vec<Polygon>),
    /// To go to a place, metres east and north.
    Place([f64; 2]),
    /// To stay within a fence, and out of areas.
    Fence(Fence),
    /// To stay where it is.
    Hold,
    /// To end the survey.
    Abort,
}

impl Aim {
    /// `None` if the order asks for no way.
    fn of(slot: &str, content: &str) -> Option<Self> {
        let members = || serde_json::from_str::<Value>(content).ok();
        if slot == SlotId::Utility.name() {
            let members = members()?;
            let weights = members.get("weights")?.as_object()?.iter();
            let weights = weights.filter_map(|(label, weight)| Some((label.parse::<u8>().ok()?, weight.as_f64()?)));
            let (mut to, mut from) = (BTreeSet::new(), BTreeSet::new());
            weights.filter(|(_, weight)| *weight != 0.0).for_each(|(label, weight)| {
                if weight > 0.0 { &mut to } else { &mut from }.insert(label);
            });
            return (!to.is_empty() || !from.is_empty()).then_some(Self::Labels(to, from));
        }
        if slot == SlotId::Areas.name() {
            let areas = serde_json::from_str::<AreasOrder>(content).ok()?.read().ok()?.0;
            let (to, from): (Vec<_>, Vec<_>) = areas.into_iter().partition(|area| area.weight > 0);
            let outlines = |areas: Vec<WeightedArea>| areas.into_iter().map(|area| area.outline).collect::<Vec<_>>();
            return (!to.is_empty() || !from.is_empty()).then(|| Self::Areas(outlines(to), outlines(from)));
        }
        if slot == SlotId::Destination.name() {
            return serde_json::from_str::<DestinationOrder>(content).ok()?.place.map(Self::Place);
        }
        if slot == SlotId::Constraints.name() {
            let members = members()?;
            let is_set = |name: &str| members.get(name).and_then(Value::as_bool).unwrap_or_default();
            return match (is_set("abort"), is_set("hold")) {
                (true, _) => Some(Self::Abort),
                (false, is_held) => is_held.then_some(Self::Hold),
            };
        }
        let fence = (slot == SlotId::Fence.name()).then(|| serde_json::from_str::<FenceOrder>(content))?.ok()?;
        fence.read().ok().map(Self::Fence).filter(|_| fence.fence.is_some() || !fence.keep_outs.is_empty())
    }
}

/// A place as fences and areas are tested with it; `None` if it is beyond their range.
fn decimetres(point: &TrackPoint) -> Option<DecimetrePoint> {
    DecimetrePoint::nearest(WorldPoint { east_m: point.east_m, north_m: point.north_m })
}

/// The time that a vehicle was under way in a span, and how much of it at some places; seconds of the clock.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Stay {
    all_s: f64,
    there_s: f64,
    /// When it was there first.
    first_s: Option<f64>,
}

impl Stay {
    fn percent(self) -> String {
        format!("{:.0} %", self.there_s / self.all_s * 100.0)
    }
}

impl DiveVehicle {
    /// Where it was between two moments, while `is_counted`: on straight lines between its places.
    fn stay(
        &self,
        span_s: (f64, f64),
        is_counted: impl Fn(f64) -> bool,
        is_there: impl Fn(&TrackPoint) -> bool,
    ) -> Stay {
        /// Length of the pieces of these lines, metres.
        const PIECE_M: f64 = 0.25;
        let mut stay = Stay::default();
        let steps = self.legs().flat_map(|leg| leg.iter().zip(leg.iter().skip(1)));
        for (from, to) in steps.filter(|(from, to)| to.at_s > from.at_s && to.at_s >= span_s.0 && from.at_s <= span_s.1)
        {
            let pieces = (from.distance_m(to) / PIECE_M).ceil().clamp(1.0, 1000.0) as u32;
            let piece_s = (to.at_s - from.at_s) / f64::from(pieces);
            for n in 0..pieces {
                let point = from.towards(to, (f64::from(n) + 0.5) / f64::from(pieces));
                if (span_s.0..=span_s.1).contains(&point.at_s) && is_counted(point.at_s) {
                    stay.all_s += piece_s;
                    if is_there(&point) {
                        stay.there_s += piece_s;
                        stay.first_s = stay.first_s.or(Some(point.at_s));
                    }
                }
            }
        }
        stay
    }

    /// When orders of a slot were applied, seconds since 1970: on board, or when the surface learned it.
    fn applied(&self, slot: &str) -> Vec<(f64, &OrderKey)> {
        let of_slot = self.orders_of_people().filter(|((of, _), _)| of == slot);
        let applied = of_slot.filter_map(|(order, way)| {
            let step = way.iter().find(|step| step.status == OrderStatus::APPLIED)?;
            Some((self.own.decided_s.get(order).copied().unwrap_or(step.at_s), order))
        });
        let mut applied: Vec<_> = applied.collect();
        applied.sort_by(|a, b| a.0.total_cmp(&b.0));
        applied
    }

    /// When the surface learned that the vehicle goes to no place any more, in a span.
    fn destination_ended_s(&self, (from_s, to_s): (f64, f64)) -> Option<f64> {
        let states = self.goes_to_place.iter().skip_while(|(at_s, goes)| *at_s < from_s || !goes);
        states.take_while(|(at_s, _)| *at_s <= to_s).find(|(_, goes)| !goes).map(|(at_s, _)| *at_s)
    }

    /// The share of the cells of its map that have one of these labels, 0 to 1.
    fn share_of_map(&self, labels: &BTreeSet<u8>) -> f64 {
        let theirs = self.map.labels.iter().filter(|(_, label)| labels.contains(label)).count();
        theirs as f64 / self.map.labels.explored().max(1) as f64
    }
}

/// What came of an order while it was in force.
pub(super) struct Effect<'a> {
    pub(super) order: &'a OrderKey,
    /// Seconds since 1970.
    pub(super) from_s: f64,
    pub(super) to_s: f64,
    /// Where the vehicle was meanwhile, in a clause.
    pub(super) told: String,
}

impl Dive {
    /// What came of each order about the way of the vehicle, the first one first.
    pub(super) fn effects<'a>(&self, state: &VehicleState, vehicle: &'a DiveVehicle) -> Vec<Effect<'a>> {
        let Some(ended_s) = vehicle.path().last().map(|last| last.at_s) else { return Vec::new() };
        let mut effects = Vec::new();
        for slot in [SlotId::Utility, SlotId::Areas, SlotId::Destination, SlotId::Fence, SlotId::Constraints] {
            let applied = vehicle.applied(slot.name());
            let ends =
                applied.iter().skip(1).map(|(at_s, _)| *at_s).chain([f64::INFINITY]).map(|at_s| at_s.min(ended_s));
            let applied_in_time = applied.iter().zip(ends).filter(|((from_s, _), to_s)| from_s < to_s);
            effects.extend(applied_in_time.filter_map(|((from_s, order), to_s)| {
                let aim = Aim::of(slot.name(), &vehicle.given.get(*order)?.content)?;
                // Labels of an earlier map mean something else.
                let is_of_map = !matches!(aim, Aim::Labels(..)) || vehicle.has_one_map();
                let aim = Some(aim).filter(|_| is_of_map)?;
                let way = Way { dive: self, state, vehicle, span_s: (*from_s, to_s) };
                let (told, to_s) = way.effect(&aim)?;
                Some(Effect { order, from_s: *from_s, to_s, told })
            }));
        }
        effects.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        effects
    }

    /// The same as a table.
    pub(super) fn effects_table(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let row = |effect: &Effect<'_>| {
            format!(
                "<tr><td class=\"o\">{}</td><td class=\"t\">{}</td><td class=\"t\">{}</td><td>{}</td></tr>\n",
                Escaped(&self.ordered(state, vehicle, effect.order).1),
                utc_text(effect.from_s),
                utc_text(effect.to_s),
                Escaped(&effect.told)
            )
        };
        let rows: String = self.effects(state, vehicle).iter().map(row).collect();
        if rows.is_empty() {
            return;
        }
        let path = match (vehicle.is_played_back(), vehicle.has_own_path()) {
            (true, _) => "Its path was that of the recording that was played back: no order could change it.",
            (_, true) => "By its own record.",
            (_, false) => {
                "By the places that it reported and straight lines between them, so that shares and times are rough; in force from when the \
                 surface learned it."
            }
        };
        let _ = writeln!(
            page,
            "<h3>What came of these orders</h3>\n<p>{path} Labels are those of the map at the end, each by itself, as the order weighed them, \
             without those that were merged into it. Other orders may have been in force at the same time: one to hold, or to go to a place, \
             takes precedence over weights.</p>\n<table><thead><tr><th>what was ordered</th><th>in force from (UTC)</th><th>to</th>\
             <th>where the vehicle was meanwhile</th></tr></thead>\n{rows}</table>"
        );
    }
}

/// The way of a vehicle while an order was in force.
struct Way<'a> {
    dive: &'a Dive,
    state: &'a VehicleState,
    vehicle: &'a DiveVehicle,
    span_s: (f64, f64),
}

/// A part of the sea floor that an order favours or has avoided.
struct Goal<'a> {
    /// Where that is, such as "over label 3".
    place: String,
    is_favoured: bool,
    /// Its share of the map at the end, where it is one of labels.
    of_map: Option<f64>,
    has: Box<dyn Fn(&TrackPoint) -> bool + 'a>,
}

impl Way<'_> {
    /// What came of an order in a clause, and when it was over; `None` if no place of that time is known.
    fn effect(&self, aim: &Aim) -> Option<(String, f64)> {
        let told = match aim {
            Aim::Labels(to, from) => self.surveyed(&[self.labels(to, true), self.labels(from, false)]),
            Aim::Areas(to, from) => self.surveyed(&[areas(to, true), areas(from, false)]),
            Aim::Place(place) => return self.arrival(*place),
            Aim::Fence(fence) => self.fenced(fence)?,
            Aim::Hold => self.held()?,
            Aim::Abort => self.aborted()?,
        };
        Some((told, self.span_s.1))
    }

    fn labels(&self, labels: &BTreeSet<u8>, is_favoured: bool) -> Option<Goal<'_>> {
        let names: Vec<String> = labels.iter().map(|label| words::label(&self.state.label_book, *label)).collect();
        let of_map = Some(self.vehicle.share_of_map(labels));
        let (shift_m, labels) = (self.state.map.shift_m(), labels.clone());
        let has =
            move |point: &TrackPoint| labels.contains(&self.vehicle.label_at(shift_m, point.east_m, point.north_m));
        let place = format!("over {}", names.join(" or "));
        (!names.is_empty()).then(|| Goal { place, is_favoured, of_map, has: Box::new(has) })
    }

    /// The share of the time in which the vehicle surveyed that it was at each goal, before the order and then.
    fn surveyed(&self, goals: &[Option<Goal<'_>>]) -> String {
        let modes = self.dive.mode_changes(self.state, self.vehicle);
        // A surface alone does not know the first mode.
        let surveys = |at_s: f64| modes.at(at_s).is_none_or(|mode| mode == VehicleMode::Survey.name());
        let told = goals.iter().flatten().map(|goal| {
            let wish = if goal.is_favoured { "favoured" } else { "to be avoided" };
            if goal.of_map == Some(0.0) {
                return format!("{}, {wish}: not known, as the map at the end has none of it", goal.place);
            }
            let [stay, before] = [self.span_s, (f64::NEG_INFINITY, self.span_s.0)]
                .map(|span_s| self.vehicle.stay(span_s, surveys, &goal.has));
            if stay.all_s <= 0.0 {
                return "it did not survey meanwhile, as far as its places tell".to_owned();
            }
            let first = stay.first_s.filter(|_| goal.is_favoured);
            let first = first.map_or_else(String::new, |at_s| match at_s - self.span_s.0 < 1.0 {
                true => ", where it was already".to_owned(),
                false => format!(", first {} after it was applied", self.since(at_s)),
            });
            let before = (before.all_s > 0.0).then(|| format!("before the order: {}", before.percent()));
            let of_map = goal.of_map.as_ref().map(|share| format!("of the map at the end: {:.0} %", share * 100.0));
            let beside: Vec<String> = before.into_iter().chain(of_map).collect();
            let beside = if beside.is_empty() { String::new() } else { format!(" ({})", beside.join("; ")) };
            format!("{}, {wish}: {} of the time in which it surveyed{beside}{first}", goal.place, stay.percent())
        });
        let mut told: Vec<String> = told.collect();
        told.dedup();
        told.join("; ")
    }

    /// The time from the beginning to a moment.
    fn since(&self, at_s: f64) -> String {
        self.dive.lasted((at_s - self.span_s.0).max(0.0))
    }

    /// The places of the time.
    fn places(&self) -> impl Iterator<Item = &TrackPoint> {
        let (from_s, to_s) = self.span_s;
        self.vehicle.path().iter().filter(move |point| (from_s..=to_s).contains(&point.at_s))
    }

    /// Whether it arrived at a place, which ends the order.
    fn arrival(&self, [east_m, north_m]: [f64; 2]) -> Option<(String, f64)> {
        let away = |point: &TrackPoint| (point.east_m - east_m).hypot(point.north_m - north_m);
        let Some(nearest_m) = self.places().map(away).reduce(f64::min) else {
            return Some(("not known: no place of it in that time is".to_owned(), self.span_s.1));
        };
        let arrived_s = self.vehicle.stay(self.span_s, |_| true, |point| away(point) <= ARRIVED_M).first_s;
        if let Some(at_s) = arrived_s {
            let after = self.since(at_s);
            return Some((
                format!("it arrived (to {ARRIVED_M} m) {after} after the order was applied, which ended it"),
                at_s,
            ));
        }
        if let Some(at_s) = self.vehicle.destination_ended_s(self.span_s) {
            let (by, nearest) = (utc_text(at_s), format!("its nearest known place is {nearest_m:.1} m away"));
            return Some((format!("by {by} it had ended the order, as it does where it arrives; {nearest}"), at_s));
        }
        let told = format!("it did not arrive, as far as its places tell; the nearest is {nearest_m:.1} m away");
        Some((told, self.span_s.1))
    }

    fn fenced(&self, fence: &Fence) -> Option<String> {
        let stay =
            self.vehicle.stay(self.span_s, |_| true, |point| decimetres(point).is_some_and(|at| fence.allows(at)));
        let out_s = stay.all_s - stay.there_s;
        let is_breach = |(at_s, event): &(f64, &Event)| {
            (self.span_s.0..=self.span_s.1).contains(at_s) && is_because(&event.text, ModeReason::Fence)
        };
        let breach = self.dive.modes(self.state, self.vehicle).find(is_breach);
        (stay.all_s > 0.0).then(|| match (out_s < 0.05, breach) {
            (true, None) => "where it allows, all the time".to_owned(),
            (true, Some((at_s, _))) => format!(
                "where it allows, at all places that are known, but by {} it reported that it had been where it does not allow",
                utc_text(at_s)
            ),
            (false, _) => format!("where it does not allow, for {} in all", self.dive.lasted(out_s)),
        })
    }

    fn held(&self) -> Option<String> {
        let first = self.places().next()?;
        let farthest_m = self.places().map(|point| first.distance_m(point)).fold(0.0, f64::max);
        let (east, north) = (words::east(first.east_m), words::north(first.north_m));
        let least = if self.vehicle.has_own_path() { "up to" } else { "at least" };
        Some(match farthest_m < STANDS_M {
            true => format!("it stood at {east}, {north}, at most {farthest_m:.1} m from there"),
            false => format!(
                "it did not stand still: it was {least} {farthest_m:.1} m away from {east}, {north}, where it was then"
            ),
        })
    }

    /// Where it was when an abort was replaced, or at the end.
    fn aborted(&self) -> Option<String> {
        let last = self.places().last()?;
        let (east, north) = (words::east(last.east_m), words::north(last.north_m));
        Some(format!("its last place is {east}, {north}, at a depth of {:.1} m", last.depth_m))
    }
}

fn areas(areas: &[Polygon], is_favoured: bool) -> Option<Goal<'_>> {
    let weight = if is_favoured { "positive" } else { "negative" };
    let place = format!("in the {} of {weight} weight", if areas.len() == 1 { "area" } else { "areas" });
    let has = Box::new(move |point: &TrackPoint| {
        decimetres(point).is_some_and(|at| areas.iter().any(|area| area.contains(at)))
    });
    (!areas.is_empty()).then_some(Goal { place, is_favoured, of_map: None, has })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::scenecast_msgs::Order;
    use scenecast_protocol::map::Cell;

    /// What is told of a vehicle that goes a metre a second to the east, over label 1 for ten seconds and over label 2 then.
    fn told(orders: &[(&str, i64, &str)]) -> String {
        told_with(Vec::new(), orders)
    }

    fn told_with(events: Vec<(f64, Event)>, orders: &[(&str, i64, &str)]) -> String {
        let place =
            |n: u32| TrackPoint { at_s: f64::from(n), east_m: f64::from(n), north_m: 0.5, depth_m: 5.0, sigma_m: 0.1 };
        let track = (0..=20).step_by(5).map(place).collect();
        let mut vehicle = DiveVehicle { mission_speed: 1.0, track, ..DiveVehicle::default() };
        vehicle.map.cell_m = 1.0;
        for x in 0..20 {
            vehicle.map.labels.set(Cell::new(x, 0), 1 + u8::from(x >= 10));
        }
        for (version, (slot, at_s, content)) in (1..).zip(orders) {
            let (slot, content) = ((*slot).to_owned(), (*content).to_owned());
            let applied = OrderStatus::APPLIED;
            let mut status = OrderStatus { slot: slot.clone(), version, status: applied, ..OrderStatus::default() };
            status.header.stamp = Time::from_nanos(at_s * 1_000_000_000);
            vehicle.take_order(&status);
            vehicle.given.insert((slot.clone(), version), Order { slot, version, content, ..Order::default() });
        }
        let (mut dive, mut page) = (Dive { events, ..Dive::default() }, String::new());
        dive.state.mission.speed = 1.0;
        dive.effects_table(&mut page, &VehicleState::default(), &vehicle);
        page
    }

    #[test]
    fn weights_are_told_by_the_time_over_each_kind_of_label() {
        let page = told(&[("utility", 5, r#"{"weights": {"2": 0.5, "1": -0.5}}"#)]);
        let favoured = "over label 2, favoured: 67 % of the time in which it surveyed (before the order: 0 %; of the map at the end: 50 %), \
                        first 5 s after it was applied; over label 1, to be avoided: 33 % of the time in which it surveyed (before the order: 100 %; ";
        assert!(page.contains(favoured), "{page}");
        assert_eq!(told(&[("utility", 5, r#"{"exploration": 0.5}"#)]), "", "it favours no label");
    }

    #[test]
    fn areas_are_told_apart_by_their_weights() {
        let area = |west: u32, weight: f64| {
            let east = west + 5;
            format!(r#"{{"outline": [[{west}, -1], [{east}, -1], [{east}, 2], [{west}, 2]], "weight": {weight}}}"#)
        };
        let page = told(&[("areas", 10, &format!(r#"{{"areas": [{}, {}]}}"#, area(15, 0.8), area(0, -0.7)))]);
        assert!(page.contains("in the area of positive weight, favoured: 50 % of"), "{page}");
        assert!(page.contains("in the area of negative weight, to be avoided: 0 % of the time in which it surveyed (before the order: 50 %)"));
    }

    #[test]
    fn a_place_is_told_by_the_arrival_there_which_ends_the_order() {
        let page = told(&[("destination", 2, r#"{"place": [14.5, 0.5]}"#)]);
        assert!(page.contains("00:00:11Z</td><td>it arrived (to 3 m) 10 s after the order was applied"), "{page}");
        let page = told(&[("destination", 2, r#"{"place": [15, 9]}"#)]);
        assert!(page.contains("it did not arrive, as far as its places tell; the nearest is 8.5 m away"), "{page}");
    }

    #[test]
    fn a_fence_is_told_by_the_time_outside_and_a_hold_by_its_place() {
        let fence = |east_m: u32| format!(r#"{{"fence": [[-1, -1], [{east_m}, -1], [{east_m}, 2], [-1, 2]]}}"#);
        assert!(told(&[("fence", 0, &fence(30))]).contains("where it allows, all the time"));
        let mode = |at_s: f64, text: &str| {
            (at_s, Event { source: "mode".to_owned(), text: text.to_owned(), ..Event::default() })
        };
        let page = told_with(vec![mode(9.0, "returning: fence")], &[("fence", 0, &fence(30))]);
        assert!(page.contains("but by 1970-01-01T00:00:09Z it reported that it had been where"), "{page}");
        let page = told(&[("fence", 0, &fence(16))]);
        assert!(page.contains("where it does not allow, for 4 s in all"), "{page}");
        let page = told(&[("constraints", 10, r#"{"hold": true, "abort": false}"#)]);
        assert!(
            page.contains("it did not stand still: it was at least 10.0 m away from 10.0 m east, 0.5 m north"),
            "{page}"
        );
        let page = told(&[("constraints", 20, r#"{"hold": true, "abort": false}"#)]);
        assert!(!page.contains("stood at"), "it was over at once: {page}");
        let page = told(&[("constraints", 10, r#"{"hold": false, "abort": true}"#)]);
        assert!(page.contains("its last place is 20.0 m east, 0.5 m north, at a depth of 5.0 m"), "{page}");
    }
}
