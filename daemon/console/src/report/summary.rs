//! The summary of a dive in sentences.

use super::dive::{Dive, DiveVehicle, SettingsRecord};
use super::orders::OrderStep;
use super::words::{self, area, counted, duration, interval, lat_lon, on_earth};
use crate::state::{LinkDirection, VehicleState};
use scenecast_core::{Area, fence_of, place_of, utc_text};
use scenecast_messages::contents::valid_part;
use scenecast_messages::scenecast_msgs::{Event, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, Quantity, UNEXPLORED};
use scenecast_protocol::wire::VehicleMode;
use serde_json::Value;
use std::collections::BTreeSet;
use std::ops::RangeInclusive;

/// Time without a frame from which on it is a silence, seconds.
const SILENCE_S: f64 = 60.0;
/// Events that are told in a sentence; of more, the first.
const MAX_TOLD: usize = 8;

/// Where, when, how long, how far, what was found, what was ordered and what failed, a sentence each.
pub(super) fn summary(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let mut sentences = Vec::new();
    if dive.settings.simulated {
        sentences.push("This was a rehearsal over a simulated sea floor.".to_owned());
    }
    if dive.settings.simulated && utc_text(dive.span_s.0).starts_with("2000-01-01") {
        sentences.push("Its dates mean nothing: a rehearsal in virtual time begins on 2000-01-01.".to_owned());
    }
    sentences.push(when(dive, state, vehicle));
    sentences.push(place(dive, vehicle));
    sentences.push(equipment(dive, vehicle));
    sentences.push(found(state, vehicle));
    sentences.extend(extent(dive, state, vehicle));
    sentences.extend(sea_floor(dive, state, vehicle));
    sentences.extend(arrived(dive, state, vehicle));
    sentences.extend(agreement(vehicle));
    sentences.push(orders(dive, state, vehicle));
    sentences.extend(link(dive, vehicle));
    for (from_s, to_s) in &dive.gaps_s {
        sentences.push(format!("The surface recorded nothing from {} to {}.", utc_text(*from_s), utc_text(*to_s)));
    }
    for ended_s in &dive.ended_s {
        sentences.push(format!("The surface ended at {} and was started again.", utc_text(*ended_s)));
    }
    for pair in vehicle.runs_s.windows(2) {
        let [(_, ended_s), (began_s, _)] = pair else { continue };
        sentences.push(format!(
            "The vehicle's program ended at {} and began again at {}.",
            utc_text(*ended_s),
            utc_text(*began_s)
        ));
    }
    let silence = longest_silence(dive, vehicle);
    sentences.push(heard(dive, vehicle, silence));
    sentences.extend(silences(dive, vehicle));
    sentences.push(trouble(dive, state, silence.0));
    if let Some(damage) = &dive.damage {
        sentences.push(format!("Not all of the record could be read: {damage}."));
    }
    sentences
}

/// What became of the frames.
fn link(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let mut sentences = Vec::new();
    let link = &dive.state.link;
    let lost = |direction: &LinkDirection| direction.loss * 100.0;
    sentences.extend(match link.up.lost + link.down.lost {
        // Of the others nobody knows how many there were.
        _ if link.up.frames == 0 => None,
        0 => Some(format!(
            "Of {} numbered frames from the vehicles and {} to them none was lost.",
            link.up.frames, link.down.frames
        )),
        _ => Some(format!(
            "Of {} numbered frames from the vehicles {:.1} % arrived in no copy over the whole mission, of {} to them {:.1} %; what they \
             carried was sent again.",
            link.up.frames,
            lost(&link.up),
            link.down.frames,
            lost(&link.down)
        )),
    });
    if vehicle.sent > 0 && dive.state.vehicles.len() == 1 {
        let [_, received, dropped] = dive.frames;
        sentences.push(format!(
            "By its own record it transmitted {} frames, copies included; the surface heard {}.",
            vehicle.sent,
            received + dropped
        ));
    }
    sentences
}

