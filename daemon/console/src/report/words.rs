//! Times, areas, places and orders in words.

use super::areas::ClassArea;
use super::dive::{Dive, DiveVehicle};
use crate::export::TransverseMercator;
use crate::recording::FrameCounts;
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_surface::state::{Origin, VehicleState};
use scenecast_surface::{LabelBook, LogKind, member_in_words, value_in_words};
use serde_json::Value;
use std::collections::BTreeSet;

/// A time span for people, such as "1 h 05 min".
pub(super) fn duration(seconds: f64) -> String {
    let s = seconds.max(0.0).round() as u64;
    match s {
        0..=1 if (0.05..0.95).contains(&seconds) => format!("{seconds:.1} s"),
        0..=119 => format!("{s} s"),
        120..=3599 if s.is_multiple_of(60) => format!("{} min", s / 60),
        120..=3599 => format!("{} min {:02} s", s / 60, s % 60),
        3600..=7199 => format!("{} min", (s + 30) / 60),
        _ => format!("{} h {:02} min", s / 3600, s / 60 % 60),
    }
}

/// The middle one of some values; `None` without any.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// The reason of a mode that no order has led to: without a record of orders a vehicle waits for one.
pub(super) const NO_ORDER: &str = ": no order yet";

/// What the surface logs where a vehicle's program was restarted.
pub(super) const ANOTHER_RUN: &str = "the vehicle begins another run";

/// A label by its number and, where it has one, its name.
pub(super) fn label(book: &LabelBook, label: u8) -> String {
    book.name(label).map_or_else(|| format!("label {label}"), |name| format!("label {label} ({name})"))
}

/// The frames that an end heard and could not use.
pub(super) fn unused(frames: &FrameCounts) -> String {
    let causes = frames.dropped.iter().map(|(reason, count)| match reason.as_str() {
        "duplicate" => counted(*count as usize, "copy of a known frame", "copies of known frames"),
        "checksum" => format!("{count} damaged, of another run or of another mission"),
        "truncated" => format!("{count} cut short"),
        other => format!("{count} refused ({})", other.replace('_', " ")),
    });
    match frames.unused() {
        0 => "none".to_owned(),
        _ => causes.collect::<Vec<_>>().join(", "),
    }
}

/// The kind of an event, in a word that says what it is about.
pub(super) fn kind(source: &str) -> &str {
    if source == LogKind::Record.name() { "annotation" } else { source }
}

/// Who gave an order or made an entry of the log.
pub(super) fn author(name: &str) -> &str {
    // The page without tokens, and `ctl` beside it.
    if name == "local" { "the local user" } else { name }
}

/// The labels that are shown as a class: those with cells, and those that were merged into it.
fn labels_of(state: &VehicleState, vehicle: &DiveVehicle, class: u8) -> BTreeSet<u8> {
    let book = &state.label_book;
    let on_map = vehicle.map.labels.iter().map(|(_, label)| label);
    on_map.chain(book.keys().copied()).filter(|label| book.shown_as(*label) == class).collect()
}

fn cells_of(vehicle: &DiveVehicle, label: u8) -> usize {
    vehicle.map.labels.iter().filter(|(_, of)| *of == label).count()
}

/// These labels with their cells, unless the class is one label alone.
pub(super) fn merged(state: &VehicleState, vehicle: &DiveVehicle, class: u8) -> String {
    let labels: Vec<u8> = labels_of(state, vehicle, class).into_iter().collect();
    let with_cells = |label: &u8| match cells_of(vehicle, *label) {
        0 => format!("label {label}: no cell"),
        cells => format!("label {label}: {}", counted(cells, "cell", "cells")),
    };
    match &labels[..] {
        [only] if *only == class => String::new(),
        [only] => format!(" (label {only})"),
        _ => format!(" ({})", labels.iter().map(with_cells).collect::<Vec<_>>().join(", ")),
    }
}

