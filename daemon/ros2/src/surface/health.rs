//! The health of a vehicle and of its link.

use scenecast_messages::contents::Health;
use scenecast_messages::diagnostic_msgs::DiagnosticStatus;
use scenecast_surface::state::{OrderStatus, ReportedMode, VehicleState};

/// A vehicle is silent after this many of its usual pauses between two frames, as on the page.
const SILENT_PAUSES: f64 = 3.0;

/// The health of link, vehicle, orders and map.
pub(super) fn health(vehicle: &VehicleState, now_s: f64) -> [Health; 4] {
    [link(vehicle, now_s), state(vehicle), orders(vehicle), map(vehicle, now_s)]
}

fn seconds(value: Option<f64>) -> String {
    value.map_or_else(|| "unknown".to_owned(), |s| format!("{s:.1}"))
}

fn link(vehicle: &VehicleState, now_s: f64) -> Health {
    let channel = &vehicle.link;
    let age_s = vehicle.last_received_s.map(|at| now_s - at);
    let is_silent = age_s.is_none_or(|age| age > SILENT_PAUSES * vehicle.expected_interval_s);
    let holder = vehicle.other_surface.as_ref().filter(|other| other.holds);
    let (level, message) = match (&channel.mismatch, age_s) {
        (None, _) if holder.is_some() => {
            let name = holder.map_or("", |holder| holder.name.as_str());
            (DiagnosticStatus::WARN, format!("another surface holds the vehicle: {name}"))
        }
        (Some(mismatch), _) => (DiagnosticStatus::ERROR, format!("the settings of the vehicle do not fit: {mismatch}")),
        (None, None) => (DiagnosticStatus::STALE, "no frame yet".to_owned()),
        (None, Some(age)) if is_silent => (DiagnosticStatus::STALE, format!("silent for {age:.0} s")),
        (None, Some(age)) => (DiagnosticStatus::OK, format!("last frame {age:.0} s ago")),
    };
    let backlog = channel.backlog.as_ref();
    let values = vec![
        ("age_s", seconds(age_s)),
        ("loss_up", format!("{:.3}", channel.up.loss)),
        ("loss_down", format!("{:.3}", channel.down.loss)),
        ("goodput_up_bps", format!("{:.0}", channel.up.goodput_bps)),
        ("goodput_down_bps", format!("{:.0}", channel.down.goodput_bps)),
        ("round_trip_s", seconds(channel.round_trip_s)),
        ("backlog_bits", backlog.map_or_else(|| "unknown".to_owned(), |b| b.bits.to_string())),
        ("map_lag_s", seconds(backlog.and_then(|b| b.map_lag_s))),
    ];
    Health { level, part: "link", message, values }
}

fn state(vehicle: &VehicleState) -> Health {
    let Some(status) = &vehicle.status else {
        let message = "no report yet".to_owned();
        return Health { level: DiagnosticStatus::STALE, part: "vehicle", message, values: Vec::new() };
    };
    let disk = status.disk.unwrap_or_default();
    let fault = match () {
        () if status.autopilot_silent => Some("the autopilot does not answer"),
        () if disk.journal_refused => Some("its journal cannot be written"),
        () if disk.checkpoint_refused => Some("its checkpoint cannot be written"),
        () if status.faults.iter().any(|fault| fault.is_grave) => {
            status.faults.first().map(|fault| fault.text.as_str())
        }
        () => None,
    };
    let is_unusual = matches!(status.mode, ReportedMode::Abort | ReportedMode::Surface | ReportedMode::Return);
    let (level, message) = match fault {
        Some(fault) => (DiagnosticStatus::ERROR, format!("{}: {fault}", status.activity)),
        None if is_unusual => (DiagnosticStatus::WARN, status.activity.clone()),
        None => (DiagnosticStatus::OK, status.activity.clone()),
    };
    let values = vec![
        ("sigma_m", format!("{:.2}", status.pose.sigma_m)),
        ("fix_age_s", seconds(status.pose.fix_age_s)),
        ("depth_m", format!("{:.2}", -status.pose.z_m)),
        ("cells", status.cells.to_string()),
        ("labels", status.labels.to_string()),
        ("budget_bps", status.budget_bps.to_string()),
        ("refused_frames", status.refused_frames.to_string()),
    ];
    Health { level, part: "vehicle", message, values }
}

fn orders(vehicle: &VehicleState) -> Health {
    let slots = &vehicle.orders.directive.slots;
    let refused = slots.iter().find(|slot| slot.state == OrderStatus::Refused || slot.asks);
    let pending = slots.iter().filter(|slot| slot.state.is_pending()).count();
    let (level, message) = match refused {
        Some(slot) => {
            let reason = slot.reason.as_deref().unwrap_or("no reason given");
            let state = if slot.asks { "withdrawn" } else { "refused" };
            (DiagnosticStatus::WARN, format!("{} {} {state}: {reason}", slot.slot, slot.version))
        }
        None if pending > 0 => (DiagnosticStatus::OK, format!("{pending} pending")),
        None => (DiagnosticStatus::OK, "none pending".to_owned()),
    };
    Health { level, part: "orders", message, values: vec![("pending", pending.to_string())] }
}

fn map(vehicle: &VehicleState, now_s: f64) -> Health {
    let map = &vehicle.map;
    let (level, message) = match &map.earlier {
        Some(_) => (DiagnosticStatus::STALE, "the map in view is of an earlier run".to_owned()),
        None => (DiagnosticStatus::OK, format!("{} cells, {} labels", map.explored_cells, vehicle.labels.len())),
    };
    let values = vec![
        ("version", map.version.to_string()),
        ("epoch", map.epoch.to_string()),
        ("cells", map.explored_cells.to_string()),
        ("cell_m", map.cell_m.to_string()),
        ("confirmed_s_ago", seconds(map.updated_s.map(|at| now_s - at))),
    ];
    Health { level, part: "map", message, values }
}
