//! Figures for Prometheus, text format 0.0.4.

use super::server::Shared;
use super::state::{Direction, LifeLine, State as Everything, Vehicle};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use std::fmt::Write;

pub(super) const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Serves the figures.
pub(super) async fn metrics(State(shared): State<Shared>) -> Response {
    let text = text(&shared.snapshots.borrow().state);
    ([(header::CONTENT_TYPE, CONTENT_TYPE)], text).into_response()
}

/// One figure with its samples.
struct Figure<'a>(&'a mut String, &'static str);

impl Figure<'_> {
    fn sample(&mut self, labels: &[(&str, &str)], value: f64) {
        let escaped = |v: &str| v.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        let labels: Vec<String> = labels.iter().map(|(k, v)| format!("{k}=\"{}\"", escaped(v))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(self.0, "{}{labels} {value}", self.1);
    }
}

fn figure<'a>(out: &'a mut String, name: &'static str, kind: &str, help: &str) -> Figure<'a> {
    let _ = writeln!(out, "# HELP {name} {help}\n# TYPE {name} {kind}");
    Figure(out, name)
}

/// A gauge for each vehicle that has the value.
fn each(out: &mut String, state: &Everything, name: &'static str, help: &str, of: impl Fn(&Vehicle) -> Option<f64>) {
    let mut gauge = figure(out, name, "gauge", help);
    for v in &state.vehicles {
        if let Some(value) = of(v) {
            gauge.sample(&[("vehicle", &v.id.to_string())], value);
        }
    }
}

fn text(state: &Everything) -> String {
    let mut out = String::new();
    figure(&mut out, "scenecast_mission_time_seconds", "gauge", "Mission time.").sample(&[], state.now_s);
    link(&mut out, state);
    water(&mut out, state);
    maps(&mut out, state);
    directives(&mut out, state);
    out
}

/// What both directions of the link have.
fn link(out: &mut String, state: &Everything) {
    let link = &state.link;
    let both = |out: &mut String, name, kind, help, of: &dyn Fn(&Direction) -> f64| {
        let mut figure = figure(out, name, kind, help);
        for (direction, d) in [("up", &link.up), ("down", &link.down)] {
            figure.sample(&[("direction", direction)], of(d));
        }
    };
    let mut bits =
        figure(out, "scenecast_link_bits_total", "counter", "Bits on air by class, up as heard, down as sent.");
    for (direction, d) in [("up", &link.up), ("down", &link.down)] {
        for (class, bytes) in &d.bytes_by_class {
            bits.sample(&[("direction", direction), ("class", class)], *bytes as f64 * 8.0);
        }
    }
    let frames = "Frames, up as the vehicles numbered them, down as their fate is known.";
    both(out, "scenecast_link_frames_total", "counter", frames, &|d| d.frames as f64);
    both(out, "scenecast_link_frames_lost_total", "counter", "Frames that were lost.", &|d| d.lost as f64);
    let rate = "Bits on air a second over the last minute.";
    both(out, "scenecast_link_rate_bits_per_second", "gauge", rate, &|d| d.bps_1min);
    let worst = "Most bits on air a second over any window of the budget.";
    both(out, "scenecast_link_worst_window_bits_per_second", "gauge", worst, &|d| d.worst_window_bps);
    let budget = f64::from(link.budget_bps);
    figure(out, "scenecast_link_budget_bits_per_second", "gauge", "Bits on air a second that the surface may send.")
        .sample(&[], budget);
    figure(
        out,
        "scenecast_link_budget_used_ratio",
        "gauge",
        "Share of its budget that the surface used in the last minute.",
    )
    .sample(&[], if budget > 0.0 { link.down.bps_1min / budget } else { 0.0 });
    let mut shares = figure(out, "scenecast_link_share_ratio", "gauge", "Least shares of the classes.");
    for (class, percent) in &link.shares {
        shares.sample(&[("class", class)], f64::from(*percent) / 100.0);
    }
    figure(out, "scenecast_link_strangers_total", "counter", "Frames of no known vehicle, or unreadable.")
        .sample(&[], link.strangers as f64);
    if let Some(bits) = link.backlog_bits {
        figure(out, "scenecast_link_backlog_bits", "gauge", "Bits that wait at the vehicles.").sample(&[], bits as f64);
    }
}

