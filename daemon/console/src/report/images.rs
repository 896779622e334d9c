//! The images of a dive, by their classes.

use super::dive::{Dive, DiveVehicle};
use super::{Escaped, chart, unix_s, words};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::Exemplar;
use scenecast_protocol::directive::SlotId;
use scenecast_surface::state::VehicleState;
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Images of a label in the report.
const IMAGES: usize = 3;
/// An image that was taken longer ago than this when it was sent has no time, seconds.
const OLD_IMAGE_S: f64 = 4.0 * 3600.0;

/// The images of the classes, and which have none.
pub(super) fn of_classes(page: &mut String, dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) {
    let images: Vec<(u8, String)> =
        vehicle.map.classes.iter().map(|class| (class.label, images(dive, state, vehicle, class.label))).collect();
    let all: String = images.iter().map(|(_, images)| images.as_str()).collect();
    let bare = images.iter().filter(|(_, images)| images.is_empty());
    let bare = bare.map(|(class, _)| words::label(&state.label_book, *class));
    let bare: Vec<String> = bare.collect();
    if !all.is_empty() {
        let sigma = match all.contains('\u{b1}') {
            true => {
                "<p>\u{b1}: the uncertainty of the vehicle's place on the earth when the image was taken (68 %, east and north each).</p>\n"
            }
            false => "",
        };
        let _ = writeln!(page, "<h3>Images of the classes</h3>\n{sigma}<div class=\"images\">{all}</div>");
    }
    further(page, dive, state, vehicle);
    if !bare.is_empty() {
        let _ = writeln!(page, "<p>Classes of which no image was received: {}.</p>", Escaped(&bare.join(", ")));
    }
    let changed = vehicle.map.classes.iter().filter(|class| {
        let mut of_it = images_of(state, vehicle, class.label).peekable();
        of_it.peek().is_some() && of_it.all(|(_, exemplar)| !vehicle.shows_class(state, exemplar))
    });
    let changed: Vec<String> = changed.map(|class| words::label(&state.label_book, class.label)).collect();
    if !changed.is_empty() {
        let _ = writeln!(
            page,
            "<p>No image shows these as they are at the end, because the places of all their images have another class by then: {}.</p>",
            Escaped(&changed.join(", "))
        );
    }
}

/// The labels that have a name or images, and no cell at the end.
pub(super) fn without_cells(page: &mut String, dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) {
    let book = &state.label_book;
    let has_cells = |label: u8| vehicle.map.classes.iter().any(|class| class.label == book.shown_as(label));
    let named = book.iter().filter(|(_, entry)| entry.name.is_some()).map(|(label, _)| *label);
    let pictured = vehicle.exemplars.iter().map(|(_, exemplar)| exemplar.label);
    let had = vehicle.map.had.iter().copied();
    let never: Vec<String> = named
        .filter(|label| !has_cells(*label) && !vehicle.map.had.contains(label))
        .map(|label| words::label(book, label))
        .collect();
    if !never.is_empty() {
        let _ = writeln!(page, "<p>People named labels that the map never had: {}.</p>", Escaped(&never.join(", ")));
    }
    let labels: BTreeSet<u8> = pictured.chain(had).filter(|label| !has_cells(*label)).collect();
    if labels.is_empty() {
        return;
    }
    let images = vehicle.exemplars.iter().filter(|(_, exemplar)| labels.contains(&exemplar.label));
    let images: String = images.map(|found| image(dive, state, vehicle, found, "")).collect();
    let titles: Vec<String> = labels.iter().map(|label| words::label(book, *label)).collect();
    let _ = writeln!(
        page,
        "<h3>Labels without cells at the end</h3>\n<p>The scene model had these labels for some time; it gave their cells to others: \
         {}.</p>\n<div class=\"images\">{images}</div>",
        Escaped(&titles.join(", "))
    );
}

