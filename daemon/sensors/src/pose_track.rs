//! The poses of the last minutes and the pose at the time of an image, without places that no vehicle can reach from those before.

use crate::Stamp;
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use std::time::Duration;

/// Pose of the vehicle or of its camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorPose {
    /// Metres east of the origin of the map.
    pub x_m: f64,
    /// Metres north of the origin of the map.
    pub y_m: f64,
    /// Depth below the surface, metres.
    pub depth_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
    /// Rotation about the forward axis, starboard down, radians.
    pub roll_rad: f64,
    /// Rotation about the starboard axis, bow up, radians.
    pub pitch_rad: f64,
    /// Height above the sea floor, metres, where it is measured.
    pub altitude_m: Option<f64>,
}

impl SensorPose {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let all = [self.x_m, self.y_m, self.depth_m, self.heading_rad, self.roll_rad, self.pitch_rad];
        all.into_iter().chain(self.altitude_m).all(f64::is_finite)
    }

    /// The pose at `share` of the way in time from this one to `later`; each angle turns the shorter way.
    fn between(&self, later: &Self, share: f64) -> Self {
        let line = |a: f64, b: f64| a + (b - a) * share;
        let angle = |a: f64, b: f64| a + ((b - a + PI).rem_euclid(TAU) - PI) * share;
        Self {
            x_m: line(self.x_m, later.x_m),
            y_m: line(self.y_m, later.y_m),
            depth_m: line(self.depth_m, later.depth_m),
            heading_rad: angle(self.heading_rad, later.heading_rad),
            roll_rad: angle(self.roll_rad, later.roll_rad),
            pitch_rad: angle(self.pitch_rad, later.pitch_rad),
            altitude_m: match (self.altitude_m, later.altitude_m) {
                (Some(a), Some(b)) => Some(line(a, b)),
                (a, b) => a.or(b),
            },
        }
    }
}

/// The pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PoseMatch {
    /// The pose, measured at that time or interpolated.
    Found(SensorPose),
    /// A later pose may still come in.
    NotYet,
    /// The poses before and after are too far apart.
    Gap,
    /// The time is before the first pose that is known.
    TooEarly,
}

/// Poses of an end that are earlier than the last one by more than this are of another clock.
const JUMP: Duration = Duration::from_secs(1);

/// Poses in a row from which a clock that went back is believed.
const JUMP_POSES: u32 = 3;

/// Poses in order of their stamps.
#[derive(Debug, Clone)]
pub struct PoseTrack {
    poses: VecDeque<(Stamp, SensorPose)>,
    /// Poses that were left out because no vehicle can reach them from the one before.
    unreachable: usize,
    max_gap: Duration,
    /// Poses in a row that were from before the last one.
    earlier: u32,
}

impl PoseTrack {
    /// The most poses that are kept: 100 s of a source of 100 Hz.
    const MAX_POSES: usize = 10_000;

    /// No pose is interpolated between two that are more than `max_gap` apart.
    pub fn new(max_gap: Duration) -> Self {
        Self { poses: VecDeque::new(), unreachable: 0, max_gap, earlier: 0 }
    }

    /// A track of all these poses, however many; those that are not later than the one before are left out, and those that no vehicle
    /// can reach from it, unless they stay.
    pub fn of(poses: impl IntoIterator<Item = (Stamp, SensorPose)>, max_gap: Duration) -> Self {
        let mut newest = None;
        let later = poses.into_iter().filter(|(stamp, pose)| {
            let is_later = pose.is_finite() && newest.is_none_or(|newest| *stamp > newest);
            newest = if is_later { Some(*stamp) } else { newest };
            is_later
        });
        let (poses, unreachable) = reachable(later, Times::Exact, |(stamp, pose)| (*stamp, [pose.x_m, pose.y_m]));
        Self { poses: poses.into(), unreachable: unreachable.len(), ..Self::new(max_gap) }
    }

    /// How many of all poses were left out because no vehicle can reach them from the one before.
    pub fn unreachable(&self) -> usize {
        self.unreachable
    }

    /// Takes a pose. Returns whether the clock of the poses went back, so that earlier poses were forgotten. A pose of the
    /// time of the last one replaces it, and one that is a little earlier is ignored, as is one that is not finite.
    pub fn push(&mut self, stamp: Stamp, pose: SensorPose) -> bool {
        if !pose.is_finite() {
            return false;
        }
        let last = self.poses.back().map(|(last, _)| *last);
        let is_other_clock = last.is_some_and(|last| stamp.after(JUMP) < last);
        self.earlier = if is_other_clock { self.earlier + 1 } else { 0 };
        match last {
            Some(last) if stamp < last => {
                if self.earlier < JUMP_POSES {
                    return false;
                }
                self.poses.clear();
                self.earlier = 0;
                self.poses.push_back((stamp, pose));
                return true;
            }
            Some(last) if stamp == last => {
                self.poses.pop_back();
            }
            Some(_) | None => {}
        }
        self.poses.push_back((stamp, pose));
        self.poses.drain(..self.poses.len().saturating_sub(Self::MAX_POSES));
        false
    }

