//! Times in which nothing was heard, and those that a record lacks.

use super::dive::{Dive, DiveVehicle};
use super::words::{counted, median};
use scenecast_core::utc_text;

/// Mission time without a frame that is never told, seconds.
const SHORT_S: f64 = 15.0;
/// A pause is told from so many usual ones on.
const USUAL: f64 = 5.0;
/// Pauses that are told; of more, the longest.
const MAX_TOLD: usize = 6;
/// Mission time without a place in a vehicle's own record from which on it is a gap, seconds.
const MAX_PLACES_APART_S: f64 = 5.0;

/// How often frames of a vehicle were heard and, by its own record, those of the surface on board, with the longer pauses.
pub(super) fn heard(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let Some(last_s) = vehicle.heard_s.last() else { return vec!["No frame from it was heard.".to_owned()] };
    let last = format!(
        "The last frame from it was heard at {}, {} before the end of the record.",
        utc_text(*last_s),
        dive.lasted(dive.surface_s.1 - last_s)
    );
    let surface = format!("The surface heard {}", pauses(dive, &vehicle.heard_s, dive.surface_s));
    let span = vehicle.own.runs_s.first().zip(vehicle.own.runs_s.last()).map(|(first, last)| (first.0, last.1));
    let own = span.map(|span| {
        format!("On board, of what it could use of the surface, it heard {}", pauses(dive, &vehicle.own.heard_s, span))
    });
    [last, surface].into_iter().chain(own).collect()
}

/// Whether the surface has heard nothing for longer than usual.
pub(super) fn has_silence(dive: &Dive, vehicle: &DiveVehicle) -> bool {
    !long(dive, &vehicle.heard_s, dive.surface_s).1.is_empty()
}

/// The usual pause between these moments, mission seconds, if there are any, and begin and end of those that are longer.
fn long(dive: &Dive, times_s: &[f64], (begin_s, end_s): (f64, f64)) -> (Option<f64>, Vec<(f64, f64)>) {
    let times = || times_s.iter().copied();
    let all = std::iter::once(begin_s).chain(times()).zip(times().chain([end_s]));
    let lengths = times().zip(times().skip(1)).map(|(from_s, to_s)| dive.mission_s(to_s - from_s));
    let usual_s = median(&lengths.collect::<Vec<f64>>());
    let least_s = SHORT_S.max(USUAL * usual_s.unwrap_or_default());
    (usual_s, all.filter(|(from_s, to_s)| dive.mission_s(to_s - from_s) >= least_s).collect())
}

/// The rest of a sentence about them.
fn pauses(dive: &Dive, times_s: &[f64], span_s: (f64, f64)) -> String {
    let (usual_s, long) = long(dive, times_s, span_s);
    let all = long.len();
    let told: Vec<String> = longest(long)
        .iter()
        .map(|gap| format!("{} from {} to {}", dive.lasted(gap.1 - gap.0), utc_text(gap.0), utc_text(gap.1)))
        .collect();
    let pauses = match all {
        0 => {
            let pauses = times_s.iter().zip(&times_s[1.min(times_s.len())..]).map(|(a, b)| b - a);
            let longest = pauses.fold(0.0, f64::max);
            format!("the longest pause was {}", dive.lasted(longest))
        }
        n if n > told.len() => format!("with {n} longer pauses, the longest of which were {}", told.join(", ")),
        n => format!("with {}: {}", counted(n, "longer pause", "longer pauses"), told.join(", ")),
    };
    let heard = counted(times_s.len(), "frame", "frames");
    match usual_s {
        Some(_) => format!(
            "{heard}; half of the time, the last one was at most {} old, {pauses}.",
            dive.lasted_tenths(half_of_time_s(times_s, span_s.1))
        ),
        None => format!("{heard}, {pauses}."),
    }
}

/// How old the last of these moments was at most, half of the time from the first one to the end, seconds.
fn half_of_time_s(times_s: &[f64], end_s: f64) -> f64 {
    let times = || times_s.iter().copied();
    let pauses = || times().zip(times().skip(1).chain([end_s])).map(|(from_s, to_s)| (to_s - from_s).max(0.0));
    let half_s = pauses().sum::<f64>() / 2.0;
    let (mut low_s, mut high_s) = (0.0, pauses().fold(0.0, f64::max));
    for _ in 0..40 {
        let age_s = (low_s + high_s) / 2.0;
        let older_s: f64 = pauses().map(|pause_s| (pause_s - age_s).max(0.0)).sum();
        (low_s, high_s) = if older_s > half_s { (age_s, high_s) } else { (low_s, age_s) };
    }
    high_s
}

