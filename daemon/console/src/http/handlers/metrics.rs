//! Metrics for Prometheus, text format 0.0.4.
//!
//! The crate `prometheus-client` writes only OpenMetrics, which readers of 0.0.4 reject. It would also need the same
//! descriptions.

use crate::http::shared::Shared;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use scenecast_surface::state::{ChannelQuality, LinkDirection, MissionState, OrderStatus, VehicleState};
use std::fmt::Write;

pub(in crate::http) const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

pub(in crate::http) async fn metrics(State(shared): State<Shared>) -> Response {
    let text = text(&shared.snapshots.borrow().state);
    ([(header::CONTENT_TYPE, CONTENT_TYPE)], text).into_response()
}

/// One metric with its samples.
struct Metric<'a>(&'a mut String, &'static str);

impl Metric<'_> {
    fn sample(&mut self, labels: &[(&str, &str)], value: f64) {
        let escaped = |v: &str| v.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        let labels: Vec<String> = labels.iter().map(|(k, v)| format!("{k}=\"{}\"", escaped(v))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(self.0, "{}{labels} {value}", self.1);
    }
}

fn metric<'a>(out: &'a mut String, name: &'static str, kind: &str, help: &str) -> Metric<'a> {
    let _ = writeln!(out, "# HELP {name} {help}\n# TYPE {name} {kind}");
    Metric(out, name)
}

/// A gauge for each vehicle that has the value.
fn each(
    out: &mut String,
    state: &MissionState,
    name: &'static str,
    help: &str,
    of: impl Fn(&VehicleState) -> Option<f64>,
) {
    let mut gauge = metric(out, name, "gauge", help);
    for v in &state.vehicles {
        if let Some(value) = of(v) {
            gauge.sample(&[("vehicle", &v.id.to_string())], value);
        }
    }
}

fn text(state: &MissionState) -> String {
    let mut out = String::new();
    metric(&mut out, "scenecast_mission_time_seconds", "gauge", "Mission time.").sample(&[], state.now_s);
    link(&mut out, state);
    channels(&mut out, state);
    maps(&mut out, state);
    directives(&mut out, state);
    out
}

fn link(out: &mut String, state: &MissionState) {
    let link = &state.link;
    let both = |out: &mut String, name, kind, help, of: &dyn Fn(&LinkDirection) -> f64| {
        let mut metric = metric(out, name, kind, help);
        for (direction, d) in [("up", &link.up), ("down", &link.down)] {
            metric.sample(&[("direction", direction)], of(d));
        }
    };
    let mut bits =
        metric(out, "scenecast_link_bits_total", "counter", "Bits on air by class, up as received, down as sent.");
    for (direction, d) in [("up", &link.up), ("down", &link.down)] {
        for (class, bytes) in &d.bytes_by_class {
            bits.sample(&[("direction", direction), ("class", class)], *bytes as f64 * 8.0);
        }
    }
    let frames = "Frames, up by the numbers of the vehicles, down as far as their fate is known.";
    both(out, "scenecast_link_frames_total", "counter", frames, &|d| d.frames as f64);
    both(out, "scenecast_link_frames_lost_total", "counter", "Frames that were lost.", &|d| d.lost as f64);
    let rate = "Rate on air in the last minute.";
    both(out, "scenecast_link_rate_bits_per_second", "gauge", rate, &|d| d.bps_1min);
    let max = "Highest rate on air in any window of the budget.";
    both(out, "scenecast_link_max_window_bits_per_second", "gauge", max, &|d| d.max_window_bps);
    let budget = f64::from(link.budget_bps);
    metric(out, "scenecast_link_budget_bits_per_second", "gauge", "Bit budget of the surface on air.")
        .sample(&[], budget);
    metric(
        out,
        "scenecast_link_budget_used_ratio",
        "gauge",
        "Share of its bit budget that the surface used in the last minute.",
    )
    .sample(&[], if budget > 0.0 { link.down.bps_1min / budget } else { 0.0 });
    let mut shares = metric(out, "scenecast_link_share_ratio", "gauge", "Minimum shares of the classes.");
    for (class, percent) in &link.shares {
        shares.sample(&[("class", class)], f64::from(*percent) / 100.0);
    }
    metric(
        out,
        "scenecast_link_unknown_senders_total",
        "counter",
        "Frames that were malformed or of an unknown vehicle.",
    )
    .sample(&[], link.unknown_senders as f64);
    let energy = [("up", link.up.energy_j), ("down", link.down.energy_j)];
    if energy.iter().any(|(_, joules)| joules.is_some()) {
        let help = "Energy that modems have transmitted with, estimated for the vehicles.";
        let mut metric = metric(out, "scenecast_link_energy_joules", "gauge", help);
        for (direction, joules) in energy {
            joules.into_iter().for_each(|j| metric.sample(&[("direction", direction)], j));
        }
    }
    if let Some(bits) = link.backlog_bits {
        metric(out, "scenecast_link_backlog_bits", "gauge", "Bits that wait at the vehicles.").sample(&[], bits as f64);
    }
}

