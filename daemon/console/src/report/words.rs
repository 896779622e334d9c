//! The summary of a dive in sentences.

use super::areas::ClassArea;
use super::dive::{Dive, DiveVehicle, OrderStep};
use crate::export::TransverseMercator;
use crate::state::{LinkDirection, Origin, VehicleState};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_surface::LabelBook;
use serde_json::Value;
use std::collections::BTreeSet;

/// Time without a frame from which on it is a silence, seconds.
const SILENCE_S: f64 = 60.0;

/// A time span for people, such as "1 h 05 min".
pub(super) fn duration(seconds: f64) -> String {
    let s = seconds.max(0.0).round() as u64;
    match s {
        0..=119 => format!("{s} s"),
        120..=7199 => format!("{} min", (s + 30) / 60),
        _ => format!("{} h {:02} min", s / 3600, s / 60 % 60),
    }
}

/// An area for people, with three digits.
pub(super) fn area(m2: f64) -> String {
    if m2 >= 1e6 {
        format!("{:.2} km²", m2 / 1e6)
    } else {
        format!("{m2:.prec$} m²", prec = if m2 < 100.0 { 1 } else { 0 })
    }
}

/// The content of an order.
pub(super) fn content(book: &LabelBook, order: &Order) -> String {
    let Ok(Value::Object(members)) = serde_json::from_str(&order.content) else { return order.content.clone() };
    if order.slot == SlotId::Constraints.name() {
        let is_set = |name: &str| members.get(name).and_then(Value::as_bool).unwrap_or_default();
        return if is_set("abort") {
            "abort"
        } else if is_set("hold") {
            "hold"
        } else {
            "resume"
        }
        .to_owned();
    }
    let title =
        |label: &Value| label.as_u64().and_then(|label| u8::try_from(label).ok()).map(|label| book.title(label));
    let member = |(name, value): (&String, &Value)| match (name.as_str(), value) {
        (_, Value::Null) => None,
        ("weights", Value::Object(weights)) => {
            let weight = |(label, weight): (&String, &Value)| {
                format!("{}: {weight}", label.parse().map_or_else(|_| label.clone(), |label| book.title(label)))
            };
            Some(format!("weights: {}", weights.iter().map(weight).collect::<Vec<_>>().join(", ")))
        }
        ("labels", Value::Array(labels)) => {
            Some(format!("images of {}", labels.iter().filter_map(title).collect::<Vec<_>>().join(", ")))
        }
        ("shares", Value::Object(shares)) => {
            let share = |(class, percent): (&String, &Value)| format!("{class} {percent} %");
            Some(format!("shares: {}", shares.iter().map(share).collect::<Vec<_>>().join(", ")))
        }
        ("place" | "return_point", Value::Array(at)) => Some(format!(
            "{} {}",
            name.replace('_', " "),
            at.first().zip(at.get(1)).map_or_else(String::new, east_north)
        )),
        ("fence", Value::Array(corners)) => Some(format!("a fence with {} corners", corners.len())),
        ("keep_outs", Value::Array(outlines)) => Some(format!("{} areas to stay out of", outlines.len())),
        ("areas", Value::Array(areas)) => {
            let weights: Vec<String> = areas.iter().map(|area| number(&area["weight"])).collect();
            Some(format!("{} weighted areas, of weights {}", areas.len(), weights.join(", ")))
        }
        ("background", Value::Array(streams)) => Some(format!(
            "spare capacity for {}",
            streams.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(", ")
        )),
        _ => Some(limit(name, value)),
    };
    let all: Vec<String> = members.iter().filter_map(member).collect();
    if all.is_empty() { "nothing, so that what was ordered before ends".to_owned() } else { all.join("; ") }
}

/// A place in the world frame.
fn east_north((east, north): (&Value, &Value)) -> String {
    format!("{} m east, {} m north", number(east), number(north))
}

