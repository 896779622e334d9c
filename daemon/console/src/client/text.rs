//! The state as text.

use super::names::LabelGroup;
use scenecast_surface::state::{
    CommandChangeName, CommandChangeState, CommandState, ExemplarProgress, ExemplarStage, LinkSummary, MissionState,
    OrderProgress, OrderStatus, PrincipalRole, ReportedBacklog, ReportedDisk, ReportedMode, ReportedRegistration,
    ReportedTie, StatusReport, VehicleState,
};
use std::fmt::Write;

/// The mission, the link, and all vehicles or one.
pub(super) fn status(state: &MissionState, only: Option<u8>) -> String {
    let (mission, link) = (&state.mission, &state.link);
    let ended = if mission.ended { ", the survey has ended" } else { "" };
    let mut out = format!("mission {}  at {}{ended}\n", mission.name, span(state.now_s));
    let _ = writeln!(out, "command {}", command(&state.command, state.now_s));
    let used = 100.0 * link.down.bps_1min / f64::from(link.budget_bps.max(1));
    let shares: Vec<String> = link.shares.iter().map(|(class, percent)| format!("{class} {percent} %")).collect();
    let _ =
        writeln!(out, "budget  {} bit/s, {used:.0} % used in the last minute; {}", link.budget_bps, shares.join(", "));
    for (name, d) in [("up", &link.up), ("down", &link.down)] {
        let lost = 100.0 * d.loss;
        let rates = format!("{:>6.0} bit/s on air, {:>6.0} bit/s useful", d.bps_1min, d.goodput_bps);
        let _ = writeln!(out, "{name:<7} {rates}; {} frames, {lost:.1} % lost", d.frames);
    }
    if let (Some(up), Some(down)) = (link.up.energy_j, link.down.energy_j) {
        let per_bit = link.energy_per_map_bit_j.map_or(String::new(), |j| format!(" ({:.2} mJ per map bit)", j * 1e3));
        let _ = writeln!(out, "energy  up {}{per_bit}, down {}", energy(up), energy(down));
    }
    for v in state.vehicles.iter().filter(|v| only.is_none_or(|id| v.id == id)) {
        vehicle(&mut out, v, state);
    }
    out
}

fn energy(joules: f64) -> String {
    if joules < 10_000.0 { format!("{joules:.1} J") } else { format!("{:.1} kJ", joules / 1e3) }
}

fn vehicle(out: &mut String, v: &VehicleState, state: &MissionState) {
    let now = state.now_s;
    let silent = if is_silent(v, state) { ": SILENT" } else { "" };
    let received = v.last_received_s.map_or("no frame yet".to_owned(), |at| format!("received {} ago", span(now - at)));
    let expected = format!("a frame is expected within {}", span(v.expected_interval_s));
    let _ = writeln!(out, "\nvehicle {} {}  {received}, {expected}{silent}", v.id, v.name);
    if let Some(mismatch) = &v.link.mismatch {
        let _ = writeln!(out, "  mismatch   {mismatch}");
    }
    if let Some(other) = &v.other_surface {
        let name = if other.name.is_empty() { "another surface".to_owned() } else { format!("surface {}", other.name) };
        let does = if other.holds { "HOLDS THE VEHICLE" } else { "calls the vehicle" };
        let _ = writeln!(out, "  surface    {name} {does}, heard {} ago", span(now - other.heard_s));
    }
    if let Some(s) = &v.status {
        let p = &s.pose;
        let place = format!("E {:.1} m  N {:.1} m  up {:.1} m  heading {:03.0}", p.x_m, p.y_m, p.z_m, p.heading_deg);
        let age = span(now - s.at_s);
        let _ = writeln!(out, "  {:<10} {place}  +-{:.1} m, reported {age} ago", mode(s.mode), p.sigma_m);
        if !s.activity.is_empty() {
            let _ = writeln!(out, "  activity   {}", s.activity);
        }
        if let Some(path) = path(s) {
            let _ = writeln!(out, "  path       {path}");
        }
        let silence = s.autopilot_silent.then_some("the autopilot does not answer");
        let faults: Vec<&str> = silence.into_iter().chain(s.faults.iter().map(|fault| fault.text.as_str())).collect();
        if !faults.is_empty() {
            let _ = writeln!(out, "  FAULTS     {}", faults.join(", "));
        }
        if let Some(state) = &s.disk {
            let _ = writeln!(out, "  disk       {}", disk(state));
        }
    }
    if let Some(r) = &v.registration {
        let _ = writeln!(out, "  frames     {}, reported {} ago", registration(r), span(now - r.at_s));
    }
    let changed = v.map.updated_s.map_or("no cell yet".to_owned(), |at| format!("changed {} ago", span(now - at)));
    let cells = format!("version {}, {} cells, {} labels", v.map.version, v.map.explored_cells, v.labels.len());
    let _ = writeln!(out, "  map        {cells}, {changed}");
    if let Some(earlier) = &v.map.earlier {
        let here = earlier.current_cells;
        let _ = writeln!(out, "             OF AN EARLIER RUN; {here} cells of the current one are here");
    }
    let trip = v.link.round_trip_s.map_or("not measured".to_owned(), |s| format!("{s:.2} s"));
    let (up, down) = (100.0 * v.link.up.loss, 100.0 * v.link.down.loss);
    let _ = writeln!(out, "  channel    loss up {up:.0} %, down {down:.0} %, round trip {trip}");
    if let Some(b) = &v.link.backlog {
        let _ = writeln!(out, "  backlog    {}", backlog(b, now));
    }
    for s in &v.orders.directive.slots {
        let _ = writeln!(out, "  {:<10} {}, {} ago", s.name, order(s), span(now - s.changed_s));
    }
}

