//! The state as text for people.

use crate::state::{Backlog, Exemplar, ExemplarState, LifeLine, Link, Mode, Slot, State, Status, Vehicle};
use std::fmt::Write;

/// Everything, or what concerns one vehicle.
pub(super) fn status(state: &State, only: Option<u8>) -> String {
    let (mission, link) = (&state.mission, &state.link);
    let ended = if mission.ended { ", the survey is over" } else { "" };
    let mut out = format!("mission {}  at {}{ended}\n", mission.name, span(state.now_s));
    let used = 100.0 * link.down.bps_1min / f64::from(link.budget_bps.max(1));
    let shares: Vec<String> = link.shares.iter().map(|(class, percent)| format!("{class} {percent} %")).collect();
    let _ =
        writeln!(out, "budget  {} bit/s, {used:.0} % used in the last minute; {}", link.budget_bps, shares.join(", "));
    for (name, d) in [("up", &link.up), ("down", &link.down)] {
        let lost = 100.0 * d.loss;
        let rates = format!("{:>6.0} bit/s on air, {:>6.0} bit/s useful", d.bps_1min, d.goodput_bps);
        let _ = writeln!(out, "{name:<7} {rates}; {} frames, {lost:.1} % lost", d.frames);
    }
    for v in state.vehicles.iter().filter(|v| only.is_none_or(|id| v.id == id)) {
        vehicle(&mut out, v, state);
    }
    out
}

fn vehicle(out: &mut String, v: &Vehicle, state: &State) {
    let now = state.now_s;
    let silent = if is_silent(v, state) { ": SILENT" } else { "" };
    let heard = v.heard_s.map_or("never heard".to_owned(), |at| format!("heard {} ago", span(now - at)));
    let expected = format!("a frame is expected within {}", span(v.expected_interval_s));
    let _ = writeln!(out, "\nvehicle {} {}  {heard}, {expected}{silent}", v.id, v.name);
    if let Some(s) = &v.status {
        let place = format!("E {:.1} m  N {:.1} m  up {:.1} m  heading {:03.0}", s.x_m, s.y_m, s.z_m, s.heading_deg);
        let age = span(now - s.at_s);
        let _ = writeln!(out, "  {:<10} {place}  +-{:.1} m, said {age} ago", mode(s.mode), s.sigma_m);
        if let Some(way) = way(s) {
            let _ = writeln!(out, "  path       {way}");
        }
    }
    let changed = v.map.updated_s.map_or("no cell yet".to_owned(), |at| format!("changed {} ago", span(now - at)));
    let cells = format!("version {}, {} cells, {} labels", v.map.version, v.map.explored_cells, v.labels.len());
    let _ = writeln!(out, "  map        {cells}, {changed}");
    let trip = v.link.round_trip_s.map_or("not measured".to_owned(), |s| format!("{s:.2} s"));
    let (up, down) = (100.0 * v.link.up.loss, 100.0 * v.link.down.loss);
    let _ = writeln!(out, "  water      loss up {up:.0} %, down {down:.0} %, round trip {trip}");
    if let Some(b) = &v.link.backlog {
        let _ = writeln!(out, "  backlog    {}", backlog(b, now));
    }
    for s in &v.directive.slots {
        let _ = writeln!(out, "  {:<10} {}, {} ago", s.slot, slot(s), span(now - s.changed_s));
    }
}

/// How far it is over the waypoint and the path after it.
fn way(s: &Status) -> Option<String> {
    let waypoint = s.waypoint?;
    let places = || std::iter::once(waypoint).chain(s.path.iter().copied());
    let before = std::iter::once((s.x_m, s.y_m)).chain(places());
    let metres: f64 = before.zip(places()).map(|(a, b)| (b.0 - a.0).hypot(b.1 - a.1)).sum();
    let count = if s.path.is_empty() { "1 waypoint".to_owned() } else { format!("{} waypoints", 1 + s.path.len()) };
    let further = if s.path_goes_on { ", and it goes on" } else { "" };
    Some(format!("{count}, {metres:.1} m{further}"))
}

fn backlog(b: &Backlog, now_s: f64) -> String {
    let unknown = || "nobody knows when".to_owned();
    let empty = match b.empty_s {
        _ if b.bits == 0 => "empty".to_owned(),
        empty_s => empty_s.map_or_else(unknown, |at| format!("empty in {}", span(at - now_s))),
    };
    let lag = b.map_lag_s.map_or_else(unknown, span);
    let said = span(now_s - b.at_s);
    format!("{} bit, {empty}; the map lags {} bit, about {lag}; said {said} ago", b.bits, b.map_bits)
}