/// All images of the labels that are shown as a class.
fn images_of<'a>(
    state: &'a VehicleState,
    vehicle: &'a DiveVehicle,
    class: u8,
) -> impl Iterator<Item = &'a (f64, Exemplar)> {
    vehicle.exemplars.iter().filter(move |(_, exemplar)| state.label_book.shown_as(exemplar.label) == class)
}

/// When images of a label were newly asked for, seconds since 1970.
fn asked_s(vehicle: &DiveVehicle, label: u8) -> Vec<f64> {
    let mut asked_s = Vec::new();
    let mut was_asked = false;
    for (order, given) in vehicle.given.iter().filter(|((slot, _), _)| slot == SlotId::Requests.name()) {
        let is_asked = vehicle.labels_of_images(order).is_some_and(|labels| labels.contains(&label.into()));
        asked_s.extend((is_asked && !was_asked).then(|| unix_s(&given.header.stamp)));
        was_asked = is_asked;
    }
    asked_s
}

/// When an image was asked for, taken and received; nobody asked for most.
fn times(dive: &Dive, vehicle: &DiveVehicle, at_s: f64, exemplar: &Exemplar) -> String {
    let utc = |utc: String| format!("<span class=\"t\">{utc}</span>");
    let mission_s = (dive.span_s.1 - dive.span_s.0) * dive.state.mission.speed.max(1.0);
    let taken = match words::taken(exemplar) {
        Some(taken) => format!("taken {}", utc(taken)),
        None if mission_s < OLD_IMAGE_S => "taken in an earlier run of the vehicle's program".to_owned(),
        None => "when it was taken is not known, as that was in an earlier run of the vehicle's program, or more than 4 h before it was sent"
            .to_owned(),
    };
    let asked_s = asked_s(vehicle, exemplar.label).into_iter().filter(|given_s| exemplar.requested && *given_s <= at_s);
    let asked = asked_s.reduce(f64::max).map_or_else(String::new, |s| format!("asked for {}, ", utc(utc_text(s))));
    format!("{asked}{taken}, received {}", utc(utc_text(at_s)))
}

/// Images with the times at which they came in.
type Received<'a> = Vec<&'a (f64, Exemplar)>;

/// The images of a class that are shown, those that people asked for and the largest, by time; and the others.
fn of_class<'a>(state: &'a VehicleState, vehicle: &'a DiveVehicle, class: u8) -> (Received<'a>, Received<'a>) {
    // The label of a place may have changed since its image was sent.
    let shows_it = |exemplar: &Exemplar| vehicle.shows_class(state, exemplar);
    let of_it: Vec<_> = images_of(state, vehicle, class).collect();
    let mut found: Vec<_> = of_it.iter().copied().filter(|(_, exemplar)| shows_it(exemplar)).collect();
    found.sort_by_key(|(_, exemplar)| Reverse((exemplar.requested, exemplar.data.len())));
    // Beside them those that the vehicle sent for the class.
    found.extend(of_it.iter().copied().filter(|(_, exemplar)| !shows_it(exemplar)));
    found.sort_by_key(|(_, exemplar)| !exemplar.requested);
    let others = found.split_off(found.len().min(IMAGES));
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    (found, others)
}

/// The images of the classes that are not shown, as a table.
fn further(page: &mut String, dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) {
    let others = vehicle.map.classes.iter().flat_map(|class| of_class(state, vehicle, class.label).1);
    let row = |(at_s, exemplar): &(f64, Exemplar)| {
        let place = match exemplar.width_m > 0.0 {
            true => format!("{}, {}", words::east(exemplar.middle.x), words::north(exemplar.middle.y)),
            false => String::new(),
        };
        format!(
            "<tr><td>{}</td><td>{place}</td><td>{}</td></tr>\n",
            Escaped(&words::label(&state.label_book, exemplar.label)),
            times(dive, vehicle, *at_s, exemplar)
        )
    };
    let rows: String = others.map(row).collect();
    if !rows.is_empty() {
        let _ = writeln!(
            page,
            "<h3>Further images of the classes, which are not shown</h3>\n<table><thead><tr><th>label</th><th>place</th><th>times (UTC)</th></tr></thead>\n{rows}</table>"
        );
    }
}

