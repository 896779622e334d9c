//! The events of a record for its time line.

use crate::recording::Recording;
use scenecast_messages::contents::valid_part;
use scenecast_surface::LogKind;
use scenecast_surface::state::ReplayEvent;
use std::collections::BTreeMap;

/// The most events of a time line; of more, the first.
const MAX_EVENTS: usize = 5000;

/// The entries of the surface's log, the loops that vehicles closed, and what vehicles say of themselves, in the order of their
/// times.
pub(super) fn events(recording: &Recording, vehicle: impl Fn(&str) -> Option<u8>) -> Vec<ReplayEvent> {
    let event = |at: u64, kind: &str, vehicle: Option<u8>, text: String| ReplayEvent {
        at_utc_s: at as f64 / 1e9,
        kind: kind.to_owned(),
        vehicle,
        text,
    };
    let logged = recording.log.iter().map(|(at, logged)| {
        let by = vehicle(&valid_part(&logged.vehicle));
        event(*at, kind(&logged.source), by, logged.text.clone())
    });
    let is_alone = recording.timeline.states.is_empty();
    let on_board = recording.vehicles.iter().flat_map(|(part, known)| {
        let id = vehicle(part);
        // Fixes come too often to be marks; the surface's log has the modes too, as they became known.
        let told =
            known.events.iter().filter(move |(_, said)| said.source != "fix" && (is_alone || said.source != "mode"));
        told.map(move |(at, said)| event(*at, "vehicle", id, format!("on board: {}", said.text)))
    });
    let mut events: Vec<ReplayEvent> = logged.chain(on_board).collect();
    events.extend(loops(recording).into_iter().map(|(at, id, text)| event(at, "loop", Some(id), text)));
    events.sort_by(|a, b| a.at_utc_s.total_cmp(&b.at_utc_s));
    events.truncate(MAX_EVENTS);
    events
}

/// The kind of mark of an entry of the log.
fn kind(logged: &str) -> &str {
    match LogKind::ALL.into_iter().find(|kind| kind.name() == logged) {
        Some(LogKind::Order | LogKind::Answer) => "order",
        Some(LogKind::Contact) => "silence",
        _ => logged,
    }
}

/// Each report of a vehicle that has closed more loops than the one before: time, address, text.
fn loops(recording: &Recording) -> Vec<(u64, u8, String)> {
    let mut closed: BTreeMap<u8, u16> = BTreeMap::new();
    let mut found = Vec::new();
    for state in &recording.timeline.states {
        for vehicle in &state.head.vehicles {
            let Some(registration) = &vehicle.registration else { continue };
            let before = closed.insert(vehicle.id, registration.closed).unwrap_or(0);
            if registration.closed > before {
                found.push((state.nanos, vehicle.id, format!("{} frames have closed a loop", registration.closed)));
            }
        }
    }
    found
}