    /// The pose at `stamp`, interpolated between the poses before and after it.
    pub fn at(&self, stamp: Stamp) -> PoseMatch {
        let after = self.poses.partition_point(|(at, _)| *at < stamp);
        match (after.checked_sub(1).map(|i| self.poses[i]), self.poses.get(after)) {
            (_, Some((at, pose))) if *at == stamp => PoseMatch::Found(*pose),
            (Some((before, a)), Some((later, b))) => {
                let apart_s = later.seconds_since(before);
                if apart_s > self.max_gap.as_secs_f64() {
                    return PoseMatch::Gap;
                }
                PoseMatch::Found(a.between(b, stamp.seconds_since(before) / apart_s))
            }
            (None, Some(_)) => PoseMatch::TooEarly,
            (_, None) => PoseMatch::NotYet,
        }
    }

    /// The last pose and its stamp.
    pub fn last(&self) -> Option<(Stamp, SensorPose)> {
        self.poses.back().copied()
    }
}

/// Faster than this is no vehicle, metres a second.
const FASTEST_M_S: f64 = 20.0;

/// A step at once that is no jump, metres.
const STEP_M: f64 = 5.0;

/// Places elsewhere that follow each other for so many seconds are right.
const PERSISTS_S: f64 = 1.0;

/// So many places elsewhere that follow each other are right where times are in whole seconds, or all the same.
const PERSISTS: usize = 10;

/// How exact the times of places are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Times {
    /// As a sensor gives them.
    Exact,
    /// As people write them, perhaps in whole seconds.
    Coarse,
}

/// A time, and metres east and north.
type Place = (Stamp, [f64; 2]);

impl Times {
    /// Whether a vehicle can come from a place to a later one.
    fn lead((before, from): Place, (later, to): Place, inexact_s: f64) -> bool {
        let moved_m = (to[0] - from[0]).hypot(to[1] - from[1]);
        moved_m <= STEP_M + FASTEST_M_S * (later.seconds_since(before) + inexact_s)
    }

    fn inexact_s(self) -> f64 {
        match self {
            Self::Exact => 0.0,
            Self::Coarse => 1.0,
        }
    }

    /// Whether so many places for so many seconds are right.
    fn persist(self, count: usize, lasted_s: f64) -> bool {
        lasted_s >= PERSISTS_S || (self == Self::Coarse && count >= PERSISTS)
    }
}