/// A class by its label and its name, with the labels that people merged into it.
pub(super) fn class(state: &VehicleState, vehicle: &DiveVehicle, class: u8) -> String {
    let others = labels_of(state, vehicle, class).into_iter().filter(|label| *label != class);
    let others: Vec<String> = others.map(|other| label(&state.label_book, other)).collect();
    let own = label(&state.label_book, class);
    if others.is_empty() {
        return own;
    }
    let empty = if cells_of(vehicle, class) == 0 { "which has no cell of its own and " } else { "" };
    format!("{own}, {empty}into which people merged {},", others.join(" and "))
}

/// An event with reasons of modes in words, and labels with their names.
pub(super) fn event(book: &LabelBook, Event { source, text, .. }: &Event) -> String {
    let reasons = [
        (": distance", ": the distance allowed since its limits were ordered, return path included, was used up"),
        (": time", ": the time allowed since its limits were ordered, return path included, was used up"),
        (": silence", ": the surface was silent for longer than allowed"),
        (": fence", ": it was outside of the fence or in an area to stay out of"),
        (": depth or altitude", ": it was outside of its limits of depth or altitude"),
        (": no path", ": no path to its goals was allowed"),
        (": order", ": by order"),
        (NO_ORDER, ": it waited for an order to resume"),
        ("holding", ": its plan was at its end, or nothing of interest was left"),
        ("done", ": its survey, or the recording that was played back, had ended"),
    ];
    let in_words = |(short, long): &(&str, &str)| match text.strip_suffix(short)? {
        "" => Some(format!("{short}{long}")),
        mode => Some(format!("{mode}{long}")),
    };
    let reason = if source.starts_with("mode") { reasons.iter().find_map(in_words) } else { None };
    let text = match (source.as_str(), text.as_str()) {
        ("contact", ANOTHER_RUN) => "the vehicle's program had been restarted".to_owned(),
        ("contact", "received") => "the surface heard it".to_owned(),
        // For how long, and what an operator could do then, is no part of a report.
        ("refused", text) if text.contains(" has had command for ") => {
            format!("{} had command", text.split(" has had command for ").next().unwrap_or_default())
        }
        ("answer", text) => text.split_once(' ').map_or_else(
            || text.to_owned(),
            |(slot, what)| {
                // No table has the versions.
                let what = what.strip_prefix("version ").and_then(|rest| Some(rest.split_once(' ')?.1)).unwrap_or(what);
                format!("{} {what}", order(slot, slot))
            },
        ),
        (_, text) => reason.unwrap_or_else(|| match text.strip_prefix("local: ") {
            Some(done) => format!("{}: {done}", author("local")),
            None => text.to_owned(),
        }),
    };
    let mut parts = text.split("label ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |told, part| {
        let digits = part.bytes().take_while(u8::is_ascii_digit).count();
        let is_named = part[digits..].starts_with(" (") || part[digits..].starts_with(": name");
        let known = part[..digits].parse().ok().filter(|_| !is_named).map(|number| label(book, number));
        format!("{told}{}{}", known.unwrap_or_else(|| format!("label {}", &part[..digits])), &part[digits..])
    })
}

/// An area for people, with three digits.
pub(super) fn area(m2: f64) -> String {
    if m2 >= 1e6 {
        format!("{:.2} km²", m2 / 1e6)
    } else {
        format!("{m2:.prec$} m²", prec = if m2 < 100.0 { 1 } else { 0 })
    }
}