/// A member of an order with its unit, as in "depth 5 to 30 m".
fn limit(name: &str, value: &Value) -> String {
    let units = [("_bps", "bit/s"), ("_m", "m"), ("_s", "s")];
    let unit = units.into_iter().find_map(|(end, unit)| Some((name.strip_suffix(end)?, unit)));
    let (name, unit) = unit.map_or((name, String::new()), |(name, unit)| (name, format!(" {unit}")));
    let said = match value {
        Value::Array(ends) if ends.len() == 2 && ends.iter().all(Value::is_number) => {
            format!("{} to {}", number(&ends[0]), number(&ends[1]))
        }
        Value::String(text) => text.clone(),
        other => number(other),
    };
    format!("{} {said}{unit}", name.replace('_', " "))
}

/// A number without a fraction of 0.
fn number(value: &Value) -> String {
    value.as_f64().map_or_else(|| value.to_string(), |number| number.to_string())
}

/// The ends of an interval of areas for people.
pub(super) fn interval(interval_m2: Option<(f64, f64)>) -> String {
    interval_m2.map_or("not known".to_owned(), |(low, high)| format!("{} to {}", area(low), area(high)))
}

/// How the intervals of areas were made.
pub(super) fn of_intervals(classes: &[ClassArea]) -> &'static str {
    match classes.iter().any(|class| class.interval_m2.is_some()) {
        true => {
            "An interval is that of the model's own doubt, without the error of positions: its confidence in each cell, which arrives in quarters, is taken as the \
             probability that the label is right; the doubt goes to the other labels by their cells, and cells of a square of 4 x 4 are right or \
             wrong together. A class that the model does not tell from another one, and sea floor that nobody has seen, are not in it."
        }
        false => "The surface has received no confidence, so the intervals are not known.",
    }
}

/// When an image was taken, in UTC; `None` where that is not known.
pub(super) fn taken(image: &Exemplar) -> Option<String> {
    Some(image.taken.nanos()).filter(|nanos| *nanos != 0).map(|nanos| utc_text(nanos as f64 / 1e9))
}

/// The name of an order's status.
pub(super) fn status(status: u8) -> &'static str {
    match status {
        OrderStatus::QUEUED => "queued",
        OrderStatus::ON_AIR => "on air",
        OrderStatus::RECEIVED => "received",
        OrderStatus::APPLIED => "applied",
        OrderStatus::REFUSED => "refused",
        _ => "withdrawn",
    }
}

/// Where, when, how long, how far, what was found, what was ordered and what failed, a sentence each.
pub(super) fn summary(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let mut sentences = Vec::new();
    if dive.settings.simulated {
        sentences.push("This was a rehearsal over a simulated sea floor.".to_owned());
    }
    sentences.push(when(dive, state, vehicle));
    sentences.push(place(dive, vehicle));
    sentences.push(found(state, vehicle));
    sentences.extend(extent(dive, state, vehicle));
    sentences.extend(arrived(state, vehicle));
    sentences.push(orders(dive, state, vehicle));
    let link = &dive.state.link;
    let lost = |direction: &LinkDirection| direction.loss * 100.0;
    sentences.push(format!(
        "Of {} numbered frames from the vehicles {:.1} % arrived in no copy over the whole mission, of {} to them {:.1} %{}.",
        link.up.frames,
        lost(&link.up),
        link.down.frames,
        lost(&link.down),
        if link.up.lost + link.down.lost > 0 { "; what they carried was sent again" } else { "" }
    ));
    if vehicle.sent > 0 && dive.state.vehicles.len() == 1 {
        let [_, received, dropped] = dive.frames;
        sentences.push(format!(
            "By its own record it transmitted {} frames, copies included; the surface heard {}.",
            vehicle.sent,
            received + dropped
        ));
    }
    for (from_s, to_s) in &dive.gaps_s {
        sentences.push(format!("The surface recorded nothing from {} to {}.", utc_text(*from_s), utc_text(*to_s)));
    }
    sentences.extend(silence(vehicle));
    // The first contact begins a run, too.
    let first_run = dive.events.iter().position(|(_, event)| event.text == "another run begins");
    let is_trouble = |(number, (_, event)): &(usize, &(f64, Event))| match event.source.as_str() {
        "fault" => true,
        "mode, on board" => !["Survey", "Done"].iter().any(|mode| event.text.starts_with(mode)),
        "contact" => event.text != "received" && Some(*number) != first_run,
        _ => false,
    };
    sentences.push(match dive.events.iter().enumerate().filter(is_trouble).count() {
        0 => "No fault and no silence was reported.".to_owned(),
        1 => "One event is about a fault, a silence, a new run or a mode other than the survey; it is listed below."
            .to_owned(),
        n => format!(
            "{n} events are about faults, silences, new runs or modes other than the survey; they are listed below."
        ),
    });
    if let Some(damage) = &dive.damage {
        sentences.push(format!("A part of the record could not be read: {damage}."));
    }
    sentences
}