/// The channel to each vehicle.
fn channels(out: &mut String, state: &MissionState) {
    let both = |out: &mut String, name, help, of: &dyn Fn(&ChannelQuality) -> f64| {
        let mut metric = metric(out, name, "gauge", help);
        for v in &state.vehicles {
            for (direction, quality) in [("up", &v.link.up), ("down", &v.link.down)] {
                metric.sample(&[("vehicle", &v.id.to_string()), ("direction", direction)], of(quality));
            }
        }
    };
    both(out, "scenecast_vehicle_loss_ratio", "Share of the last 64 frames that was lost.", &|q| q.loss);
    let goodput = "Rate of useful payload in the last minute.";
    both(out, "scenecast_vehicle_goodput_bits_per_second", goodput, &|q| q.goodput_bps);
    let mut dropped = metric(out, "scenecast_vehicle_dropped_total", "counter", "Frames that were dropped, by reason.");
    for v in &state.vehicles {
        for (reason, count) in &v.link.dropped {
            dropped.sample(&[("vehicle", &v.id.to_string()), ("reason", reason)], *count as f64);
        }
    }
    each(out, state, "scenecast_vehicle_round_trip_seconds", "Two-way travel time.", |v| v.link.round_trip_s);
    let received = "Mission time since the last valid frame.";
    each(out, state, "scenecast_vehicle_last_received_age_seconds", received, |v| {
        v.last_received_s.map(|at| state.now_s - at)
    });
    let expected = "Longest usual pause between two frames; a vehicle is silent after three times this pause.";
    each(out, state, "scenecast_vehicle_expected_interval_seconds", expected, |v| Some(v.expected_interval_s));
    let backlog = "Bits that the vehicle still has to send, by its last report less the bits received since.";
    each(out, state, "scenecast_vehicle_backlog_bits", backlog, |v| Some(v.link.backlog.as_ref()?.bits as f64));
    let own = "Bit budget of the vehicle on air, as it reports.";
    each(out, state, "scenecast_vehicle_budget_bits_per_second", own, |v| {
        v.status.as_ref().map(|s| f64::from(s.budget_bps))
    });
}

fn maps(out: &mut String, state: &MissionState) {
    let age = "Mission time since the vehicle last confirmed its map.";
    each(out, state, "scenecast_map_age_seconds", age, |v| v.map.updated_s.map(|at| state.now_s - at));
    let behind = "Bits of labels that the vehicle still has to send.";
    each(out, state, "scenecast_map_lag_bits", behind, |v| Some(v.link.backlog.as_ref()?.map_bits as f64));
    let lag = "Approximate lag of the map behind the vehicle's.";
    each(out, state, "scenecast_map_lag_seconds", lag, |v| v.link.backlog.as_ref()?.map_lag_s);
    each(out, state, "scenecast_map_cells", "Cells with a label.", |v| Some(f64::from(v.map.explored_cells)));
    each(out, state, "scenecast_map_labels", "Labels on the map.", |v| Some(v.labels.len() as f64));
    let mut versions = metric(out, "scenecast_map_versions_total", "counter", "Changes of the map.");
    for v in &state.vehicles {
        versions.sample(&[("vehicle", &v.id.to_string())], v.map.version as f64);
    }
}

/// The status of the latest order in each slot, one sample for each status.
fn directives(out: &mut String, state: &MissionState) {
    const STATES: [(OrderStatus, &str); 6] = [
        (OrderStatus::Queued, "queued"),
        (OrderStatus::OnAir, "on_air"),
        (OrderStatus::Received, "received"),
        (OrderStatus::Applied, "applied"),
        (OrderStatus::Refused, "refused"),
        (OrderStatus::Withdrawn, "withdrawn"),
    ];
    let mut metric =
        metric(out, "scenecast_directive_state", "gauge", "Status of the latest order: 1 for the present one.");
    for v in &state.vehicles {
        for slot in &v.orders.directive.slots {
            for (status, name) in STATES {
                let labels = [("vehicle", &*v.id.to_string()), ("slot", &*slot.slot), ("state", name)];
                metric.sample(&labels, f64::from(u8::from(slot.state == status)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_with_quotes_is_escaped() {
        let mut out = String::new();
        metric(&mut out, "x_total", "counter", "X.").sample(&[("reason", "a\"b\\c\nd")], 1.5);
        assert_eq!(out, "# HELP x_total X.\n# TYPE x_total counter\nx_total{reason=\"a\\\"b\\\\c\\nd\"} 1.5\n");
    }
}