/// The events that people should look at: faults, silences, new runs, and modes other than the survey.
fn trouble(dive: &Dive, state: &VehicleState, longest_silence_s: f64) -> String {
    let is_planned =
        |text: &str| [VehicleMode::Survey, VehicleMode::Done].iter().any(|mode| text.starts_with(mode.name()));
    let modes = dive.mode_source();
    let is_trouble = |event: &Event| match event.source.as_str() {
        "fault" => true,
        source if source == modes => !is_planned(&event.text),
        "contact" => event.text != "received",
        _ => false,
    };
    let is_of_it = |event: &Event| event.vehicle.is_empty() || valid_part(&event.vehicle) == valid_part(&state.name);
    let found = dive.events.iter().filter(|(_, event)| is_of_it(event) && is_trouble(event));
    let told: Vec<String> = found.map(|(at_s, event)| format!("{} at {}", event.text, utc_text(*at_s))).collect();
    match told.len() {
        0 if longest_silence_s < SILENCE_S => "No fault and no silence was reported.".to_owned(),
        0 => "No fault was reported.".to_owned(),
        n if n > MAX_TOLD => format!(
            "{n} events are about faults, silences, new runs or modes other than the survey, first {}; all are listed below.",
            told[..MAX_TOLD].join("; ")
        ),
        _ => format!("Faults, silences, new runs, and modes other than the survey: {}.", told.join("; ")),
    }
}

/// The times of the record without a frame from the vehicle: how long, seconds, and their ends.
fn pauses(dive: &Dive, vehicle: &DiveVehicle) -> impl Iterator<Item = (f64, f64)> {
    let (begin, end) = dive.span_s;
    let heard = || vehicle.heard_s.iter().copied();
    std::iter::once(begin).chain(heard()).zip(heard().chain([end])).map(|(a, b)| (b - a, b))
}

/// The longest of them.
fn longest_silence(dive: &Dive, vehicle: &DiveVehicle) -> (f64, f64) {
    let longer = |longest: (f64, f64), pause: (f64, f64)| if pause.0 > longest.0 { pause } else { longest };
    pauses(dive, vehicle).fold((0.0, dive.span_s.0), longer)
}

/// The silences, if there are several.
fn silences(dive: &Dive, vehicle: &DiveVehicle) -> Option<String> {
    let long: Vec<(f64, f64)> = pauses(dive, vehicle).filter(|(length_s, _)| *length_s >= SILENCE_S).collect();
    let told =
        |(length_s, end_s): &(f64, f64)| format!("from {} for {}", utc_text(end_s - length_s), duration(*length_s));
    let first: Vec<String> = long.iter().take(MAX_TOLD).map(told).collect();
    let more = if long.len() > MAX_TOLD { ", and later ones" } else { "" };
    (long.len() > 1).then(|| format!("No frame was heard for a minute or more {}{more}.", first.join(", ")))
}

/// When frames of the vehicle were heard.
fn heard(dive: &Dive, vehicle: &DiveVehicle, (longest_s, until_s): (f64, f64)) -> String {
    let Some(last_s) = vehicle.heard_s.last() else { return "No frame from it was heard.".to_owned() };
    format!(
        "The last frame from it was heard at {}, {} before the end of the record; the longest time without one was {}, until {}.",
        utc_text(*last_s),
        duration(dive.span_s.1 - last_s),
        duration(longest_s),
        utc_text(until_s)
    )
}

/// How far the operator's map was that of the vehicle, where its record says so.
fn agreement(vehicle: &DiveVehicle) -> Option<String> {
    let shares: Vec<f64> = vehicle.maps.iter().map(|maps| maps.agreement).filter(|share| share.is_finite()).collect();
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    shares.last().map(|last| {
        format!(
            "Of the vehicle's cells {:.0} % had the same label on the operator's map at the end, and {:.0} % on average over the record.",
            last * 100.0,
            mean * 100.0
        )
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
        "{} (address {}) was recorded from {} to {} (UTC), {} long{speed}, and reported its place {}.",
        state.name,
        state.id,
        utc_text(begin),
        utc_text(end),
        duration(end - begin),
        counted(vehicle.track.len(), "time", "times")
    )
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
    Some(format!(
        "The map reaches from {} to {} and from {} to {}{on_earth}.{}",
        words::east(west),
        words::east(east),
        words::north(south),
        words::north(north),
        unseen(dive, state, vehicle, shift)
    ))
}

/// How deep the sea floor is, where the map has a layer of it.
fn sea_floor(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let cells = dive.map_cells(state, vehicle);
    let layer = cells.layers().iter().find(|layer| layer.descriptor().quantity == Quantity::Depth)?;
    let depths = vehicle.labels.iter().filter_map(|(cell, _)| layer.value(cell));
    let (least, most) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), m| (least.min(m), most.max(m)));
    (least <= most)
        .then(|| format!("By the layer {} the sea floor is {least:.1} to {most:.1} m deep.", layer.descriptor().name))
}

