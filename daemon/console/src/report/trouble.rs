//! What went wrong in a dive, and what it did by order or because of a limit.

use super::dive::SetBack;
use super::dive::{Dive, DiveVehicle};
use super::{gaps, uncertainty, words};
use scenecast_core::utc_text;
use scenecast_messages::contents::valid_part;
use scenecast_messages::scenecast_msgs::{Event, OrderStatus};
use scenecast_protocol::wire::{EquipmentFaults, ModeReason, VehicleMode};
use scenecast_surface::state::VehicleState;
use scenecast_surface::{AUTOPILOT_SILENT, LogKind, NO_FAULT};
use std::collections::BTreeSet;

/// The source of events about faults.
const FAULT: &str = LogKind::Fault.name();
/// Events that are told in a sentence; of more, the first.
const MAX_TOLD: usize = 12;

/// The events that people should look at: faults, silences, restarts, and modes that nobody had ordered.
pub(super) fn told(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let modes = vehicle.mode_source();
    let is_restart = |event: &Event| event.source == "contact" && event.text == words::ANOTHER_RUN;
    let is_of_silence = |event: &Event| ["received", "silent for "].iter().any(|begin| event.text.starts_with(begin));
    let has_own = !vehicle.own.runs_s.is_empty();
    let is_trouble = |event: &Event| match event.source.as_str() {
        FAULT => equipment(&event.text).is_none(),
        _ if event.level >= Event::WARN && event.source.ends_with("on board") && event.source != modes => true,
        source if source == modes => !is_planned(&event.text),
        // Silences have their begin and end by the frames; its own record says when it was restarted.
        "contact" => !(is_of_silence(event) || has_own && is_restart(event)),
        _ => false,
    };
    let of_it = || dive.events.iter().filter(|(_, event)| is_of(event, state));
    let told = |(at_s, event): &(f64, Event)| (*at_s, words::event(&state.label_book, event));
    let restart = |who: &str, (from_s, to_s): (f64, f64), map: String| {
        let (again, lasted) = (utc_text(to_s), dive.lasted(to_s - from_s));
        (from_s, format!("{who} record stops; its program ran again from {again}, about {lasted} later{map}"))
    };
    let mut found: Vec<(f64, String)> = of_it().filter(|(_, event)| is_trouble(event)).map(told).collect();
    found.extend(faults(dive, state));
    found.extend(dive.restarts_s.iter().map(|pause| restart("the surface's", *pause, String::new())));
    let pauses = vehicle.own.pauses().zip(&vehicle.own.set_backs);
    let told_of = |set_back: &Option<SetBack>| set_back.map_or_else(String::new, |set_back| set_back.told(dive));
    found.extend(pauses.map(|(pause, set_back)| {
        restart("the vehicle's", pause, told_of(set_back) + &uncertainty::lost(vehicle, pause))
    }));
    found.extend(gaps::told(dive, vehicle));
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    match found.is_empty() {
        true => vec!["No fault, no restart and no silence was reported.".to_owned()],
        false => listed(&found),
    }
}

/// The orders that the vehicle refused, and the requests that the surface did.
pub(super) fn refused(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let by_vehicle = vehicle.orders_of_people().filter_map(|(order, way)| {
        let last = way.last().filter(|last| last.status == OrderStatus::REFUSED)?;
        let ordered = dive.ordered(state, vehicle, order).1;
        Some((last.at_s, format!("the vehicle refused an order ({ordered}): {}", last.reason)))
    });
    let by_surface = dive.not_sent(state).map(|(at_s, event)| {
        (*at_s, format!("the surface refused a request: {}", words::event(&state.label_book, event)))
    });
    let mut found: Vec<(f64, String)> = by_vehicle.chain(by_surface).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    listed(&found)
}

/// Whether an event is about a vehicle, or about all.
fn is_of(event: &Event, state: &VehicleState) -> bool {
    event.vehicle.is_empty() || valid_part(&event.vehicle) == valid_part(&state.name)
}

impl Dive {
    /// The requests of people that the surface refused and did not send.
    pub(super) fn not_sent(&self, state: &VehicleState) -> impl Iterator<Item = &(f64, Event)> {
        self.events.iter().filter(|(_, event)| event.source == LogKind::Refused.name() && is_of(event, state))
    }
}

