//! What came of the orders that send a vehicle somewhere, by its path while they were in force.

use super::dive::{Dive, DiveVehicle};
use super::order_step::OrderKey;
use super::track_point::TrackPoint;
use super::{Escaped, words};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::OrderStatus;
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Fence, Polygon, SlotId};
use scenecast_protocol::wire::VehicleMode;
use scenecast_surface::state::VehicleState;
use scenecast_surface::{AreasOrder, DestinationOrder, FenceOrder};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Farther from its place, a vehicle has not arrived there, metres.
const ARRIVED_M: f64 = 3.0;

/// Where an order sends a vehicle.
enum Aim {
    /// To the sea floor of classes, given by the labels that stand for them.
    Classes(BTreeSet<u8>),
    /// Into areas that it weighs more than others.
    Areas(Vec<Polygon>),
    /// To a place, metres east and north.
    Place([f64; 2]),
    /// Not out of a fence, nor into areas to stay out of.
    Fence(Fence),
}

impl Aim {
    /// `None` if the order sends the vehicle nowhere.
    fn of(state: &VehicleState, slot: &str, content: &str) -> Option<Self> {
        if slot == SlotId::Utility.name() {
            let content: Value = serde_json::from_str(content).ok()?;
            let weights = content.get("weights")?.as_object()?.iter();
            let favoured = weights.filter(|(_, weight)| weight.as_f64().is_some_and(|weight| weight > 0.0));
            let labels = favoured.filter_map(|(label, _)| label.parse().ok());
            let classes: BTreeSet<u8> = labels.map(|label| state.label_book.shown_as(label)).collect();
            return (!classes.is_empty()).then_some(Self::Classes(classes));
        }
        if slot == SlotId::Areas.name() {
            let areas = serde_json::from_str::<AreasOrder>(content).ok()?.read().ok()?.0;
            let areas: Vec<Polygon> =
                areas.into_iter().filter(|area| area.weight > 0).map(|area| area.outline).collect();
            return (!areas.is_empty()).then_some(Self::Areas(areas));
        }
        if slot == SlotId::Destination.name() {
            return serde_json::from_str::<DestinationOrder>(content).ok()?.place.map(Self::Place);
        }
        let fence = (slot == SlotId::Fence.name()).then(|| serde_json::from_str::<FenceOrder>(content))?.ok()?;
        fence.read().ok().map(Self::Fence).filter(|_| fence.fence.is_some() || !fence.keep_outs.is_empty())
    }

    /// Whether a place is where the order sends the vehicle.
    fn holds(&self, state: &VehicleState, vehicle: &DiveVehicle, point: &TrackPoint) -> bool {
        let at = DecimetrePoint::nearest(WorldPoint { east_m: point.east_m, north_m: point.north_m });
        let is_in = |area: &Polygon| at.is_some_and(|at| area.contains(at));
        match self {
            Self::Classes(classes) => {
                let label = vehicle.label_at(state.map.shift_m(), point.east_m, point.north_m);
                label != 0 && classes.contains(&state.label_book.shown_as(label))
            }
            Self::Areas(areas) => areas.iter().any(is_in),
            Self::Place([east_m, north_m]) => (point.east_m - east_m).hypot(point.north_m - north_m) <= ARRIVED_M,
            Self::Fence(fence) => fence.fence.as_ref().is_none_or(is_in) && !fence.keep_outs.iter().any(is_in),
        }
    }
}

