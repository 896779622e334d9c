//! Times in which nothing was heard, and those that a record lacks.

use super::dive::{Dive, DiveVehicle};
use super::words::{counted, median};
use scenecast_core::utc_text;

/// Mission time without a frame that is no silence, seconds.
const SHORT_S: f64 = 30.0;
/// A silence is as long as so many usual pauses.
const USUAL: f64 = 5.0;
/// Silences and gaps that are told; of more, the longest.
const MAX_TOLD: usize = 6;
/// Mission time without a place in a vehicle's own record that is no gap, however often it has one, seconds.
const NO_GAP_S: f64 = 10.0;

/// How often frames of a vehicle were heard and, by its own record, those of the surface on board.
pub(super) fn heard(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let Some(last_s) = vehicle.heard_s.last() else { return vec!["No frame from it was heard.".to_owned()] };
    let before_end_s = dive.surface_s.1 - last_s;
    let last = match before_end_s < 1.0 {
        true => "The last frame from it was heard at the end of the record.".to_owned(),
        false => format!(
            "The last frame from it was heard at {}, {} before the end of the record.",
            utc_text(*last_s),
            dive.lasted(before_end_s)
        ),
    };
    let surface = format!("At the surface, {}", age(dive, &vehicle.heard_s, dive.surface_s.1));
    let own = vehicle.own.runs_s.last().map(|run| {
        format!("On board, of frames of the surface that it could use: {}", age(dive, &vehicle.own.heard_s, run.1))
    });
    [last, surface].into_iter().chain(own).collect()
}

/// Begin and end of the pauses between these moments that are longer than usual.
fn long(dive: &Dive, times_s: &[f64], (begin_s, end_s): (f64, f64)) -> Vec<(f64, f64)> {
    let times = || times_s.iter().copied();
    let all = std::iter::once(begin_s).chain(times()).zip(times().chain([end_s]));
    let lengths = times().zip(times().skip(1)).map(|(from_s, to_s)| dive.mission_s(to_s - from_s));
    let usual_s = median(&lengths.collect::<Vec<f64>>());
    let least_s = SHORT_S.max(USUAL * usual_s.unwrap_or_default());
    all.filter(|(from_s, to_s)| dive.mission_s(to_s - from_s) >= least_s).collect()
}

/// Begin and end of the times in which the surface heard nothing of a vehicle for longer than usual.
pub(super) fn silences(dive: &Dive, vehicle: &DiveVehicle) -> Vec<(f64, f64)> {
    long(dive, &vehicle.heard_s, dive.surface_s)
}

/// The silences at the surface and, by the vehicle's own record, on board, with their begins: each once, in words.
pub(super) fn told(dive: &Dive, vehicle: &DiveVehicle) -> Vec<(f64, String)> {
    let all = silences(dive, vehicle);
    let more = all.len().saturating_sub(MAX_TOLD);
    let at_surface = longest(all);
    let runs_s = &vehicle.own.runs_s;
    let span = runs_s.first().zip(runs_s.last()).map(|(first, last)| (first.0, last.1));
    let on_board = longest(span.map_or_else(Vec::new, |span| long(dive, &vehicle.own.heard_s, span)));
    let meets = |a: &(f64, f64), b: &(f64, f64)| a.0 < b.1 && b.0 < a.1;
    let until = |gap: &(f64, f64)| format!("until {}, for {}", utc_text(gap.1), dive.lasted(gap.1 - gap.0));
    let mut told: Vec<(f64, String)> = Vec::new();
    for gap in &at_surface {
        let own = on_board.iter().filter(|own| meets(own, gap));
        let own = own
            .map(|own| format!("; on board nothing of the surface was heard from {} {}", utc_text(own.0), until(own)));
        let what = if gap.0 <= dive.surface_s.0 { "had not heard it yet" } else { "heard nothing from it" };
        let ran = match dive.restarts_s.iter().any(|pause| meets(pause, gap)) {
            true => ", for a part of which its own program did not run",
            false => "",
        };
        told.push((gap.0, format!("the surface {what} {}{ran}{}", until(gap), own.collect::<String>())));
    }
    let alone = on_board.iter().filter(|own| !at_surface.iter().any(|gap| meets(own, gap)));
    told.extend(alone.map(|own| (own.0, format!("on board nothing of the surface was heard {}", until(own)))));
    if more > 0 {
        told.push((dive.surface_s.1, format!("by then {}", counted(more, "shorter silence", "shorter silences"))));
    }
    told
}

