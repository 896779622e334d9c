//! Times in which nothing was heard, and those that a record lacks.

use super::dive::{Dive, DiveVehicle};
use super::words::{counted, duration};
use scenecast_core::utc_text;

/// Mission time without a frame that is never told, seconds.
const SHORT_S: f64 = 15.0;
/// A pause is told from so many usual ones on.
const USUAL: f64 = 5.0;
/// Pauses that are told; of more, the longest.
const MAX_TOLD: usize = 6;
/// Time without a place in a vehicle's own record from which on it is a gap, seconds.
const MAX_PLACES_APART_S: f64 = 5.0;

/// How often frames of a vehicle were heard, and its own record says how often it heard some, with the longer pauses.
pub(super) fn heard(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let Some(last_s) = vehicle.heard_s.last() else { return vec!["No frame from it was heard.".to_owned()] };
    let last = format!(
        "The last frame from it was heard at {}, {} before the end of the record.",
        utc_text(*last_s),
        duration(dive.mission_s(dive.span_s.1 - last_s))
    );
    let surface =
        pauses(dive, &vehicle.heard_s, dive.span_s).map(|pauses| format!("The surface heard a frame from it {pauses}"));
    let span = vehicle.own.runs_s.first().zip(vehicle.own.runs_s.last()).map(|(first, last)| (first.0, last.1));
    let own = span.and_then(|span| pauses(dive, &vehicle.own.heard_s, span));
    let own = own.map(|pauses| format!("On board, a frame of the surface was heard {pauses}"));
    [last].into_iter().chain(surface).chain(own).collect()
}

/// Whether the surface has heard nothing for longer than usual.
pub(super) fn has_silence(dive: &Dive, vehicle: &DiveVehicle) -> bool {
    long(dive, &vehicle.heard_s, dive.span_s).is_some_and(|(_, long)| !long.is_empty())
}

/// The usual pause between these moments, mission seconds, and begin and end of those that are longer.
fn long(dive: &Dive, times_s: &[f64], (begin_s, end_s): (f64, f64)) -> Option<(f64, Vec<(f64, f64)>)> {
    let times = || times_s.iter().copied();
    let all: Vec<(f64, f64)> = std::iter::once(begin_s).chain(times()).zip(times().chain([end_s])).collect();
    let mut lengths: Vec<f64> = times_s.windows(2).map(|pair| dive.mission_s(pair[1] - pair[0])).collect();
    lengths.sort_by(f64::total_cmp);
    let usual_s = *lengths.get(lengths.len() / 2)?;
    let least_s = SHORT_S.max(USUAL * usual_s);
    Some((usual_s, all.into_iter().filter(|(from_s, to_s)| dive.mission_s(to_s - from_s) >= least_s).collect()))
}

/// The rest of a sentence about them.
fn pauses(dive: &Dive, times_s: &[f64], span_s: (f64, f64)) -> Option<String> {
    let (usual_s, mut long) = long(dive, times_s, span_s)?;
    let all = long.len();
    long.sort_by(|a, b| (b.1 - b.0).total_cmp(&(a.1 - a.0)));
    long.truncate(MAX_TOLD);
    long.sort_by(|a, b| a.0.total_cmp(&b.0));
    let told = |(from_s, to_s): &(f64, f64)| {
        let length = duration(dive.mission_s(to_s - from_s));
        format!("{length} from {} to {}", utc_text(*from_s), utc_text(*to_s))
    };
    let told: Vec<String> = long.iter().map(told).collect();
    let pauses = match all {
        0 => "without a much longer pause".to_owned(),
        n if n > told.len() => format!("with {n} longer pauses, the longest of which were {}", told.join(", ")),
        n => format!("with {}: {}", counted(n, "longer pause", "longer pauses"), told.join(", ")),
    };
    Some(format!("every {usual_s:.1} s as a rule, {pauses}."))
}

/// What the records of both ends lack, and why.
pub(super) fn of_records(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let span = |(from_s, to_s): &(f64, f64)| format!("from {} to {}", utc_text(*from_s), utc_text(*to_s));
    let restarted = |gap: &(f64, f64)| dive.restarts_s.iter().any(|(from_s, to_s)| gap.0 < *to_s && *from_s < gap.1);
    let surface = dive.restarts_s.iter().map(|gap| {
        format!("The surface's program ended and was started again: nothing is recorded there {}.", span(gap))
    });
    let idle = dive.gaps_s.iter().filter(|gap| !restarted(gap));
    let idle = idle.map(|gap| format!("The surface recorded nothing {}.", span(gap)));
    let runs = vehicle.own.runs_s.windows(2).map(|pair| (pair[0].1, pair[1].0));
    let vehicle_ended = runs.clone().map(|gap| {
        format!(
            "The vehicle's program ended and began again: its own record has nothing {}, and what it had not stored by then is lost on board.",
            span(&gap)
        )
    });
    let pairs = vehicle.own.track.windows(2).map(|pair| (pair[0].at_s, pair[1].at_s));
    let holes = pairs.filter(|(from_s, to_s)| {
        to_s - from_s > MAX_PLACES_APART_S && !runs.clone().any(|run| *from_s < run.1 && run.0 < *to_s)
    });
    let holes: Vec<(f64, f64)> = holes.collect();
    let stood = holes.iter().take(MAX_TOLD).map(|gap| {
        format!(
            "The vehicle's own record has no place {}: its program stood still, or nothing measured one.",
            span(gap)
        )
    });
    surface.chain(idle).chain(vehicle_ended).chain(stood).collect()
}