/// A class of traffic: what its bytes carry.
pub(super) fn traffic(class: &str) -> &str {
    match class {
        "directive" => "orders",
        "exemplar" => "images",
        "fix" => "position fixes",
        other => other,
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
        |number: &Value| number.as_u64().and_then(|number| u8::try_from(number).ok()).map(|number| label(book, number));
    let member = |(name, value): (&String, &Value)| match (name.as_str(), value) {
        (_, Value::Null) => None,
        ("curiosity" | "exploration", weight) if weight.as_f64() == Some(0.0) => None,
        ("exploration", weight) => Some(format!("weight of unexplored sea floor {weight}")),
        ("curiosity", weight) => Some(format!("weight of unusual places {weight}")),
        ("weights", Value::Object(weights)) if weights.is_empty() => Some("no weights of labels".to_owned()),
        ("weights", Value::Object(weights)) => {
            let weight = |(number, weight): (&String, &Value)| {
                format!("{}: {weight}", number.parse().map_or_else(|_| number.clone(), |number| label(book, number)))
            };
            Some(format!("weights: {}", weights.iter().map(weight).collect::<Vec<_>>().join(", ")))
        }
        ("labels", Value::Array(labels)) => {
            Some(format!("images of {}", labels.iter().filter_map(title).collect::<Vec<_>>().join(", ")))
        }
        ("shares", Value::Object(shares)) => {
            let share = |(class, percent): (&String, &Value)| format!("{} {percent} %", traffic(class));
            Some(format!("shares: {}", shares.iter().map(share).collect::<Vec<_>>().join(", ")))
        }
        ("place" | "return_point", Value::Array(at)) => Some(format!(
            "{} {}",
            name.replace('_', " "),
            at.first().zip(at.get(1)).map_or_else(String::new, east_north)
        )),
        ("fence", Value::Array(corners)) => Some(format!("a fence with {}", outline(corners))),
        ("keep_outs", Value::Array(outlines)) if outlines.is_empty() => Some("no area to stay out of".to_owned()),
        ("keep_outs", Value::Array(outlines)) => {
            let corners = |area: &Value| area.as_array().map(|corners| outline(corners)).unwrap_or_default();
            Some(format!(
                "{} ({})",
                counted(outlines.len(), "area to stay out of", "areas to stay out of"),
                outlines.iter().map(corners).collect::<Vec<_>>().join("; ")
            ))
        }
        ("areas", Value::Array(areas)) => {
            let corners = |area: &Value| area["outline"].as_array().map(|corners| outline(corners)).unwrap_or_default();
            let told = |area: &Value| format!("weight {} ({})", value_in_words(&area["weight"]), corners(area));
            let all: Vec<String> = areas.iter().map(told).collect();
            if all.is_empty() {
                return Some("no weighted areas any more".to_owned());
            }
            Some(format!("{}: {}", counted(areas.len(), "area", "areas"), all.join("; ")))
        }
        ("background", Value::Array(streams)) => Some(format!(
            "spare capacity for {}",
            streams
                .iter()
                .filter_map(Value::as_str)
                .map(|stream| match stream {
                    "finer" => "the cells between those of a coarse map",
                    "exemplars" => "images of labels",
                    "floor" => "images of the sea floor",
                    layer => layer,
                })
                .collect::<Vec<_>>()
                .join(", ")
        )),
        ("labels", count) => Some(format!("at most {count} labels")),
        _ => Some(limit(name, value)),
    };
    let mut all: Vec<_> = members.iter().collect();
    // What a budget has to spare comes last.
    all.sort_by_key(|(name, _)| *name == "background");
    let all: Vec<String> = all.into_iter().filter_map(member).collect();
    if all.is_empty() { "withdrawn".to_owned() } else { all.join("; ") }
}

/// The count with its noun: `one` where it is 1, otherwise `several`.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// The corners of a closed line, metres east and north.
fn outline(corners: &[Value]) -> String {
    let is_closed = corners.len() > 1 && corners.first() == corners.last();
    let corners = &corners[..corners.len() - usize::from(is_closed)];
    let place = |corner: &Value| format!("({}, {})", value_in_words(&corner[0]), value_in_words(&corner[1]));
    let places: Vec<String> = corners.iter().map(place).collect();
    format!("{} in m east and north: {}", counted(corners.len(), "corner", "corners"), places.join(" "))
}

/// A place in the world frame.
fn east_north((east, north): (&Value, &Value)) -> String {
    format!("{} m east, {} m north", value_in_words(east), value_in_words(north))
}

/// Metres east of the mission's origin in words; below 0 they are west of it.
pub(super) fn east(m: f64) -> String {
    format!("{:.1} m {}", m.abs(), if m < 0.0 { "west" } else { "east" })
}

/// The same to the north.
pub(super) fn north(m: f64) -> String {
    format!("{:.1} m {}", m.abs(), if m < 0.0 { "south" } else { "north" })
}

/// A limit that an order sets, as in "depth 5 to 30 m".
fn limit(name: &str, value: &Value) -> String {
    // The vehicle counts both from the moment at which it takes the limits.
    let since = if ["distance_m", "time_s"].contains(&name) { " since this order" } else { "" };
    member_in_words(name, value) + since
}

/// A length or the range of two, one figure where both are the same for people.
pub(super) fn metres(least_m: f64, most_m: f64) -> String {
    let [least, most] = [least_m, most_m].map(|m| format!("{m:.1}"));
    if least == most { format!("{least} m") } else { format!("{least} to {most} m") }
}

/// The ends of an interval of areas for people.
pub(super) fn interval(interval_m2: Option<(f64, f64)>) -> String {
    interval_m2.map_or("not known".to_owned(), |(low, high)| format!("{} to {}", area(low), area(high)))
}

/// How the intervals of areas were made.
pub(super) fn of_intervals(classes: &[ClassArea]) -> &'static str {
    match classes.iter().any(|class| class.interval_m2.is_some()) {
        true => {
            "A class is a label of the scene model, with the labels that people merged into it: a group that the model found without being \
             taught, and that no person has verified. The intervals come from the \
             model's own confidence in each cell, which comes in steps of a quarter and is taken as the probability that the cell's label is right. A \
             label that is wrong is taken to be one of the others, in proportion to their areas. Squares of 4 x 4 cells are taken to be right \
             or wrong as a whole. Where no confidence arrived, all is taken to be possible. The intervals do not include the error of positions, \
             sea floor that nobody has seen, or classes that the model does not tell apart."
        }
        false => {
            "A class is a label of the scene model, with the labels that people merged into it: a group that the model found without being \
             taught, and that no person has verified. The surface has received no \
             confidence, so the intervals are not known."
        }
    }
}