/// How old the last of these moments was, the rest of a sentence.
fn age(dive: &Dive, times_s: &[f64], end_s: f64) -> String {
    match times_s.len() {
        0 => "no frame was heard.".to_owned(),
        1 => "one frame was heard.".to_owned(),
        _ => format!(
            "half of the time, the last frame was heard at most {} earlier.",
            dive.lasted_tenths(half_of_time_s(times_s, end_s))
        ),
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
    let places: Vec<f64> = vehicle.own.track.iter().map(|point| point.at_s).collect();
    let least_s = NO_GAP_S.max(dive.mission_s(unusual_s(&places)));
    let pairs = places.windows(2).map(|pair| (pair[0], pair[1]));
    let holes = pairs.filter(|(from_s, to_s)| {
        dive.mission_s(to_s - from_s) > least_s
            && !vehicle.own.pauses().any(|pause| *from_s < pause.1 && pause.0 < *to_s)
    });
    let holes: Vec<(f64, f64)> = holes.collect();
    let more = holes.len().saturating_sub(MAX_TOLD);
    let more = (more > 0).then(|| format!("It has {} of this kind.", counted(more, "shorter gap", "shorter gaps")));
    let holes = longest(holes);
    let stood = holes.iter().map(|gap| {
        format!(
            "The vehicle's own record has no place {}, for {}: its program stood still, or nothing measured one.",
            span(gap),
            dive.lasted(gap.1 - gap.0)
        )
    });
    let unknown = vehicle.own.runs_s.is_empty().then(|| {
        "What happened on board between the frames that were heard is known only as far as the surface learned of it: the vehicle's own record \
         is not among these."
            .to_owned()
    });
    idle.chain(unknown).chain(stood).chain(more).collect()
}

/// How much later than the one before a moment of a row must be to be unusually late: several times what 95 % of them take.
pub(super) fn unusual_s(times_s: &[f64]) -> f64 {
    const TIMES: f64 = 4.0;
    let mut apart: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    apart.sort_by(f64::total_cmp);
    // Of a few, the longest ones may be gaps.
    let usual = apart.get((apart.len() * 19 / 20).min(apart.len().saturating_sub(2)));
    usual.map_or(f64::INFINITY, |usual_s| TIMES * usual_s)
}

#[cfg(test)]
mod tests {
    use super::super::dive::OwnRecord;
    use super::super::track_point::TrackPoint;
    use super::*;

    fn dive_of(end_s: f64, speed: f64) -> Dive {
        let mut dive = Dive::default();
        (dive.span_s, dive.surface_s, dive.state.mission.speed) = ((0.0, end_s), (0.0, end_s), speed);
        dive
    }

    #[test]
    fn a_silence_has_one_begin_end_and_length() {
        let dive = dive_of(100.0, 2.0);
        let times: Vec<f64> = (0..=100).filter(|s| !(31..60).contains(s)).map(f64::from).collect();
        let mut vehicle = DiveVehicle { heard_s: times, ..DiveVehicle::default() };
        let at_surface = "the surface heard nothing from it until 1970-01-01T00:01:00Z, for 30 s (60 s of the mission)";
        assert_eq!(told(&dive, &vehicle), [(30.0, at_surface.to_owned())]);
        let age =
            "At the surface, half of the time, the last frame was heard at most 0.7 s (1.4 s of the mission) earlier.";
        assert_eq!(heard(&dive, &vehicle)[1], age);
        vehicle.own.runs_s = vec![(0.0, 100.0)];
        vehicle.own.heard_s = (0..=100).filter(|s| !(26..62).contains(s)).map(f64::from).collect();
        let on_board = "; on board nothing of the surface was heard from 1970-01-01T00:00:25Z until 1970-01-01T00:01:02Z, for 37 s (74 s of the \
                        mission)";
        assert_eq!(told(&dive, &vehicle), [(30.0, format!("{at_surface}{on_board}"))]);
    }

    #[test]
    fn a_vehicle_that_was_hardly_heard_was_silent() {
        let (dive, mut vehicle) = (dive_of(100.0, 1.0), DiveVehicle::default());
        assert_eq!(heard(&dive, &vehicle), ["No frame from it was heard."]);
        let begin = told(&dive, &vehicle);
        assert_eq!(begin, [(0.0, "the surface had not heard it yet until 1970-01-01T00:01:40Z, for 100 s".to_owned())]);
        vehicle.heard_s = vec![4.0];
        assert_eq!(silences(&dive, &vehicle), [(4.0, 100.0)]);
    }

    #[test]
    fn a_place_that_comes_a_little_late_is_no_gap() {
        let dive = dive_of(100.0, 4.0);
        let track = |late_s: f64| {
            let at = |n: u32| f64::from(n) * 0.5 + if n > 50 { late_s } else { 0.0 };
            let place = |n| TrackPoint { at_s: at(n), east_m: 0.0, north_m: 0.0, depth_m: 0.0, sigma_m: 1.0 };
            let own =
                OwnRecord { track: (0..100).map(place).collect(), runs_s: vec![(0.0, 100.0)], ..OwnRecord::default() };
            of_records(&dive, &DiveVehicle { own, ..DiveVehicle::default() })
        };
        assert!(track(0.8).is_empty(), "1.3 s where others take 0.5 s");
        let gap = "The vehicle's own record has no place from 1970-01-01T00:00:25Z to 1970-01-01T00:00:35Z, for 11 s (42 s of the mission): its \
                   program stood still, or nothing measured one.";
        assert_eq!(track(10.0), [gap]);
    }
}
