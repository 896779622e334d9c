//! What went wrong in a dive, and what it did by order or because of a limit.

use super::dive::{Dive, DiveVehicle};
use super::{gaps, words};
use crate::state::VehicleState;
use scenecast_core::utc_text;
use scenecast_messages::contents::valid_part;
use scenecast_messages::scenecast_msgs::Event;
use scenecast_protocol::wire::{ModeReason, VehicleMode};
use std::collections::BTreeSet;

/// Events that are told in a sentence; of more, the first.
const MAX_TOLD: usize = 8;

/// The events that people should look at: faults, silences, restarts, and modes that nobody had ordered; then the modes that were ordered
/// or came from a limit.
pub(super) fn told(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let modes = vehicle.mode_source();
    let is_of_it = |event: &Event| event.vehicle.is_empty() || valid_part(&event.vehicle) == valid_part(&state.name);
    let is_restart = |event: &Event| event.source == "contact" && event.text == words::ANOTHER_RUN;
    let has_own = !vehicle.own.runs_s.is_empty();
    let is_trouble = |event: &Event| match event.source.as_str() {
        "fault" => true,
        _ if event.level >= Event::WARN && event.source.ends_with("on board") && event.source != modes => true,
        source if source == modes => !is_planned(&event.text),
        // Its own record says when it was.
        "contact" => event.text != "received" && !(has_own && is_restart(event)),
        _ => false,
    };
    let of_it = || dive.events.iter().filter(|(_, event)| is_of_it(event));
    let told = |(at_s, event): &(f64, Event)| (*at_s, words::event(&state.label_book, event));
    let restarts = |who: &'static str, lost: &'static str| {
        move |(from_s, to_s): (f64, f64)| {
            (from_s, format!("{who} record stops; its program ran again from {}{lost}", utc_text(to_s)))
        }
    };
    let mut found: Vec<(f64, String)> = of_it().filter(|(_, event)| is_trouble(event)).map(told).collect();
    found.extend(dive.restarts_s.iter().copied().map(restarts("the surface's", "")));
    found.extend(
        vehicle.own.pauses().map(restarts("the vehicle's", ", and what it had not stored may be lost on board")),
    );
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let planned = of_it().filter(|(_, event)| event.source == modes && is_limited(&event.text)).map(told);
    let planned: Vec<(f64, String)> = planned.collect();
    let none = match gaps::has_silence(dive, vehicle) {
        true => "No fault and no restart was reported.",
        false => "No fault, no restart and no silence was reported.",
    };
    let mut sentences = vec![
        listed("Faults, restarts and silences, when they were reported", &found).unwrap_or_else(|| none.to_owned()),
    ];
    let planned_title = match vehicle.own.runs_s.is_empty() {
        true => "Why it did not survey, when the surface learned of it",
        false => "Why it did not survey",
    };
    sentences.extend(listed(planned_title, &planned));
    sentences.extend(times_of_modes(dive, state, vehicle));
    if !vehicle.own.images.is_empty() {
        sentences
            .push(format!("Images by the vehicle's own record: {}.", vehicle.own.images.join(". After a restart: ")));
    }
    sentences
}

/// How long it was in each mode, by its own record.
fn times_of_modes(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let of_modes = vehicle.mode_source();
    let is_mode = |event: &Event| event.source == of_modes && valid_part(&event.vehicle) == valid_part(&state.name);
    let modes: Vec<(f64, &str)> = (dive.events.iter().filter(|(_, event)| is_mode(event)))
        .map(|(at_s, event)| (*at_s, event.text.split(": ").next().unwrap_or_default()))
        .collect();
    let mut spent: Vec<(&str, f64)> = Vec::new();
    for (n, (at_s, mode)) in modes.iter().enumerate() {
        let Some((_, end_s)) = vehicle.own.runs_s.iter().find(|run| at_s - 1.0 <= run.1) else { continue };
        let until_s = modes.get(n + 1).map_or(*end_s, |next| next.0.min(*end_s));
        let time_s = dive.mission_s(until_s - at_s).max(0.0);
        match spent.iter_mut().find(|(known, _)| known == mode) {
            Some((_, sum_s)) => *sum_s += time_s,
            None => spent.push((mode, time_s)),
        }
    }
    let told: Vec<String> = spent.iter().map(|(mode, time_s)| format!("{mode} {}", words::duration(*time_s))).collect();
    (told.len() > 1).then(|| format!("Time in each mode by its own record: {}.", told.join(", ")))
}

/// Whether a mode is the survey or its end, or one that was ordered or that a limit led to.
fn is_planned(mode: &str) -> bool {
    mode.starts_with(VehicleMode::Survey.name()) || is_limited(mode)
}

/// Whether an order, or the want of one, a limit of distance or time, or the end of its plan led to a mode other than the survey.
fn is_limited(mode: &str) -> bool {
    let troubles = [ModeReason::Silence, ModeReason::Fence, ModeReason::Band, ModeReason::NoPath];
    let is_of = |reason: &ModeReason| mode.rsplit_once(": ").is_some_and(|(_, end)| Some(end) == reason.name());
    !mode.starts_with(VehicleMode::Survey.name()) && !troubles.iter().any(is_of)
}

fn listed(title: &str, found: &[(f64, String)]) -> Option<String> {
    let mut said = BTreeSet::new();
    let told = found.iter().map(|(at_s, text)| match said.insert(text) {
        true => format!("{}, {text}", utc_text(*at_s)),
        false => format!("{}, {} again", utc_text(*at_s), text.split(": ").next().unwrap_or(text)),
    });
    let told: Vec<String> = told.collect();
    match told.len() {
        0 => None,
        n if n > MAX_TOLD => {
            let first = told[..MAX_TOLD].join("; ");
            Some(format!("{title}: {n} events, which the table of events has; the first were {first}."))
        }
        _ => Some(format!("{title}: {}.", told.join("; "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_ordered_is_no_trouble() {
        for planned in
            ["surveying", "done", "holding", "holding: order", "holding: no order yet", "returning: distance"]
        {
            assert!(is_planned(planned), "{planned}");
        }
        for trouble in ["returning: silence", "holding: fence", "holding: no path"] {
            assert!(!is_planned(trouble), "{trouble}");
        }
        assert!(!is_limited("surveying"));
    }

    #[test]
    fn of_many_events_the_first_are_told() {
        let events: Vec<(f64, String)> = (0..9).map(|n| (f64::from(n), format!("event {n}"))).collect();
        let told = listed("Faults", &events).unwrap();
        assert!(
            told.starts_with("Faults: 9 events") && told.contains("event 7") && !told.contains("event 8"),
            "{told}"
        );
        assert_eq!(listed("Faults", &events[..1]).unwrap(), "Faults: 1970-01-01T00:00:00Z, event 0.");
        assert_eq!(listed("Faults", &[]), None);
    }
}