/// How much of the configured area, or else of what the fence leaves, has cells.
fn unseen(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle, shift: (f64, f64)) -> String {
    let area = ran_with(dive, vehicle).settings.get("survey.area_m");
    let corners = area.and_then(|area| serde_json::from_value::<[f64; 4]>(area.clone()).ok());
    let Some([west, south, east, north]) = corners else {
        return match seen_of_fence(state, vehicle, shift) {
            Some(share) => format!(" Of the area within the fence, {:.1} % is on the map.", share * 100.0),
            None => " No area of the survey is configured, so how much of it was not seen is not known.".to_owned(),
        };
    };
    let middles = vehicle.labels.iter().map(|(cell, _)| vehicle.middle_of(cell, shift));
    let share = Area { west, south, east, north }.covered(middles, vehicle.cell_m);
    format!(
        " Of the area of the survey, {west} to {east} m east and {south} to {north} m north, {:.1} % is on the map.",
        share * 100.0
    )
}

/// The share of what the fence in force leaves that has cells; `None` without a fence.
fn seen_of_fence(state: &VehicleState, vehicle: &DiveVehicle, shift: (f64, f64)) -> Option<f64> {
    const MAX_CELLS: i64 = 1 << 22;
    let order = &state.orders.fence_in_force.as_ref()?.order;
    let corners = order.fence.as_ref()?;
    let fence = fence_of(Some(corners), &order.keep_outs, None).ok()?;
    let range = |axis: usize, shift_m: f64| {
        let cells = corners.iter().map(|corner| ((corner[axis] - shift_m) / vehicle.cell_m).floor() as i32);
        Some(cells.clone().min()?..=cells.max()?)
    };
    let (columns, rows) = (range(0, shift.0)?, range(1, shift.1)?);
    let count = |range: &RangeInclusive<i32>| i64::from(*range.end()) - i64::from(*range.start()) + 1;
    if count(&columns).checked_mul(count(&rows))? > MAX_CELLS {
        return None;
    }
    let place = |cell: Cell| place_of("cell", vehicle.middle_of(cell, shift).into());
    let all = rows.flat_map(|y| columns.clone().map(move |x| Cell::new(x, y)));
    let inside = all.filter(|&cell| place(cell).is_ok_and(|place| fence.allows(place)));
    let (seen, all) = inside
        .fold((0u64, 0u64), |(seen, all), cell| (seen + u64::from(vehicle.labels.get(cell) != UNEXPLORED), all + 1));
    (all > 0).then(|| seen as f64 / all as f64)
}

/// How much of the vehicle's map has arrived.
fn arrived(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let status = state.status.as_ref()?;
    let (reported, before_end_s) = (u64::from(status.cells), dive.span_s.1 - dive.unix_s(status.at_s));
    let held = vehicle.labels.explored() as u64;
    let share = (held as f64 / reported.max(1) as f64 * 100.0).min(100.0);
    let coarse = match is_coarse(vehicle) {
        true => {
            " Only every fourth cell in each direction was sent, as ordered or configured: areas count these cells alone."
        }
        false => "",
    };
    (reported > 0).then(|| {
        format!(
            "In its last report, {} before the end of the record, the vehicle had {reported} cells; {held} had arrived by the end{}.{coarse}",
            duration(before_end_s),
            if held > reported { String::new() } else { format!(", {share:.0} %") }
        )
    })
}

/// Whether the last order about it, or else the vehicle's configuration, was to send coarse cells only.
fn is_coarse(vehicle: &DiveVehicle) -> bool {
    let settings = vehicle.given.iter().filter(|((slot, _), _)| slot == SlotId::Settings.name());
    let ordered = settings.filter_map(|((_, version), order)| {
        let content = serde_json::from_str::<Value>(&order.content).ok()?;
        Some((*version, content.get("cells")?.clone()))
    });
    let last = ordered.max_by_key(|(version, _)| *version).map(|(_, cells)| cells).filter(|cells| !cells.is_null());
    let configured = || vehicle.settings.settings.get("map.cells").cloned();
    last.or_else(configured).is_some_and(|cells| cells == "coarse")
}