/// The labels of a vehicle as a table.
pub(super) fn labels(v: &Vehicle, now_s: f64) -> String {
    let mut out = format!("{:>5} {:>8} {:>10} {:>7}  image\n", "label", "cells", "area m2", "weight");
    for l in &v.labels {
        let image = image(&l.exemplar, now_s);
        let _ = writeln!(out, "{:>5} {:>8} {:>10.2} {:>7.2}  {image}", l.id, l.cells, l.area_m2, l.weight);
    }
    let _ = writeln!(out, "unseen cells weigh {:.2}", v.utility.exploration);
    out
}

fn image(e: &Exemplar, now_s: f64) -> String {
    let state = match e.state {
        ExemplarState::None => return "-".to_owned(),
        ExemplarState::Coming => format!("coming, {:.0} %", 100.0 * e.progress),
        ExemplarState::Here => match e.pictures.len() {
            0 | 1 => format!("here, {} bytes", e.bytes.unwrap_or(0)),
            n => format!("{n} here, the last one {} bytes", e.bytes.unwrap_or(0)),
        },
        ExemplarState::NoneYet => "the vehicle has none yet".to_owned(),
        ExemplarState::Queued => "queued".to_owned(),
        ExemplarState::OnAir => "on air".to_owned(),
        ExemplarState::Refused => "refused".to_owned(),
    };
    e.at_s.map_or(state.clone(), |at| format!("{state}, {} ago", span(now_s - at)))
}

/// What left-over bits go to.
pub(super) fn spend(link: &Link) -> String {
    if link.background.is_empty() { "nothing".to_owned() } else { link.background.join(", then ") }
}

/// Three times as long without a frame as is usual.
pub(super) fn is_silent(v: &Vehicle, state: &State) -> bool {
    !state.mission.ended && state.now_s - v.heard_s.unwrap_or(0.0) > 3.0 * v.expected_interval_s
}

/// How far an order is.
pub(super) fn slot(s: &Slot) -> String {
    let reason = s.reason.as_ref().map_or(String::new(), |why| format!(": {why}"));
    format!("version {} {}{reason}", s.version, life(s.state))
}

pub(super) fn life(state: LifeLine) -> &'static str {
    match state {
        LifeLine::Queued => "queued",
        LifeLine::OnAir => "on air",
        LifeLine::Heard => "heard",
        LifeLine::Applied => "applied",
        LifeLine::Refused => "refused",
    }
}

pub(super) fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Survey => "survey",
        Mode::Hold => "hold",
        Mode::Return => "return",
        Mode::Surface => "surface",
        Mode::Abort => "abort",
        Mode::Done => "done",
    }
}

/// A duration for people.
pub(super) fn span(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_told_from_the_vehicle_to_its_last_waypoint() {
        let told = |waypoint, path: &[(f64, f64)], path_goes_on| {
            let status = Status { path: path.to_vec(), path_goes_on, waypoint, ..standing() };
            way(&status)
        };
        assert_eq!(told(None, &[], false), None);
        assert_eq!(told(Some((3.0, 5.0)), &[], false).unwrap(), "1 waypoint, 5.0 m");
        let on = told(Some((3.0, 5.0)), &[(3.0, 7.5), (1.0, 7.5)], true).unwrap();
        assert_eq!(on, "3 waypoints, 9.5 m, and it goes on");
    }

    /// At (0, 1).
    fn standing() -> Status {
        Status {
            at_s: 0.0,
            x_m: 0.0,
            y_m: 1.0,
            z_m: 0.0,
            heading_deg: 0.0,
            sigma_m: 0.0,
            mode: Mode::Survey,
            autopilot_silent: false,
            reason: None,
            doing: String::new(),
            waypoint: None,
            path: Vec::new(),
            path_goes_on: false,
            cells: 0,
            labels: 0,
            fix_age_s: None,
            budget_bps: 0,
            refused_frames: 0,
        }
    }

    #[test]
    fn durations_are_told_in_the_two_units_that_matter() {
        let told: Vec<String> = [0.4, 59.6, 3599.0, 3661.0, -1.0].map(super::span).into();
        assert_eq!(told, ["0 s", "1 min 00 s", "59 min 59 s", "1 h 01 min", "0 s"]);
    }
}