/// The water to each vehicle.
fn water(out: &mut String, state: &Everything) {
    let both = |out: &mut String, name, help, of: &dyn Fn(&super::state::Water) -> f64| {
        let mut figure = figure(out, name, "gauge", help);
        for v in &state.vehicles {
            for (direction, water) in [("up", &v.link.up), ("down", &v.link.down)] {
                figure.sample(&[("vehicle", &v.id.to_string()), ("direction", direction)], of(water));
            }
        }
    };
    both(out, "scenecast_vehicle_loss_ratio", "Share of the last 64 frames that was lost.", &|w| w.loss);
    let goodput = "Useful bits a second over the last minute.";
    both(out, "scenecast_vehicle_goodput_bits_per_second", goodput, &|w| w.goodput_bps);
    let mut dropped = figure(out, "scenecast_vehicle_dropped_total", "counter", "Frames that were dropped, by reason.");
    for v in &state.vehicles {
        for (reason, count) in &v.link.dropped {
            dropped.sample(&[("vehicle", &v.id.to_string()), ("reason", reason)], *count as f64);
        }
    }
    each(out, state, "scenecast_vehicle_round_trip_seconds", "Two-way travel time.", |v| v.link.round_trip_s);
    let heard = "Mission time since a frame was last taken.";
    each(out, state, "scenecast_vehicle_heard_age_seconds", heard, |v| v.heard_s.map(|at| state.now_s - at));
    let expected = "The longest pause between two frames that is usual: three times that is silence.";
    each(out, state, "scenecast_vehicle_expected_interval_seconds", expected, |v| Some(v.expected_interval_s));
    let backlog = "Bits that the vehicle has still to send, by its last report less what has come in since.";
    each(out, state, "scenecast_vehicle_backlog_bits", backlog, |v| Some(v.link.backlog.as_ref()?.bits as f64));
    let own = "Bits on air a second that the vehicle may send, as it says.";
    each(out, state, "scenecast_vehicle_budget_bits_per_second", own, |v| {
        v.status.as_ref().map(|s| f64::from(s.budget_bps))
    });
}

fn maps(out: &mut String, state: &Everything) {
    let age = "Mission time since the vehicle last spoke of its map.";
    each(out, state, "scenecast_map_age_seconds", age, |v| v.map.updated_s.map(|at| state.now_s - at));
    let behind = "Bits by which the map lags behind the vehicle's.";
    each(out, state, "scenecast_map_lag_bits", behind, |v| Some(v.link.backlog.as_ref()?.map_bits as f64));
    let lag = "About how old the map is against the vehicle's.";
    each(out, state, "scenecast_map_lag_seconds", lag, |v| v.link.backlog.as_ref()?.map_lag_s);
    each(out, state, "scenecast_map_cells", "Cells with a label.", |v| Some(f64::from(v.map.explored_cells)));
    each(out, state, "scenecast_map_labels", "Labels on the map.", |v| Some(v.labels.len() as f64));
    let mut versions = figure(out, "scenecast_map_versions_total", "counter", "Changes of the map.");
    for v in &state.vehicles {
        versions.sample(&[("vehicle", &v.id.to_string())], v.map.version as f64);
    }
}

/// The state of each slot: 1 for the one that it is in.
fn directives(out: &mut String, state: &Everything) {
    const STATES: [(LifeLine, &str); 5] = [
        (LifeLine::Queued, "queued"),
        (LifeLine::OnAir, "on_air"),
        (LifeLine::Heard, "heard"),
        (LifeLine::Applied, "applied"),
        (LifeLine::Refused, "refused"),
    ];
    let mut figure = figure(out, "scenecast_directive_state", "gauge", "State of the newest order: 1 where it is.");
    for v in &state.vehicles {
        for slot in &v.directive.slots {
            for (life, name) in STATES {
                let labels = [("vehicle", &*v.id.to_string()), ("slot", &*slot.slot), ("state", name)];
                figure.sample(&labels, f64::from(u8::from(slot.state == life)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_quotes_stays_one_label() {
        let mut out = String::new();
        figure(&mut out, "x_total", "counter", "X.").sample(&[("reason", "a\"b\\c\nd")], 1.5);
        assert_eq!(out, "# HELP x_total X.\n# TYPE x_total counter\nx_total{reason=\"a\\\"b\\\\c\\nd\"} 1.5\n");
    }
}