/// The longest time without a frame from the vehicle, if people would call it a silence.
fn silence(vehicle: &DiveVehicle) -> Option<String> {
    let gap = |pair: &[f64]| if let [a, b] = pair { (b - a, *b) } else { (0.0, 0.0) };
    let (longest_s, until_s) = vehicle.heard_s.windows(2).map(gap).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (longest_s >= SILENCE_S).then(|| {
        format!("The longest time without a frame from it was {}, until {}.", duration(longest_s), utc_text(until_s))
    })
}

fn when(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let (begin, end) = dive.span_s;
    let is_faster = (dive.state.mission.speed - 1.0).abs() > 0.01;
    let speed = match is_faster {
        true => format!(", which was {} of the mission, rehearsed faster than the clock", duration(dive.state.now_s)),
        false => String::new(),
    };
    format!(
        "{} (address {}) was recorded from {} to {} (UTC), {} long{speed}, and reported its place {} times.",
        state.name,
        state.id,
        utc_text(begin),
        utc_text(end),
        duration(end - begin),
        vehicle.track.len()
    )
}

/// A place as latitude and longitude, with a comma before; empty without an origin.
pub(super) fn on_earth(dive: &Dive, (east_m, north_m): (f64, f64)) -> String {
    dive.state.mission.origin.map_or_else(String::new, |origin| {
        let (lat, lon) = lat_lon(origin, east_m, north_m);
        format!(", {lat:.6}, {lon:.6}")
    })
}

pub(super) fn lat_lon(origin: Origin, east_m: f64, north_m: f64) -> (f64, f64) {
    let (lon, lat) = TransverseMercator::about(origin).lon_lat(east_m, north_m);
    (lat, (lon + 180.0).rem_euclid(360.0) - 180.0)
}

/// Where the map lies.
fn extent(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let bounds = vehicle.labels.bounds()?;
    let (shift, cell_m) = (state.map.shift_m(), vehicle.cell_m);
    let (west, south) = (f64::from(bounds.x) * cell_m + shift.0, f64::from(bounds.y) * cell_m + shift.1);
    let (east, north) = (west + f64::from(bounds.width) * cell_m, south + f64::from(bounds.height) * cell_m);
    let on_earth = dive.state.mission.origin.map_or_else(String::new, |origin| {
        let [(south, west), (north, east)] = [(west, south), (east, north)].map(|(x, y)| lat_lon(origin, x, y));
        format!(", or from latitude {south:.6} to {north:.6} and from longitude {west:.6} to {east:.6}")
    });
    Some(format!("It reaches from {west:.1} to {east:.1} m east and from {south:.1} to {north:.1} m north{on_earth}."))
}

/// How much of the vehicle's map has arrived.
fn arrived(state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let reported = u64::from(state.status.as_ref()?.cells);
    let held = vehicle.labels.explored() as u64;
    let share = (held as f64 / reported.max(1) as f64 * 100.0).min(100.0);
    (reported > 0).then(|| {
        format!("In its last report the vehicle had {reported} cells; {held} have arrived by the end, {share:.0} %.")
    })
}

fn place(dive: &Dive, vehicle: &DiveVehicle) -> String {
    let Some(last) = vehicle.track.last() else { return "It never reported a place.".to_owned() };
    let depths = || vehicle.track.iter().map(|point| point.depth_m);
    let (least, most) = (depths().fold(f64::INFINITY, f64::min), depths().fold(f64::NEG_INFINITY, f64::max));
    let origin = dive.state.mission.origin.map_or_else(
        || "the mission has no origin on the globe".to_owned(),
        |origin| format!("the origin is at latitude {:.6}, longitude {:.6} (WGS 84)", origin.lat_deg, origin.lon_deg),
    );
    let begin = vehicle.track.first().map_or_else(String::new, |first| {
        format!(
            " from {:.1} m east and {:.1} m north{}",
            first.east_m,
            first.north_m,
            on_earth(dive, (first.east_m, first.north_m))
        )
    });
    format!(
        "By its {} {:.0} m{begin}, at depths of {least:.1} to {most:.1} m below the surface; at the end it was {:.1} m east and {:.1} m north of the \
         origin, with a standard deviation of {:.1} m; {origin}.",
        if vehicle.own_track.len() > 1 { "own record it went" } else { "reports it went at least" },
        vehicle.distance_m(),
        last.east_m,
        last.north_m,
        last.sigma_m
    )
}