/// How the last camera frames were placed.
fn registration(r: &ReportedRegistration) -> String {
    let tie = match r.tie {
        ReportedTie::Off => return "placed by odometry, as registration is off".to_owned(),
        ReportedTie::Odometry => "lost: placed by odometry",
        ReportedTie::FrameBefore => "placed by the frame before",
        ReportedTie::EarlierTrack => "placed by an earlier track",
    };
    let share = (100.0 * r.share).round();
    format!("{tie}, +-{:.2} m, {share} % of the last 32 by images, {} closed loops", r.sigma_m, r.closed)
}

/// The number of waypoints and the length of the planned path.
fn path(s: &StatusReport) -> Option<String> {
    let (pose, plan) = (&s.pose, &s.plan);
    let waypoint = plan.waypoint?;
    let places = || std::iter::once(waypoint).chain(plan.path.iter().copied());
    let before = std::iter::once((pose.x_m, pose.y_m)).chain(places());
    let metres: f64 = before.zip(places()).map(|(a, b)| (b.0 - a.0).hypot(b.1 - a.1)).sum();
    let count =
        if plan.path.is_empty() { "1 waypoint".to_owned() } else { format!("{} waypoints", 1 + plan.path.len()) };
    let further = if plan.path_continues { ", continues" } else { "" };
    Some(format!("{count}, {metres:.1} m{further}"))
}

/// The files that a vehicle's disk refuses, and its free space.
fn disk(disk: &ReportedDisk) -> String {
    let files = match (disk.journal_refused, disk.checkpoint_refused) {
        (true, true) => "REFUSES JOURNAL AND CHECKPOINT",
        (true, false) => "REFUSES THE JOURNAL",
        (false, true) => "REFUSES THE CHECKPOINT",
        (false, false) => "takes all files",
    };
    let free = match disk.free_bytes {
        None => "free space unknown".to_owned(),
        Some(0) => "less than 1 MB free".to_owned(),
        Some(bytes) if bytes < 1_000_000_000 => format!("at least {} MB free", bytes / 1_000_000),
        Some(bytes) => format!("at least {} GB free", bytes / 1_000_000_000),
    };
    format!("{files}, {free}")
}