/// What the vehicle ran with, by its own record, or else the surface.
fn ran_with<'a>(dive: &'a Dive, vehicle: &'a DiveVehicle) -> &'a SettingsRecord {
    if vehicle.settings.settings.is_empty() { &dive.settings } else { &vehicle.settings }
}

/// How the vehicle looked at the sea floor.
fn equipment(dive: &Dive, vehicle: &DiveVehicle) -> String {
    if vehicle.settings.program.is_empty() && !dive.settings.simulated {
        return "What the vehicle was set to, such as its altitude, speed and camera, is not known without its own record.".to_owned();
    }
    let all = ran_with(dive, vehicle);
    let set = |key: &str, default: f64| all.settings.get(key).and_then(Value::as_f64).unwrap_or(default);
    let defaults = scenecast_config::Config::default();
    format!(
        "By its settings it was to survey {} m above the sea floor at {} m/s, with camera images whose pixels are {} m wide there.",
        set("survey.altitude_m", defaults.survey.altitude_m),
        set("survey.speed_m_s", defaults.survey.speed_m_s),
        set("camera.metres_per_pixel", defaults.camera.metres_per_pixel)
    )
}

fn place(dive: &Dive, vehicle: &DiveVehicle) -> String {
    let Some(last) = vehicle.path().last() else { return "It never reported a place.".to_owned() };
    let depths = || vehicle.path().iter().map(|point| point.depth_m);
    let (least, most) = (depths().fold(f64::INFINITY, f64::min), depths().fold(f64::NEG_INFINITY, f64::max));
    let origin = dive.state.mission.origin.map_or_else(
        || "the mission has no origin on the globe".to_owned(),
        |origin| format!("the origin is at {}", words::origin(origin)),
    );
    let begin = vehicle.path().first().map_or_else(String::new, |first| {
        format!(
            ", beginning {} and {} of the origin{}",
            words::east(first.east_m),
            words::north(first.north_m),
            on_earth(dive, (first.east_m, first.north_m))
        )
    });
    let depth = match format!("{least:.1}") == format!("{most:.1}") {
        true => format!("at a depth of {least:.1} m"),
        false => format!("at depths of {least:.1} to {most:.1} m"),
    };
    let speed = vehicle.speed_m_s(dive.state.mission.speed);
    let speed = speed.map_or_else(String::new, |m_s| format!(", at {m_s:.2} m/s on average while it moved"));
    let sigma_m = vehicle.path().iter().map(|point| point.sigma_m).fold(0.0, f64::max);
    format!(
        "By its {} {:.0} m{speed}{begin}, {depth} below the surface; at the end it was {} and {} of the origin, with a \
         standard deviation of {:.1} m, at most {sigma_m:.1} m before; {origin}.",
        if vehicle.own_track.len() > 1 { "own record it went" } else { "reports it went at least" },
        vehicle.distance_m(),
        words::east(last.east_m),
        words::north(last.north_m),
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
    let fixes = match fixes {
        0 => " The surface sent no position fix.".to_owned(),
        _ => format!(" The surface sent {}.", counted(fixes, "position fix", "position fixes")),
    };
    match all {
        0 => format!("No order was given.{fixes}"),
        n => {
            let [applied, refused, withdrawn] =
                [OrderStatus::APPLIED, OrderStatus::REFUSED, OrderStatus::WITHDRAWN].map(ends);
            let open = match n - applied - refused - withdrawn {
                0 => String::new(),
                open => format!(" Of {open} the surface did not know the end."),
            };
            let ends = [(applied, "applied"), (refused, "refused"), (withdrawn, "withdrawn")];
            let ends = ends.iter().filter(|(count, _)| *count > 0).map(|(count, end)| format!("{count} {end}"));
            let ends: Vec<String> = ends.collect();
            let ends = if ends.is_empty() { String::new() } else { format!("; {}", ends.join(", ")) };
            format!("{} given{authors}{ends}.{open}{fixes}", counted(n, "order was", "orders were"))
        }
    }
}
