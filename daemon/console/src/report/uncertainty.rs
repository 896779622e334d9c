//! How well the place of a vehicle was known over a dive.

use super::dive::DiveVehicle;
use super::track_point::TrackPoint;
use super::words::{self, metres};
use scenecast_core::utc_text;

/// What the uncertainty of a place is.
const WITHIN: &str =
    "the uncertainty of its place on the earth (east and north each are within it with a probability of 68 %) was";
/// From these on, the least and the greatest uncertainty are too far apart for one figure: times the least, and metres.
const FAR_APART: f64 = 2.0;
const FAR_APART_M: f64 = 1.0;
/// The uncertainties of a level are no farther apart than this factor.
const LEVEL: f64 = 1.5;
/// Of more levels, the ends alone are told.
const MAX_LEVELS: usize = 4;

/// A time in which the uncertainty stayed about the same.
struct Level {
    from_s: f64,
    to_s: f64,
    least_m: f64,
    most_m: f64,
}

/// The uncertainty of its place over the record; empty where none is known.
pub(super) fn told(vehicle: &DiveVehicle) -> String {
    let known = vehicle.path().iter().filter(|point| point.sigma_m.is_finite());
    let known: Vec<&TrackPoint> = known.collect();
    let sigmas: Vec<f64> = known.iter().map(|point| point.sigma_m).collect();
    let (Some(median_m), Some(last_m)) = (words::median(&sigmas), sigmas.last()) else { return String::new() };
    if !vehicle.measures_sigma() {
        return format!(
            " The uncertainty of its place on the earth was not measured: it stayed at {last_m:.2} m, as it began."
        );
    }
    let by_sigma = |a: &&&TrackPoint, b: &&&TrackPoint| a.sigma_m.total_cmp(&b.sigma_m);
    let (Some(least), Some(most)) = (known.iter().min_by(by_sigma), known.iter().max_by(by_sigma)) else {
        return String::new();
    };
    let checked = if vehicle.has_fixes() { "" } else { ", which nothing has checked" };
    let begin = format!(" By its own estimate{checked}, {WITHIN}");
    let range = metres(least.sigma_m, most.sigma_m);
    if !range.contains("to") {
        return format!("{begin} {range}.");
    }
    if most.sigma_m < FAR_APART * least.sigma_m || most.sigma_m - least.sigma_m < FAR_APART_M {
        return format!("{begin} {range}, {median_m:.1} m or less half of the time, and {last_m:.1} m at the end.");
    }
    let levels = levels(&known);
    if levels.len() > MAX_LEVELS {
        return format!(
            "{begin} {:.1} m at the least, at {}, and {:.1} m at the most, at {}; it was {median_m:.1} m or less half of the time, and \
             {last_m:.1} m at the end.",
            least.sigma_m,
            utc_text(least.at_s),
            most.sigma_m,
            utc_text(most.at_s)
        );
    }
    let each = levels.iter().map(|level| {
        format!("{} from {} to {}", metres(level.least_m, level.most_m), utc_text(level.from_s), utc_text(level.to_s))
    });
    format!("{begin} {}.", each.collect::<Vec<_>>().join(", and "))
}

/// How much less was known of its place after its program had not run, the end of a sentence; empty where about as much was.
pub(super) fn lost(vehicle: &DiveVehicle, (stopped_s, began_s): (f64, f64)) -> String {
    let mut known = vehicle.path().iter().filter(|point| point.sigma_m.is_finite());
    let before_m = known.clone().rfind(|point| point.at_s <= stopped_s).map(|point| point.sigma_m);
    let after_m = known.find(|point| point.at_s >= began_s).map(|point| point.sigma_m);
    match before_m.zip(after_m) {
        Some((before_m, after_m)) if after_m >= FAR_APART * before_m && after_m - before_m >= FAR_APART_M => {
            format!("; the uncertainty of its place was {before_m:.1} m before and {after_m:.1} m after")
        }
        _ => String::new(),
    }
}

/// The levels of the uncertainty, one after the other.
fn levels(known: &[&TrackPoint]) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    for TrackPoint { at_s, sigma_m, .. } in known {
        match levels.last_mut() {
            Some(level) if level.most_m.max(*sigma_m) <= LEVEL * level.least_m.min(*sigma_m) => {
                (level.to_s, level.least_m) = (*at_s, level.least_m.min(*sigma_m));
                level.most_m = level.most_m.max(*sigma_m);
            }
            _ => levels.push(Level { from_s: *at_s, to_s: *at_s, least_m: *sigma_m, most_m: *sigma_m }),
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told_of(sigmas: impl IntoIterator<Item = f64>) -> String {
        let place = |(n, sigma_m): (usize, f64)| TrackPoint {
            at_s: n as f64,
            east_m: 0.0,
            north_m: 0.0,
            depth_m: 0.0,
            sigma_m,
        };
        let track = sigmas.into_iter().enumerate().map(place).collect();
        told(&DiveVehicle { track, ..DiveVehicle::default() })
    }

    #[test]
    fn a_place_that_a_restart_lost_is_told() {
        let place = |(at_s, sigma_m)| TrackPoint { at_s, east_m: 0.0, north_m: 0.0, depth_m: 0.0, sigma_m };
        let track = [(1.0, 1.0), (5.0, 1.0), (9.0, 50.0)].map(place).to_vec();
        let vehicle = DiveVehicle { track, ..DiveVehicle::default() };
        assert_eq!(lost(&vehicle, (5.5, 8.0)), "; the uncertainty of its place was 1.0 m before and 50.0 m after");
        assert_eq!(lost(&vehicle, (2.0, 4.0)), "");
    }

    #[test]
    fn an_uncertainty_that_steps_up_is_told_with_its_times() {
        let after_a_restart = told_of([1.0; 4].into_iter().chain([50.0; 6]));
        let levels = "was 1.0 m from 1970-01-01T00:00:00Z to 1970-01-01T00:00:03Z, and 50.0 m from 1970-01-01T00:00:04Z to 1970-01-01T00:00:09Z.";
        assert!(after_a_restart.ends_with(levels), "{after_a_restart}");
        let drifting = told_of((1..40).map(f64::from));
        let ends = "was 1.0 m at the least, at 1970-01-01T00:00:00Z, and 39.0 m at the most, at 1970-01-01T00:00:38Z; it was 20.0 m or less half \
                    of the time, and 39.0 m at the end.";
        assert!(drifting.ends_with(ends), "{drifting}");
        let steady = told_of([1.0, 0.4, 0.4, 0.4]);
        assert!(
            steady.ends_with("was 0.4 to 1.0 m, 0.4 m or less half of the time, and 0.4 m at the end."),
            "{steady}"
        );
        assert!(told_of([50.0; 12]).ends_with("was 50.0 m."));
    }
}