/// When an image was taken, in UTC; `None` where that is not known.
pub(super) fn taken(image: &Exemplar) -> Option<String> {
    Some(image.taken.nanos()).filter(|nanos| *nanos != 0).map(|nanos| utc_text((nanos as f64 / 1e9).round()))
}

/// What an order of a slot is called; `content` says what it orders.
pub(super) fn order<'a>(slot: &'a str, content: &'a str) -> &'a str {
    match slot {
        "constraints" => content,
        "requests" => "images",
        "utility" => "weights",
        "destination" => "go to",
        other => other,
    }
}

/// The name of an order's status.
pub(super) fn status(status: u8) -> &'static str {
    match status {
        OrderStatus::QUEUED => "queued, not sent",
        OrderStatus::ON_AIR => "sent, not known to have arrived",
        OrderStatus::RECEIVED => "received",
        OrderStatus::APPLIED => "applied",
        OrderStatus::REFUSED => "refused",
        _ => "withdrawn",
    }
}

/// A place as latitude and longitude in brackets; empty without an origin.
pub(super) fn on_earth(dive: &Dive, (east_m, north_m): (f64, f64)) -> String {
    dive.state.mission.origin.map_or_else(String::new, |origin| {
        let (lat, lon) = lat_lon(origin, east_m, north_m);
        format!(" (latitude {lat:.6}, longitude {lon:.6})")
    })
}

/// The origin of a mission on the globe.
pub(super) fn origin(origin: Origin) -> String {
    format!("latitude {:.6}, longitude {:.6} (WGS 84)", origin.lat_deg, origin.lon_deg)
}