/// The longest of some times, in their order.
fn longest(mut gaps: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    gaps.sort_by(|a, b| (b.1 - b.0).total_cmp(&(a.1 - a.0)));
    gaps.truncate(MAX_TOLD);
    gaps.sort_by(|a, b| a.0.total_cmp(&b.0));
    gaps
}

/// What the records of both ends lack, but for the times between two runs of a program.
pub(super) fn of_records(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let span = |(from_s, to_s): &(f64, f64)| format!("from {} to {}", utc_text(*from_s), utc_text(*to_s));
    let restarted = |gap: &(f64, f64)| dive.restarts_s.iter().any(|(from_s, to_s)| gap.0 < *to_s && *from_s < gap.1);
    let idle = dive.gaps_s.iter().filter(|gap| !restarted(gap));
    let idle = idle.map(|gap| format!("The surface recorded nothing {}.", span(gap)));
    let pairs = vehicle.own.track.windows(2).map(|pair| (pair[0].at_s, pair[1].at_s));
    let holes = pairs.filter(|(from_s, to_s)| {
        dive.mission_s(to_s - from_s) > MAX_PLACES_APART_S
            && !vehicle.own.pauses().any(|pause| *from_s < pause.1 && pause.0 < *to_s)
    });
    let holes: Vec<(f64, f64)> = holes.collect();
    let more = holes.len().saturating_sub(MAX_TOLD);
    let more = (more > 0).then(|| format!("It has {} of this kind.", counted(more, "shorter gap", "shorter gaps")));
    let holes = longest(holes);
    let stood = holes.iter().map(|gap| {
        format!(
            "The vehicle's own record has no place {}: its program stood still, or nothing measured one.",
            span(gap)
        )
    });
    let unknown = vehicle.own.runs_s.is_empty().then(|| {
        "What went on on board between the frames that were heard is known only as far as the surface learned of it: the vehicle's own record \
         is not among these."
            .to_owned()
    });
    idle.chain(unknown).chain(stood).chain(more).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dive_of(end_s: f64, speed: f64) -> Dive {
        let mut dive = Dive::default();
        (dive.span_s, dive.surface_s, dive.state.mission.speed) = ((0.0, end_s), (0.0, end_s), speed);
        dive
    }

    #[test]
    fn longer_pauses_than_usual_are_told() {
        let dive = dive_of(100.0, 1.0);
        let times: Vec<f64> = (0..=100).filter(|s| !(31..60).contains(s)).map(f64::from).collect();
        let told = "72 frames; half of the time, the last one was at most 0.7 s old, with 1 longer pause: 30 s from 1970-01-01T00:00:30Z to 1970-01-01T00:01:00Z.";
        assert_eq!(pauses(&dive, &times, dive.span_s), told);
        let told_evenly = "30 frames; half of the time, the last one was at most 0.5 s old, the longest pause was 1 s.";
        assert_eq!(pauses(&dive, &times[..30], (0.0, 30.0)), told_evenly);
        let faster = dive_of(10.0, 10.0);
        let times: Vec<f64> = times.iter().map(|s| s / 10.0).collect();
        assert!(
            pauses(&faster, &times, faster.span_s)
                .starts_with("72 frames; half of the time, the last one was at most 0.1 s (0.7 s of the mission) old")
        );
    }

    #[test]
    fn a_vehicle_that_was_hardly_heard_was_silent() {
        let (dive, mut vehicle) = (dive_of(100.0, 1.0), DiveVehicle::default());
        assert_eq!(heard(&dive, &vehicle), ["No frame from it was heard."]);
        assert!(has_silence(&dive, &vehicle));
        vehicle.heard_s = vec![4.0];
        let told =
            "The surface heard 1 frame, with 1 longer pause: 96 s from 1970-01-01T00:00:04Z to 1970-01-01T00:01:40Z.";
        assert_eq!(heard(&dive, &vehicle)[1], told);
        assert!(has_silence(&dive, &vehicle));
    }
}