/// The time that a vehicle was under way in a span, and how much of it where an order sends it; seconds of the clock.
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
    /// Where it was between two moments, while `is_counted`.
    fn stay(
        &self,
        span_s: (f64, f64),
        is_counted: impl Fn(f64) -> bool,
        is_there: impl Fn(&TrackPoint) -> bool,
    ) -> Stay {
        let mut stay = Stay::default();
        let steps = self.legs().flat_map(|leg| leg.iter().zip(leg.iter().skip(1)));
        for (from, to) in
            steps.filter(|(from, to)| from.at_s >= span_s.0 && to.at_s <= span_s.1 && is_counted(from.at_s))
        {
            stay.all_s += to.at_s - from.at_s;
            if is_there(from) {
                stay.there_s += to.at_s - from.at_s;
                stay.first_s = stay.first_s.or(Some(from.at_s));
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
    /// What came of each order that sent the vehicle somewhere, the first one first.
    pub(super) fn effects<'a>(&self, state: &VehicleState, vehicle: &'a DiveVehicle) -> Vec<Effect<'a>> {
        let Some(ended_s) = vehicle.path().last().map(|last| last.at_s) else { return Vec::new() };
        let mut effects = Vec::new();
        for slot in [SlotId::Utility, SlotId::Areas, SlotId::Destination, SlotId::Fence] {
            let applied = vehicle.applied(slot.name());
            let ends = applied.iter().skip(1).map(|(at_s, _)| *at_s).chain([ended_s]);
            effects.extend(applied.iter().zip(ends).filter_map(|((from_s, order), to_s)| {
                let aim = Aim::of(state, slot.name(), &vehicle.given.get(*order)?.content)?;
                let told = self.effect(state, vehicle, &aim, (*from_s, to_s))?;
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
        let _ = writeln!(
            page,
            "<h3>What came of these orders</h3>\n<table><thead><tr><th>what was ordered</th><th>in force from (UTC)</th><th>to</th>\
             <th>where the vehicle was meanwhile</th></tr></thead>\n{rows}</table>\n<p>By the places that are known of it and, for classes, \
             by the map at the end. Other orders may have been in force at the same time; an order to hold, or a place to go to, goes before \
             weights.</p>"
        );
    }

    /// Where the vehicle was while an order was in force, in a clause; `None` if no place of that time is known.
    fn effect(
        &self,
        state: &VehicleState,
        vehicle: &DiveVehicle,
        aim: &Aim,
        (from_s, to_s): (f64, f64),
    ) -> Option<String> {
        let modes: Vec<(f64, bool)> = self
            .modes(state, vehicle)
            .map(|(at_s, event)| (at_s, event.text.split(": ").next() == Some(VehicleMode::Survey.name())))
            .collect();
        // A surface alone does not know the first mode.
        let surveys =
            |at_s: f64| modes.iter().rev().find(|(since_s, _)| *since_s <= at_s).is_none_or(|(_, surveys)| *surveys);
        let there = |point: &TrackPoint| aim.holds(state, vehicle, point);
        let any = |_: f64| true;
        let first = |stay: Stay| stay.first_s.map(|at_s| self.lasted((at_s - from_s).max(0.0)));
        Some(match aim {
            Aim::Classes(_) | Aim::Areas(_) => {
                let stay = vehicle.stay((from_s, to_s), surveys, there);
                let before = vehicle.stay((f64::NEG_INFINITY, from_s), surveys, there);
                let where_ = match aim {
                    Aim::Classes(classes) => {
                        let named = classes.iter().map(|class| words::label(&state.label_book, *class));
                        format!("over {}", named.collect::<Vec<_>>().join(" or "))
                    }
                    _ => "in them".to_owned(),
                };
                if stay.all_s <= 0.0 {
                    return Some("it did not survey meanwhile, as far as its places tell".to_owned());
                }
                let before = (before.all_s > 0.0).then(|| format!("; before the order, for {}", before.percent()));
                let first =
                    first(stay).map_or_else(String::new, |after| format!(", first {after} after it was applied"));
                let of_map = match aim {
                    Aim::Classes(classes) => format!("; {} of the map at the end", share_of_map(vehicle, classes)),
                    _ => String::new(),
                };
                format!(
                    "{where_} for {} of the time in which it surveyed{first}{}{of_map}",
                    stay.percent(),
                    before.unwrap_or_default()
                )
            }
            Aim::Place([east_m, north_m]) => {
                let away = |point: &TrackPoint| (point.east_m - east_m).hypot(point.north_m - north_m);
                let meanwhile = vehicle.path().iter().filter(|point| (from_s..=to_s).contains(&point.at_s));
                let nearest_m = meanwhile.map(away).reduce(f64::min)?;
                let stay = vehicle.stay((from_s, to_s), any, there);
                let arrived = first(stay).map_or_else(
                    || "it did not arrive".to_owned(),
                    |after| format!("it arrived (to {ARRIVED_M} m) {after} after the order was applied"),
                );
                format!("{arrived}; at the nearest it was {nearest_m:.1} m away")
            }
            Aim::Fence(_) => {
                let stay = vehicle.stay((from_s, to_s), any, there);
                let out_s = stay.all_s - stay.there_s;
                match stay.all_s > 0.0 {
                    false => return None,
                    true if out_s <= 0.0 => "where it allows, all the time".to_owned(),
                    true => format!("where it does not allow, for {} in all", self.lasted(out_s)),
                }
            }
        })
    }
}

/// The share of the cells of a map that such classes have.
fn share_of_map(vehicle: &DiveVehicle, classes: &BTreeSet<u8>) -> String {
    let cells = |is_it: &dyn Fn(u8) -> bool| -> u64 {
        vehicle.classes.iter().filter(|class| is_it(class.label)).map(|class| class.cells).sum()
    };
    let (theirs, all) = (cells(&|label| classes.contains(&label)), cells(&|_| true).max(1));
    format!("{:.0} %", theirs as f64 / all as f64 * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::scenecast_msgs::Order;
    use scenecast_protocol::map::Cell;

    /// A vehicle that goes a metre a second to the east, over label 1 for ten seconds and over label 2 then.
    fn dive(orders: &[(&str, i64, &str)]) -> (Dive, DiveVehicle) {
        let place = |n: u32| TrackPoint {
            at_s: f64::from(n),
            east_m: f64::from(n) + 0.5,
            north_m: 0.5,
            depth_m: 5.0,
            sigma_m: 0.1,
        };
        let mut vehicle = DiveVehicle {
            cell_m: 1.0,
            mission_speed: 1.0,
            track: (0..=20).map(place).collect(),
            ..DiveVehicle::default()
        };
        for x in 0..20 {
            vehicle.labels.set(Cell::new(x, 0), 1 + u8::from(x >= 10));
        }
        for (version, (slot, at_s, content)) in (1..).zip(orders) {
            let (slot, content) = ((*slot).to_owned(), (*content).to_owned());
            let mut status = scenecast_messages::scenecast_msgs::OrderStatus {
                slot: slot.clone(),
                version,
                status: OrderStatus::APPLIED,
                ..OrderStatus::default()
            };
            status.header.stamp = Time::from_nanos(at_s * 1_000_000_000);
            vehicle.take_order(&status);
            vehicle.given.insert((slot.clone(), version), Order { slot, version, content, ..Order::default() });
        }
        let mut dive = Dive::default();
        dive.state.mission.speed = 1.0;
        (dive, vehicle)
    }

    fn told(orders: &[(&str, i64, &str)]) -> String {
        let (dive, vehicle) = dive(orders);
        let mut page = String::new();
        dive.effects_table(&mut page, &VehicleState::default(), &vehicle);
        page
    }

    #[test]
    fn weights_are_told_by_the_time_over_the_labels_that_they_favour() {
        let page = told(&[("utility", 5, r#"{"weights": {"2": 0.5, "1": -0.5}}"#)]);
        assert!(
            page.contains("over label 2 for 67 % of the time in which it surveyed, first 5 s after it was applied; before the order, for 0 %"),
            "{page}"
        );
        assert_eq!(told(&[("utility", 5, r#"{"weights": {"1": -0.5}}"#)]), "", "it favours no label");
    }

    #[test]
    fn a_place_is_told_by_the_arrival_there() {
        let page = told(&[("destination", 2, r#"{"place": [14.5, 0.5]}"#), ("destination", 16, r#"{"place": null}"#)]);
        assert!(
            page.contains("it arrived (to 3 m) 9 s after the order was applied; at the nearest it was 0.0 m away"),
            "{page}"
        );
        let page = told(&[("destination", 2, r#"{"place": [14.5, 9]}"#)]);
        assert!(page.contains("it did not arrive; at the nearest it was 8.5 m away"), "{page}");
    }

    #[test]
    fn a_fence_is_told_by_the_time_outside_of_it() {
        let fence = |east_m: u32| format!(r#"{{"fence": [[-1, -1], [{east_m}, -1], [{east_m}, 2], [-1, 2]]}}"#);
        assert!(told(&[("fence", 0, &fence(30))]).contains("where it allows, all the time"));
        let page = told(&[("fence", 0, &fence(16))]);
        assert!(page.contains("where it does not allow, for 4 s in all"), "{page}");
    }
}