fn backlog(b: &ReportedBacklog, now_s: f64) -> String {
    let unknown = || "unknown".to_owned();
    let empty = match b.empty_s {
        _ if b.bits == 0 => "empty".to_owned(),
        empty_s => empty_s.map_or("no data received".to_owned(), |at| format!("empty in {}", span(at - now_s))),
    };
    let lag = b.map_lag_s.map_or_else(unknown, span);
    let age = span(now_s - b.at_s);
    format!("{} bit, {empty}; map lag {} bit, about {lag}; reported {age} ago", b.bits, b.map_bits)
}

/// The labels of a vehicle as a table.
pub(super) fn labels(v: &VehicleState, now_s: f64) -> String {
    let mut out = format!("{:>5} {:>8} {:>10} {:>9} {:>7}  image\n", "label", "cells", "area m2", "5 min m2", "weight");
    if v.labels.iter().any(|l| l.book.name.is_some()) {
        out = out.replace("  image", "  image: name");
    }
    for l in &v.labels {
        let image = image(&l.exemplar, now_s);
        let name = l.book.name.as_ref().map(|name| format!(": {name}")).unwrap_or_default();
        let name = l.book.merged_into.map_or(name.clone(), |into| format!("{name}, part of label {into}"));
        let _ = writeln!(
            out,
            "{:>5} {:>8} {:>10.2} {:>+9.2} {:>7.2}  {image}{name}",
            l.id, l.cells, l.area_m2, l.gained_m2, l.weight
        );
    }
    let _ = writeln!(out, "weight of unexplored cells {:.2}", v.orders.utility.exploration);
    out
}

/// Groups of labels as a table.
pub(super) fn groups(groups: &[LabelGroup]) -> String {
    let mut out = format!("{:>5} {:>8} {:>10}  labels\n", "label", "cells", "area m2");
    for group in groups {
        let members: Vec<String> = group.members.iter().map(u8::to_string).collect();
        let name = group.name.as_ref().map(|name| format!(": {name}")).unwrap_or_default();
        let _ = writeln!(
            out,
            "{:>5} {:>8} {:>10.2}  {}{name}",
            group.label,
            group.cells,
            group.area_m2,
            members.join(", ")
        );
    }
    out
}

fn image(e: &ExemplarProgress, now_s: f64) -> String {
    let state = match e.state {
        ExemplarStage::None => return "-".to_owned(),
        ExemplarStage::Receiving => format!("receiving, {:.0} %", 100.0 * e.progress),
        ExemplarStage::Received => match e.images.len() {
            0 | 1 => format!("received, {} bytes", e.bytes.unwrap_or(0)),
            n => format!("{n} received, the latest has {} bytes", e.bytes.unwrap_or(0)),
        },
        ExemplarStage::NotAvailable => "the vehicle has none yet".to_owned(),
        ExemplarStage::Queued => "queued".to_owned(),
        ExemplarStage::OnAir => "on air".to_owned(),
        ExemplarStage::Refused => "refused".to_owned(),
    };
    e.at_s.map_or(state.clone(), |at| format!("{state}, {} ago", span(now_s - at)))
}

/// Who has command, and since when.
pub(super) fn command(command: &CommandState, now_s: f64) -> String {
    let Some(holder) = &command.holder else { return "nobody has it".to_owned() };
    let left = holder.takeable_s - now_s;
    let take = if left > 0.0 { format!("free to take in {}", span(left)) } else { "free to take".to_owned() };
    let (held, idle) = (span(now_s - holder.since_s), span(now_s - holder.last_active_s));
    let client = holder.client.as_ref().filter(|client| !client.is_empty());
    let at = client.map(|client| format!(" ({client})")).unwrap_or_default();
    format!("{}{at} for {held}, last active {idle} ago; {take}", holder.name)
}

/// One line for a change of command.
pub(super) fn command_change(change: &CommandChangeState) -> String {
    let CommandChangeState { by, from, to, .. } = change;
    let [from, to] = [from, to].map(|name| name.as_deref().unwrap_or("nobody"));
    match change.kind {
        CommandChangeName::Taken if from == "nobody" => format!("{by} took command"),
        CommandChangeName::Taken => format!("{by} took command from {from}, who was silent"),
        CommandChangeName::HandedOver => format!("{by} handed command over to {to}"),
        CommandChangeName::Released => format!("{by} gave command up"),
        CommandChangeName::Requested => format!("{by} requested command from {from}"),
        CommandChangeName::Withdrawn => format!("{by} withdrew the request for command"),
        CommandChangeName::Moved => format!("{by} moved command to another client"),
    }
}