/// Images of a class, each with its label, time, place and scale.
fn images(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle, class: u8) -> String {
    let note = |exemplar: &Exemplar| match vehicle.shows_class(state, exemplar) {
        true => "",
        false => "; by the map at the end its place has another class",
    };
    let (shown, _) = of_class(state, vehicle, class);
    shown.into_iter().map(|found| image(dive, state, vehicle, found, note(&found.1))).collect()
}

/// An image with its label, time, place and scale.
fn image(
    dive: &Dive,
    state: &VehicleState,
    vehicle: &DiveVehicle,
    (at_s, exemplar): &(f64, Exemplar),
    note: &str,
) -> String {
    let kind = if exemplar.format == "webp" { "webp" } else { "jpeg" };
    let times = times(dive, vehicle, *at_s, exemplar);
    let (middle, is_placed) = (&exemplar.middle, exemplar.width_m > 0.0);
    let class = state.label_book.shown_as(exemplar.label);
    let own = words::label(&state.label_book, exemplar.label);
    let title = match class == exemplar.label {
        true => own,
        false => format!("{}, shown as {}", own, words::label(&state.label_book, class)),
    };
    let place = || {
        let sigma = vehicle.sigma_m(unix_s(&exemplar.taken)).filter(|_| vehicle.measures_sigma());
        let sigma = sigma.map_or_else(String::new, |m| format!(", \u{b1} {m:.1} m"));
        let on_earth = words::on_earth(dive, (middle.x, middle.y));
        format!("<br>{}, {}{on_earth}{sigma}", words::east(middle.x), words::north(middle.y))
    };
    format!(
        "<figure><img alt=\"label {label}\" src=\"data:image/{kind};base64,{}\">{}<figcaption>{}<br>{times}{}{note}</figcaption></figure>",
        BASE64_STANDARD.encode(&exemplar.data),
        if is_placed { chart::scale_of_image(exemplar.width_m) } else { String::new() },
        Escaped(&title),
        if is_placed { place() } else { String::new() },
        label = exemplar.label
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::scenecast_msgs::Order;

    #[test]
    fn an_image_has_the_times_of_its_way() {
        let mut vehicle = DiveVehicle::default();
        let image = |at_s: f64, taken_s: i64| {
            (at_s, Exemplar { label: 1, taken: Time::from_nanos(taken_s * 1_000_000_000), ..Exemplar::default() })
        };
        vehicle.exemplars = vec![image(20.0, 7), image(40.0, 0), image(50.0, 45)];
        vehicle.exemplars[1].1.requested = true;
        let mut order = Order {
            content: "{\"labels\": [1]}".to_owned(),
            slot: "requests".to_owned(),
            version: 1,
            ..Order::default()
        };
        order.header.stamp = Time::from_nanos(30_000_000_000);
        vehicle.given.insert(("requests".to_owned(), 1), order);
        let mut dive = Dive { span_s: (0.0, 5.0 * 3600.0), ..Dive::default() };
        let told = |dive: &Dive, n: usize| {
            let told = times(dive, &vehicle, vehicle.exemplars[n].0, &vehicle.exemplars[n].1);
            told.replace("<span class=\"t\">", "").replace("</span>", "")
        };
        assert_eq!(told(&dive, 0), "taken 1970-01-01T00:00:07Z, received 1970-01-01T00:00:20Z");
        let told_1 = told(&dive, 1);
        assert!(told_1.starts_with("asked for 1970-01-01T00:00:30Z, when it was taken is not known, as"), "{told_1}");
        dive.span_s.1 = 3600.0;
        assert!(told(&dive, 1).contains("30Z, taken in an earlier run of the vehicle's program, received"));
        assert_eq!(told(&dive, 2), "taken 1970-01-01T00:00:45Z, received 1970-01-01T00:00:50Z");
    }
}
