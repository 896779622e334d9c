//! What a vehicle knew, as the page shows it.

use crate::recording::Known;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_protocol::wire::VehicleMode;
use scenecast_surface::state::{MapLabel, PlannedPath, ReportedMode, ReportedPose, StatusReport, VehicleState};
use std::collections::BTreeMap;

/// Places of a track at most, and seconds between two of them.
const MAX_TRACK: usize = 500;
const TRACK_INTERVAL_NANOS: u64 = 5_000_000_000;

/// Shows a vehicle where it knew itself to be at a moment. `mission_s` gives mission times.
pub(super) fn show(state: &mut VehicleState, known: &Known, nanos: u64, mission_s: impl Fn(u64) -> f64) {
    let upto = known.poses.partition_point(|(at, _)| *at <= nanos);
    let Some((at, pose)) = known.poses.get(..upto).and_then(<[_]>::last) else { return };
    state.last_received_s = Some(mission_s(*at));
    let mut track = Vec::new();
    let mut next = u64::MAX;
    for (at, pose) in known.poses[..upto].iter().rev() {
        if *at <= next {
            track.push((mission_s(*at), pose.pose.pose.position.x, pose.pose.pose.position.y));
            next = at.saturating_sub(TRACK_INTERVAL_NANOS);
        }
        if track.len() == MAX_TRACK {
            break;
        }
    }
    track.reverse();
    state.track = track;
    let (mode, activity) = mode(known, nanos);
    let before = state.status.take();
    state.status = Some(StatusReport {
        at_s: mission_s(*at),
        pose: reported(pose),
        mode,
        activity,
        autopilot_silent: false,
        reason: None,
        // The operator knew the plan of the last report only.
        plan: PlannedPath::default(),
        cells: state.map.explored_cells,
        labels: state.labels.len() as u32,
        budget_bps: before.as_ref().map_or(0, |status| status.budget_bps),
        refused_frames: before.as_ref().map_or(0, |status| status.refused_frames),
        disk: before.and_then(|status| status.disk),
        faults: Vec::new(),
    });
}

fn reported(message: &PoseWithCovarianceStamped) -> ReportedPose {
    let (position, turn) = (&message.pose.pose.position, &message.pose.pose.orientation);
    let from_east = 2.0 * turn.z.atan2(turn.w).to_degrees();
    ReportedPose {
        x_m: position.x,
        y_m: position.y,
        z_m: position.z,
        heading_deg: (90.0 - from_east).rem_euclid(360.0),
        sigma_m: message.pose.covariance.first().map_or(0.0, |variance| variance.sqrt()),
        fix_age_s: None,
    }
}

/// The mode that the vehicle recorded last, and its text.
fn mode(known: &Known, nanos: u64) -> (ReportedMode, String) {
    let upto = known.events.partition_point(|(at, _)| *at <= nanos);
    let last = known.events[..upto].iter().rev().find(|(_, event)| event.source == "mode");
    let text = last.map_or(VehicleMode::default().name(), |(_, event)| &event.text);
    let name = text.split_once(": ").map_or(text, |(name, _)| name);
    (VehicleMode::from_name(name).unwrap_or_default().into(), text.to_owned())
}

/// Shows the labels of a map with these numbers of cells; of what else is known of them, nothing changes.
pub(super) fn recount(state: &mut VehicleState, counts: &BTreeMap<u8, u32>) {
    let area_m2 = state.map.cell_m * state.map.cell_m;
    let mut known: BTreeMap<u8, MapLabel> = state.labels.drain(..).map(|label| (label.id, label)).collect();
    state.labels = counts
        .iter()
        .map(|(&id, &cells)| {
            let book = state.label_book.get(&id).cloned().unwrap_or_default();
            let label = known.remove(&id).unwrap_or_else(|| MapLabel { id, book, ..MapLabel::default() });
            MapLabel { cells, area_m2: f64::from(cells) * area_m2, ..label }
        })
        .collect();
    state.map.explored_cells = counts.values().sum();
}