pub(super) fn role(role: PrincipalRole) -> &'static str {
    match role {
        PrincipalRole::Viewer => "viewer",
        PrincipalRole::Operator => "operator",
        PrincipalRole::Administrator => "administrator",
    }
}

/// The background streams in order.
pub(super) fn background(link: &LinkSummary) -> String {
    if link.background.is_empty() { "none".to_owned() } else { link.background.join(", then ") }
}

/// Whether the last frame is older than three usual pauses.
pub(super) fn is_silent(v: &VehicleState, state: &MissionState) -> bool {
    !state.mission.ended && state.now_s - v.last_received_s.unwrap_or(0.0) > 3.0 * v.expected_interval_s
}

/// The version and the status of an order.
pub(super) fn order(s: &OrderProgress) -> String {
    let reason = s.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
    format!("version {} {}{reason}", s.version, order_status(s.state))
}

pub(super) fn order_status(state: OrderStatus) -> &'static str {
    match state {
        OrderStatus::Queued => "queued",
        OrderStatus::OnAir => "on air",
        OrderStatus::Received => "received",
        OrderStatus::Applied => "applied",
        OrderStatus::Refused => "refused",
        OrderStatus::Withdrawn => "withdrawn",
    }
}

pub(super) fn mode(mode: ReportedMode) -> &'static str {
    match mode {
        ReportedMode::Survey => "survey",
        ReportedMode::Hold => "hold",
        ReportedMode::Return => "return",
        ReportedMode::Surface => "surface",
        ReportedMode::Abort => "abort",
        ReportedMode::Done => "done",
    }
}

/// A duration in the two largest units.
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
    use scenecast_surface::state::{PlannedPath, ReportedPose};

    #[test]
    fn a_path_is_measured_from_the_vehicle_to_its_last_place() {
        let text = |waypoint, places: &[(f64, f64)], path_continues| {
            path(&report(PlannedPath { path: places.to_vec(), path_continues, waypoint }))
        };
        assert_eq!(text(None, &[], false), None);
        assert_eq!(text(Some((3.0, 5.0)), &[], false).unwrap(), "1 waypoint, 5.0 m");
        let long = text(Some((3.0, 5.0)), &[(3.0, 7.5), (1.0, 7.5)], true).unwrap();
        assert_eq!(long, "3 waypoints, 9.5 m, continues");
    }

    /// A report from (0, 1).
    fn report(plan: PlannedPath) -> StatusReport {
        StatusReport {
            at_s: 0.0,
            pose: ReportedPose { y_m: 1.0, ..ReportedPose::default() },
            mode: ReportedMode::Survey,
            autopilot_silent: false,
            reason: None,
            activity: String::new(),
            plan,
            cells: 0,
            labels: 0,
            budget_bps: 0,
            refused_frames: 0,
            disk: None,
            faults: Vec::new(),
        }
    }

    #[test]
    fn a_disk_is_described_by_refused_files_and_free_space() {
        let text = |journal_refused, checkpoint_refused, free_bytes| {
            disk(&ReportedDisk { journal_refused, checkpoint_refused, free_bytes })
        };
        assert_eq!(text(false, false, Some(1 << 34)), "takes all files, at least 17 GB free");
        assert_eq!(text(true, false, Some(1 << 29)), "REFUSES THE JOURNAL, at least 536 MB free");
        assert_eq!(text(true, true, Some(0)), "REFUSES JOURNAL AND CHECKPOINT, less than 1 MB free");
        assert_eq!(text(false, true, None), "REFUSES THE CHECKPOINT, free space unknown");
    }

    #[test]
    fn durations_have_their_two_largest_units() {
        let spans: Vec<String> = [0.4, 59.6, 3599.0, 3661.0, -1.0].map(super::span).into();
        assert_eq!(spans, ["0 s", "1 min 00 s", "59 min 59 s", "1 h 01 min", "0 s"]);
    }
}
