//! The summary of a dive in sentences.

use super::dive::{Dive, DiveVehicle, OrderStep};
use crate::state::VehicleState;
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::OrderStatus;

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
    let mut sentences = vec![when(dive, state, vehicle)];
    sentences.push(place(dive, vehicle));
    sentences.push(found(state, vehicle));
    sentences.push(orders(vehicle));
    let [sent, received, dropped] = dive.frames;
    let loss = state.link.up.loss * 100.0;
    sentences.push(format!(
        "The surface sent {sent} frames, received {received} and could not use {dropped}; of the vehicle's last frames {loss:.0} % were \
         lost."
    ));
    let is_trouble = |source: &str| matches!(source, "fault" | "contact");
    let troubles = dive.events.iter().filter(|(_, event)| is_trouble(&event.source)).count();
    sentences.push(match troubles {
        0 => "No fault and no silence was reported.".to_owned(),
        n => format!("{n} events are about faults, silences or new runs; they are listed below."),
    });
    if let Some(damage) = &dive.damage {
        sentences.push(format!("A part of the record could not be read: {damage}."));
    }
    sentences
}

fn when(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let (begin, end) = dive.span_s;
    format!(
        "{} was recorded from {} to {} (UTC), {} long, and reported its place {} times.",
        state.name,
        utc_text(begin),
        utc_text(end),
        duration(end - begin),
        vehicle.track.len()
    )
}

fn place(dive: &Dive, vehicle: &DiveVehicle) -> String {
    let Some(last) = vehicle.track.last() else { return "It never reported a place.".to_owned() };
    let depths = || vehicle.track.iter().map(|point| point.depth_m);
    let (least, most) = (depths().fold(f64::INFINITY, f64::min), depths().fold(f64::NEG_INFINITY, f64::max));
    let origin = dive.state.mission.origin.map_or_else(
        || "the mission has no origin on the globe".to_owned(),
        |origin| format!("the origin is at latitude {:.6}, longitude {:.6} (WGS 84)", origin.lat_deg, origin.lon_deg),
    );
    format!(
        "By its reports it went {:.0} m at depths of {least:.1} to {most:.1} m; at the end it was {:.1} m east and {:.1} m north of the \
         origin, with a standard deviation of {:.1} m; {origin}.",
        vehicle.distance_m(),
        last.east_m,
        last.north_m,
        last.sigma_m
    )
}

fn found(state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let classes = vehicle.classes(state);
    let all: u64 = classes.iter().map(|(_, cells)| cells).sum();
    let Some(&(largest, cells)) = classes.first() else { return "No part of the map arrived.".to_owned() };
    let square = vehicle.cell_m * vehicle.cell_m;
    format!(
        "The map that arrived has {all} cells of {:.2} m, {}, with {} classes; the largest is {} with {} ({:.0} %).",
        vehicle.cell_m,
        area(all as f64 * square),
        classes.len(),
        state.label_book.title(largest),
        area(cells as f64 * square),
        cells as f64 / all as f64 * 100.0
    )
}

fn orders(vehicle: &DiveVehicle) -> String {
    let ends = |status: u8| {
        let is_end = |way: &[OrderStep]| way.last().is_some_and(|last| last.status == status);
        vehicle.orders_of_people().filter(|(_, way)| is_end(way)).count()
    };
    let all = vehicle.orders_of_people().count();
    let fixes = vehicle.orders.len() - all;
    let fixes = if fixes == 0 { String::new() } else { format!(" The surface sent {fixes} position fixes.") };
    match all {
        0 => format!("No order was given.{fixes}"),
        n => format!(
            "{n} orders were given; of these {} were applied, {} refused and {} withdrawn.{fixes}",
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
    fn spans_and_areas_are_for_people() {
        assert_eq!([59.6, 130.0, 7265.0].map(duration), ["60 s", "2 min", "2 h 01 min"]);
        assert_eq!([3.0625, 415.2, 2.5e6].map(area), ["3.1 m²", "415 m²", "2.50 km²"]);
    }
}