pub(super) fn lat_lon(origin: Origin, east_m: f64, north_m: f64) -> (f64, f64) {
    let (lon, lat) = TransverseMercator::about(origin).lon_lat(east_m, north_m);
    (lat, (lon + 180.0).rem_euclid(360.0) - 180.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_told_in_words() {
        let order = |content: &str| Order { principal: "ann".into(), content: content.into(), ..Order::default() };
        let told = |text: &str| content(&LabelBook::default(), &order(text));
        let weights = r#"{"weights": {"3": 0.5, "7": -1.0}, "exploration": 0.1}"#;
        assert_eq!(told(weights), "weight of unexplored sea floor 0.1; weights: label 3: 0.5, label 7: -1.0");
        assert_eq!(told(r#"{"labels": [4]}"#), "images of label 4");
        assert_eq!(told(r#"{"place": [46.5, -28]}"#), "place 46.5 m east, -28 m north");
        let fence = r#"{"fence": [[0, 0], [9.5, 0], [9, 9], [0, 0]], "keep_outs": [[[1, 1], [2, 1], [2, 2]]]}"#;
        let words = "a fence with 3 corners in m east and north: (0, 0) (9.5, 0) (9, 9); 1 area to stay out of (3 corners in m east and north: (1, 1) (2, 1) (2, 2))";
        assert_eq!(told(fence), words, "a closed line repeats its first corner");
        let areas = r#"{"areas": [{"outline": [[0, 0], [2, 0], [2, 2]], "weight": 0.5}]}"#;
        assert_eq!(told(areas), "1 area: weight 0.5 (3 corners in m east and north: (0, 0) (2, 0) (2, 2))");
        let limits = r#"{"depth_m": [5.0, 30.5], "on_silence": "return", "silence_s": 300.0, "time_s": null}"#;
        assert_eq!(told(limits), "depth 5 to 30.5 m; on silence return; silence 300 s");
        let budget = r#"{"bits_per_s": 900, "shares": {"directive": 10, "exemplar": 15, "fix": 5}}"#;
        assert!(told(budget).ends_with("shares: orders 10 %, images 15 %, position fixes 5 %"), "{}", told(budget));
        let stops = |content: &str| Order { slot: "constraints".into(), ..order(content) };
        let told = |text: &str| content(&LabelBook::default(), &stops(text));
        assert_eq!(told(r#"{"hold": true, "abort": false}"#), "hold");
        assert_eq!(told(r#"{"hold": false, "abort": false}"#), "resume");
    }

    #[test]
    fn events_have_reasons_of_modes_in_words_and_names_of_labels() {
        let mut book = LabelBook::default();
        book.entry(3).or_default().name = Some("coral".into());
        let told = |source: &str, text: &str| {
            event(&book, &Event { source: source.into(), text: text.into(), ..Event::default() })
        };
        assert_eq!(told("mode", "holding: order"), "holding: by order");
        assert_eq!(told("record", "anna: note: order"), "anna: note: order");
        assert_eq!(told("image", "image of label 3"), "image of label 3 (coral)");
        assert_eq!(
            told("order", "weights: label 3 +0.50, label 4 -1.00"),
            "weights: label 3 (coral) +0.50, label 4 -1.00"
        );
        assert_eq!(told("record", "label 3: name coral"), "label 3: name coral");
        assert_eq!(told("answer", "utility version 2 applied"), "weights applied");
        let refused = "bob: hold: not sent: anna has had command for 5 s: request it, or take it after 1 min";
        assert_eq!(told("refused", refused), "bob: hold: not sent: anna had command");
    }

    #[test]
    fn spans_areas_and_places_are_for_people() {
        assert_eq!((east(-23.58), north(13.0)), ("23.6 m west".to_owned(), "13.0 m north".to_owned()));
        assert_eq!([0.25, 59.6, 130.0].map(duration), ["0.2 s", "60 s", "2 min 10 s"]);
        assert_eq!([640.0, 750.0, 720.0, 7265.0].map(duration), ["10 min 40 s", "12 min 30 s", "12 min", "2 h 01 min"]);
        assert_eq!([3.0625, 415.2, 2.5e6].map(area), ["3.1 m²", "415 m²", "2.50 km²"]);
    }
}