/// The modes in which it did not survey, where it was when each began, how long it was in each, and what became of its images.
pub(super) fn modes(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let all: Vec<(f64, &Event)> = dive.modes(state, vehicle).collect();
    let others = all.iter().enumerate().filter(|(_, (_, event))| !is_survey(&event.text));
    let others: Vec<String> = others
        .map(|(n, (at_s, event))| {
            let until = all.get(n + 1).map_or_else(|| "the end".to_owned(), |(next_s, _)| utc_text(*next_s));
            let place = vehicle.path().iter().rev().find(|point| point.at_s <= at_s + 1.0);
            let place = place.map_or_else(String::new, |point| {
                format!(" (from {}, {})", words::east(point.east_m), words::north(point.north_m))
            });
            format!("{} to {until}, {}{place}", utc_text(*at_s), words::event(&state.label_book, event))
        })
        .take(MAX_TOLD)
        .collect();
    let title = match vehicle.own.runs_s.is_empty() {
        true => "Why it did not survey, when the surface learned of it",
        false => "Why it did not survey",
    };
    let others = (!others.is_empty()).then(|| format!("{title}: {}.", others.join("; ")));
    let ended = all.last().filter(|(_, event)| is_survey(&event.text)).map(|_| "It surveyed until the end.".to_owned());
    let images = (!vehicle.own.images.is_empty())
        .then(|| format!("Images by the vehicle's own record: {}.", vehicle.own.images.join(". After a restart: ")));
    others.into_iter().chain(ended).chain(times_of_modes(dive, state, vehicle)).chain(images).collect()
}

/// The faults that a text of the log names, and whether the survey does not proceed as planned with each; `None` if it is about
/// something else.
fn equipment(text: &str) -> Option<Vec<(&'static str, bool)>> {
    let known = || EquipmentFaults::decode(u8::MAX).iter().chain([(AUTOPILOT_SILENT, true)]);
    match text {
        NO_FAULT => Some(Vec::new()),
        faults => faults.split(", ").map(|fault| known().find(|(known, _)| *known == fault)).collect(),
    }
}

/// The faults of its equipment: by when they had begun and, of those with which the survey does not proceed as planned, by when they had
/// ended, as reports of its status come every few seconds. The end of others is not reported.
fn faults(dive: &Dive, state: &VehicleState) -> Vec<(f64, String)> {
    let mut open: Vec<(&str, f64)> = Vec::new();
    let mut told: Vec<(f64, String)> = Vec::new();
    let reports = dive.events.iter().filter(|(_, event)| event.source == FAULT && event.vehicle == state.name);
    for (at_s, reported) in reports.filter_map(|(at_s, event)| Some((*at_s, equipment(&event.text)?))) {
        let (last, over): (Vec<_>, Vec<_>) =
            open.into_iter().partition(|(fault, _)| reported.iter().any(|(known, _)| known == fault));
        open = last;
        told.extend(over.into_iter().map(|(fault, from_s)| {
            let lasted = dive.lasted(at_s - from_s);
            (from_s, format!("by then {fault}, reported as over by {}, {lasted} later", utc_text(at_s)))
        }));
        for (fault, is_grave) in reported {
            if !is_grave {
                told.push((at_s, format!("by then {fault}")));
            } else if open.iter().all(|(known, _)| *known != fault) {
                open.push((fault, at_s));
            }
        }
    }
    told.extend(
        open.into_iter().map(|(fault, from_s)| (from_s, format!("by then {fault}, until the end of the record"))),
    );
    told
}