fn found(state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let all: u64 = vehicle.classes.iter().map(|class| class.cells).sum();
    let Some(largest) = vehicle.classes.first() else { return "No part of the map arrived.".to_owned() };
    let doubt = largest.interval_m2.map_or_else(String::new, |_| {
        format!("; by the model's own doubt it has {}, with a probability of 95 %", interval(largest.interval_m2))
    });
    format!(
        "The map that arrived has {all} cells of {0:.2} m x {0:.2} m, {1}, with {2} classes; the largest is {3} with {4} ({5:.0} %){doubt}.",
        vehicle.cell_m,
        area(all as f64 * vehicle.cell_m * vehicle.cell_m),
        vehicle.classes.len(),
        state.label_book.title(largest.label),
        area(largest.area_m2),
        largest.cells as f64 / all as f64 * 100.0
    )
}

fn orders(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let ends = |status: u8| {
        let is_end = |way: &[OrderStep]| way.last().is_some_and(|last| last.status == status);
        vehicle.orders_of_people().filter(|(_, way)| is_end(way)).count()
    };
    let all = vehicle.orders_of_people().count();
    let fixes = vehicle.orders.len() - all;
    let authors: BTreeSet<String> =
        vehicle.orders_of_people().map(|(order, _)| dive.ordered(state, vehicle, order).0).collect();
    let authors: Vec<String> = authors.into_iter().filter(|author| !author.is_empty()).collect();
    let authors = if authors.is_empty() { String::new() } else { format!(" by {}", authors.join(", ")) };
    let fixes = if fixes == 0 { String::new() } else { format!(" The surface sent {fixes} position fixes.") };
    match all {
        0 => format!("No order was given.{fixes}"),
        n => format!(
            "{n} orders were given{authors}; of these {} were applied, {} refused and {} withdrawn.{fixes}",
            ends(OrderStatus::APPLIED),
            ends(OrderStatus::REFUSED),
            ends(OrderStatus::WITHDRAWN)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_told_in_words() {
        let order = |content: &str| Order { principal: "ann".into(), content: content.into(), ..Order::default() };
        let told = |text: &str| content(&LabelBook::default(), &order(text));
        let weights = r#"{"weights": {"3": 0.5, "7": -1.0}, "exploration": 0.1}"#;
        assert_eq!(told(weights), "exploration 0.1; weights: label 3: 0.5, label 7: -1.0");
        assert_eq!(told(r#"{"labels": [4]}"#), "images of label 4");
        assert_eq!(told(r#"{"place": [46.5, -28]}"#), "place 46.5 m east, -28 m north");
        assert_eq!(told(r#"{"areas": [{"outline": [], "weight": 0.5}]}"#), "1 weighted areas, of weights 0.5");
        let limits = r#"{"depth_m": [5.0, 30.5], "on_silence": "return", "silence_s": 300.0, "time_s": null}"#;
        assert_eq!(told(limits), "depth 5 to 30.5 m; on silence return; silence 300 s");
        let stops = |content: &str| Order { slot: "constraints".into(), ..order(content) };
        let told = |text: &str| content(&LabelBook::default(), &stops(text));
        assert_eq!(told(r#"{"hold": true, "abort": false}"#), "hold");
        assert_eq!(told(r#"{"hold": false, "abort": false}"#), "resume");
    }

    #[test]
    fn spans_and_areas_are_for_people() {
        assert_eq!([59.6, 130.0, 7265.0].map(duration), ["60 s", "2 min", "2 h 01 min"]);
        assert_eq!([3.0625, 415.2, 2.5e6].map(area), ["3.1 m²", "415 m²", "2.50 km²"]);
    }
}