/// Separates what no vehicle can reach from what comes before, unless it stays, from the rest: returns the rest, and what is left out.
/// All is in order of time, and `place` gives the place of each.
pub fn reachable<T>(
    all: impl IntoIterator<Item = T>,
    times: Times,
    place: impl Fn(&T) -> (Stamp, [f64; 2]),
) -> (Vec<T>, Vec<T>) {
    let leads_to = |from: &T, to: &T| Times::lead(place(from), place(to), times.inexact_s());
    let (mut kept, mut left_out): (Vec<T>, Vec<T>) = Default::default();
    // What follows each other, and what is kept does not lead to.
    let mut elsewhere: Vec<T> = Vec::new();
    for next in all {
        if kept.last().is_none_or(|last| leads_to(last, &next)) {
            left_out.append(&mut elsewhere);
            kept.push(next);
            continue;
        }
        if elsewhere.last().is_some_and(|last| !leads_to(last, &next)) {
            left_out.append(&mut elsewhere);
        }
        elsewhere.push(next);
        let lasted_s = |(first, last): (&T, &T)| place(last).0.seconds_since(place(first).0);
        let lasted_s = elsewhere.first().zip(elsewhere.last()).map_or(0.0, lasted_s);
        if times.persist(elsewhere.len(), lasted_s) {
            // A single place before was wrong itself.
            if kept.len() == 1 {
                left_out.splice(..0, kept.drain(..));
            }
            kept.append(&mut elsewhere);
        }
    }
    left_out.append(&mut elsewhere);
    (kept, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, heading_deg: f64) -> SensorPose {
        SensorPose { x_m, heading_rad: heading_deg.to_radians(), ..SensorPose::default() }
    }

    fn seconds(s: f64) -> Stamp {
        Stamp::from_nanos((s * 1e9) as i64)
    }

    #[test]
    fn poses_are_interpolated_the_short_way_round() {
        let mut track = PoseTrack::new(Duration::from_secs(1));
        track.push(seconds(10.0), at(0.0, 350.0));
        track.push(seconds(11.0), at(2.0, 10.0));
        let PoseMatch::Found(pose) = track.at(seconds(10.25)) else { panic!() };
        assert!((pose.x_m - 0.5).abs() < 1e-9 && (pose.heading_rad.to_degrees() - 355.0).abs() < 1e-9, "{pose:?}");
        assert_eq!(track.at(seconds(11.0)), PoseMatch::Found(at(2.0, 10.0)));
    }

    #[test]
    fn no_pose_is_invented_outside_of_the_track_or_in_a_gap() {
        let mut track = PoseTrack::new(Duration::from_secs(1));
        assert_eq!(track.at(seconds(1.0)), PoseMatch::NotYet);
        track.push(seconds(10.0), at(0.0, 0.0));
        track.push(seconds(11.5), at(2.0, 0.0));
        assert_eq!(track.at(seconds(9.9)), PoseMatch::TooEarly);
        assert_eq!(track.at(seconds(10.5)), PoseMatch::Gap);
        assert_eq!(track.at(seconds(11.6)), PoseMatch::NotYet);
        track.push(seconds(12.0), at(f64::NAN, 0.0));
        assert_eq!(track.last().unwrap().0, seconds(11.5));
    }

    #[test]
    fn a_place_that_no_vehicle_reaches_is_left_out_unless_it_stays() {
        let places = |x_m: fn(i32) -> f64| {
            let poses = (0..40).map(|i| (seconds(100.0 + f64::from(i) / 4.0), at(x_m(i), 0.0)));
            let track = PoseTrack::of(poses, Duration::from_secs(1));
            let furthest = track.poses.iter().map(|(_, pose)| pose.x_m).fold(0.0, f64::max);
            (track.poses.len(), track.unreachable(), furthest)
        };
        assert_eq!(places(|i| if i == 20 { 400.0 } else { 1.0 }), (39, 1, 1.0));
        assert_eq!(places(|i| if i == 0 || i == 39 { 400.0 } else { 1.0 }), (38, 2, 1.0));
        assert_eq!(places(|i| if i < 20 { 1.0 } else { 400.0 }), (40, 0, 400.0));
        assert_eq!(places(|i| 4.0 * f64::from(i)), (40, 0, 156.0));
    }

    #[test]
    fn a_clock_that_goes_back_is_believed_after_three_poses() {
        let mut track = PoseTrack::new(Duration::from_secs(1));
        track.push(seconds(100.0), at(0.0, 0.0));
        assert!(!track.push(seconds(99.9), at(9.0, 0.0)));
        assert_eq!(track.at(seconds(100.0)), PoseMatch::Found(at(0.0, 0.0)));
        let pushed: Vec<bool> = [1.0, 1.1, 1.2].map(|s| track.push(seconds(s), at(s, 0.0))).to_vec();
        assert_eq!(pushed, [false, false, true]);
        assert_eq!(track.at(seconds(1.2)), PoseMatch::Found(at(1.2, 0.0)));
        assert_eq!(track.at(seconds(100.0)), PoseMatch::NotYet);
    }

    /// The places east that are kept and left out, of rows with a time in seconds.
    fn split(rows: &[(f64, f64)], times: Times) -> (Vec<f64>, Vec<f64>) {
        let place = |(t_s, x_m): &(f64, f64)| (Stamp::from_nanos((t_s * 1e9) as i64), [*x_m, 0.0]);
        let (kept, left_out) = reachable(rows.iter().copied(), times, place);
        let east = |rows: Vec<(f64, f64)>| rows.into_iter().map(|(_, x_m)| x_m).collect();
        (east(kept), east(left_out))
    }

    #[test]
    fn places_in_one_second_may_be_apart_if_times_are_coarse() {
        let rows = [(0.0, 0.0), (0.0, 9.0), (0.0, 400.0), (1.0, 18.0)];
        assert_eq!(split(&rows, Times::Coarse), (vec![0.0, 9.0, 18.0], vec![400.0]));
        assert_eq!(split(&rows, Times::Exact), (vec![0.0, 18.0], vec![9.0, 400.0]));
    }

    #[test]
    fn places_that_go_on_count_although_time_stands_still() {
        let rows: Vec<(f64, f64)> = (0..100).map(|i| (0.0, 9.0 * f64::from(i % 50))).collect();
        assert_eq!(split(&rows, Times::Coarse).1, [0.0; 0]);
    }

    #[test]
    fn a_first_place_that_was_wrong_is_the_first_left_out() {
        let rows = [(0.0, 400.0), (1.0, 900.0), (2.0, 1.0), (3.0, 2.0), (4.0, 3.0)];
        assert_eq!(split(&rows, Times::Coarse), (vec![1.0, 2.0, 3.0], vec![400.0, 900.0]));
    }
}