/// How long it was in each mode, by its own record.
fn times_of_modes(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let modes =
        dive.modes(state, vehicle).map(|(at_s, event)| (at_s, event.text.split(": ").next().unwrap_or_default()));
    let modes: Vec<(f64, &str)> = modes.collect();
    let mut spent: Vec<(&str, f64)> = Vec::new();
    for (n, (at_s, mode)) in modes.iter().enumerate() {
        let Some((_, end_s)) = vehicle.own.runs_s.iter().find(|run| at_s - 1.0 <= run.1) else { continue };
        let until_s = modes.get(n + 1).map_or(*end_s, |next| next.0.min(*end_s));
        let time_s = (until_s - at_s).max(0.0);
        match spent.iter_mut().find(|(known, _)| known == mode) {
            Some((_, sum_s)) => *sum_s += time_s,
            None => spent.push((mode, time_s)),
        }
    }
    spent.retain(|(_, time_s)| *time_s >= 0.5);
    let told: Vec<String> = spent.iter().map(|(mode, time_s)| format!("{mode} {}", dive.lasted(*time_s))).collect();
    (told.len() > 1).then(|| format!("Time in each mode by its own record: {}.", told.join(", ")))
}

fn is_survey(mode: &str) -> bool {
    mode.starts_with(VehicleMode::Survey.name())
}

/// Whether a mode is the survey or its end, or one that was ordered or that a limit led to.
fn is_planned(mode: &str) -> bool {
    is_survey(mode) || is_limited(mode)
}

/// Whether an order, or the want of one, a limit of distance or time, or the end of its plan led to a mode other than the survey.
fn is_limited(mode: &str) -> bool {
    let troubles = [ModeReason::Silence, ModeReason::Fence, ModeReason::Band, ModeReason::NoPath];
    !is_survey(mode) && !troubles.into_iter().any(|reason| is_because(mode, reason))
}

/// Whether a mode has this reason.
pub(super) fn is_because(mode: &str, reason: ModeReason) -> bool {
    mode.rsplit_once(": ").is_some_and(|(_, end)| Some(end) == reason.name())
}

/// Each of these events in a sentence; of many, the first.
fn listed(found: &[(f64, String)]) -> Vec<String> {
    let mut said = BTreeSet::new();
    let told = found.iter().take(MAX_TOLD).map(|(at_s, text)| match said.insert(text) {
        true => format!("{}: {text}.", utc_text(*at_s)),
        false => format!("{}: again {text}.", utc_text(*at_s)),
    });
    let more = found.len().saturating_sub(MAX_TOLD);
    let more = (more > 0).then(|| format!("{} followed: see the events.", words::counted(more, "more", "more")));
    told.chain(more).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_told_with_its_begin_and_its_end() {
        let (mut dive, state) = (Dive::default(), VehicleState::default());
        dive.state.mission.speed = 2.0;
        let event = |(at_s, source, text): (f64, &str, &str)| {
            (at_s, Event { source: source.to_owned(), text: text.to_owned(), ..Event::default() })
        };
        dive.events = [
            (10.0, FAULT, "no image comes in"),
            (12.0, FAULT, "the port is closed, it seems"),
            (20.0, FAULT, "no pose comes in, no image comes in, images are dropped"),
            (30.0, "mode", "holding"),
            (40.0, FAULT, "no pose comes in"),
            (50.0, FAULT, NO_FAULT),
            (60.0, FAULT, AUTOPILOT_SILENT),
        ]
        .map(event)
        .to_vec();
        let told: Vec<String> =
            faults(&dive, &state).into_iter().map(|(at_s, text)| format!("{at_s}: {text}")).collect();
        let expected = [
            "20: by then images are dropped",
            "10: by then no image comes in, reported as over by 1970-01-01T00:00:40Z, 30 s (60 s of the mission) later",
            "20: by then no pose comes in, reported as over by 1970-01-01T00:00:50Z, 30 s (60 s of the mission) later",
            "60: by then the autopilot does not answer, until the end of the record",
        ];
        assert_eq!(told, expected);
        assert_eq!(equipment("the port is closed, it seems"), None);
    }

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
        let events: Vec<(f64, String)> = (0..14).map(|n| (f64::from(n), format!("event {n}"))).collect();
        let told = listed(&events);
        assert_eq!((told.len(), told[0].as_str()), (MAX_TOLD + 1, "1970-01-01T00:00:00Z: event 0."));
        assert_eq!(told[MAX_TOLD], "2 more followed: see the events.");
        assert_eq!(listed(&[(0.0, "a".to_owned()), (1.0, "a".to_owned())])[1], "1970-01-01T00:00:01Z: again a.");
    }
}
