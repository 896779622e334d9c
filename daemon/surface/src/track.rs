//! Where a vehicle was, how its camera frames were placed, and the usual length of its silences.

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{FrameTie, RegistrationReport, TrailCorner, VehicleStatus};
use std::collections::VecDeque;
use std::time::Duration;

/// Ages of corners are whole seconds, and frames take their time through the water: a corner counts as later than a position
/// from this difference on.
const TRAIL_MARGIN_S: f64 = 0.5;

/// Reported positions in the map frame: time, metres east, metres north.
#[derive(Debug, Clone, Default)]
pub struct Track {
    points: VecDeque<(Instant, f64, f64)>,
    total: u64,
}

impl Track {
    /// The time over which the speed is measured: several legs, with the turns between them.
    const SPEED_S: f64 = 30.0;
    const STANDS_M_S: f64 = 0.05;
    /// The most positions that are kept.
    pub(crate) const MAX_POINTS: usize = 500;

    /// A track that was interrupted after `total` positions, of which these are the last.
    pub fn restored(points: impl IntoIterator<Item = (Instant, f64, f64)>, total: u64) -> Self {
        Self { points: points.into_iter().collect(), total }
    }

    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (Instant, f64, f64)> + ExactSizeIterator + '_ {
        self.points.iter().copied()
    }

    /// The speed over the last [`Self::SPEED_S`] seconds, metres a second; `None` if the track is shorter, or the vehicle stands.
    pub fn speed_m_s(&self) -> Option<f64> {
        let &(end, ..) = self.points.back()?;
        let (mut metres, mut after) = (0.0, *self.points.back()?);
        for &point in self.points.iter().rev() {
            metres += (after.1 - point.1).hypot(after.2 - point.2);
            let seconds = end.since(point.0).as_secs_f64();
            if seconds >= Self::SPEED_S {
                return Some(metres / seconds).filter(|m_s| *m_s > Self::STANDS_M_S);
            }
            after = point;
        }
        None
    }

    /// The number of positions so far, those that were dropped included.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Appends a pose that came in at `now`, and before it those corners of its trail that are later than the track so far. A
    /// status whose pose is older than that changes nothing.
    pub(crate) fn handle_pose(&mut self, status: &VehicleStatus, now: Instant) {
        let last = self.points.back().map(|&(at, ..)| at);
        if last.is_some_and(|last| now <= last) {
            return;
        }
        let known_s = last.map_or(0.0, |last| last.as_secs_f64() + TRAIL_MARGIN_S);
        for &TrailCorner { ago_s, place } in status.trail.iter().rev() {
            let at_s = now.as_secs_f64() - f64::from(ago_s);
            if at_s > known_s {
                self.push(Instant::from_secs_f64(at_s), place.x_m, place.y_m);
            }
        }
        self.push(now, status.position.x_m, status.position.y_m);
    }

    pub(crate) fn push(&mut self, at: Instant, x_m: f64, y_m: f64) {
        self.points.push_back((at, x_m, y_m));
        self.total += 1;
        self.points.drain(..self.points.len().saturating_sub(Self::MAX_POINTS));
    }
}

/// The longest recent pause between two frames of a vehicle. Short pauses within a turn do not shorten it at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pauses {
    last_frame: Option<Instant>,
    longest: Option<Duration>,
}

impl Pauses {
    /// A pause is forgotten after pauses that add up to this many times its length.
    const MEMORY: u32 = 8;
    /// A pause up to this length counts fully, even if it is far beyond the usual one.
    const SHORT: Duration = Duration::from_secs(60);

    /// The pauses as an earlier run of the surface knew them.
    pub fn restored(longest: Option<Duration>) -> Self {
        Self { last_frame: None, longest }
    }

    pub fn handle_frame(&mut self, now: Instant) {
        let Some(last) = self.last_frame.replace(now) else { return };
        let pause = now.since(last);
        self.longest = Some(match self.longest {
            // A long pause far beyond the usual one was an outage. It at most doubles the expected pause.
            Some(longest) => pause.min(Self::SHORT.max(longest * 2)).max(longest.saturating_sub(pause / Self::MEMORY)),
            None => pause,
        });
    }

    /// The expected pause between two frames; `None` before the second frame.
    pub fn expected(&self) -> Option<Duration> {
        self.longest
    }
}

/// The last report, and the places at which frames closed a loop.
#[derive(Debug, Clone, Default)]
pub struct RegistrationRecord {
    latest: Option<(RegistrationReport, Instant)>,
    closures: Track,
}

impl RegistrationRecord {
    /// A record that was interrupted.
    pub(crate) fn restored(latest: Option<(RegistrationReport, Instant)>, closures: Track) -> Self {
        Self { latest, closures }
    }

    /// The last report and its time; `None` if the vehicle never sent one.
    pub fn latest(&self) -> Option<(RegistrationReport, Instant)> {
        self.latest
    }

    /// Reported positions of frames that overlapped with an earlier track.
    pub fn closures(&self) -> &Track {
        &self.closures
    }

    /// Takes the report of a status whose pose came in at `now`; a pose that is not newer changes nothing.
    pub(crate) fn handle_status(&mut self, status: &VehicleStatus, now: Instant) {
        let Some(report) = status.registration else { return };
        if self.latest.is_some_and(|(_, at)| now <= at) {
            return;
        }
        self.latest = Some((report, now));
        if report.tie == FrameTie::EarlierTrack {
            self.closures.push(now, status.position.x_m, status.position.y_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::MapPoint;

    /// The longest silence divided by the expected one, after ten turns of `frames` frames and a pause.
    fn worst(frames: u32, frame: Duration, pause: Duration) -> f64 {
        let (mut pauses, mut now, mut worst) = (Pauses::default(), Instant::ZERO, 0.0);
        for turn in 0..50 {
            for _ in 0..frames {
                now = now + frame;
                pauses.handle_frame(now);
            }
            let expected = pauses.expected().unwrap().as_secs_f64();
            if turn > 10 {
                worst = f64::max(worst, pause.as_secs_f64() / expected);
            }
            now = now + pause - frame;
        }
        worst
    }

    #[test]
    fn no_pause_between_turns_counts_as_silence() {
        for (frames, frame_ms, pause_s) in [(2, 200, 10), (60, 200, 10), (3, 5000, 120), (20, 6000, 240)] {
            let most = worst(frames, Duration::from_millis(frame_ms), Duration::from_secs(pause_s));
            assert!(most < 2.0, "{frames} frames, then {pause_s} s: {most} times what was expected");
        }
    }

    #[test]
    fn an_outage_does_not_make_silence_usual() {
        let mut pauses = Pauses::default();
        (1..=20).for_each(|i| pauses.handle_frame(Instant::ZERO + Duration::from_secs(10) * i));
        pauses.handle_frame(Instant::ZERO + Duration::from_secs(4000));
        assert_eq!(pauses.expected(), Some(Duration::from_secs(60)));
    }

    #[test]
    fn a_loop_is_marked_once_where_it_was_closed() {
        let mut record = RegistrationRecord::default();
        let status = |tie, x_m| VehicleStatus {
            position: MapPoint::new(x_m, 2.0),
            registration: Some(RegistrationReport { tie, ..RegistrationReport::default() }),
            ..VehicleStatus::default()
        };
        let at = Instant::from_secs_f64;
        record.handle_status(&status(FrameTie::FrameBefore, 1.0), at(1.0));
        record.handle_status(&status(FrameTie::EarlierTrack, 2.0), at(2.0));
        record.handle_status(&status(FrameTie::EarlierTrack, 2.0), at(2.0));
        record.handle_status(&VehicleStatus::default(), at(3.0));
        assert_eq!(record.closures().iter().collect::<Vec<_>>(), [(at(2.0), 2.0, 2.0)]);
        assert_eq!(record.latest().map(|(report, at)| (report.tie, at)), Some((FrameTie::EarlierTrack, at(2.0))));
        (0..600).for_each(|i| record.handle_status(&status(FrameTie::EarlierTrack, 0.0), at(10.0 + f64::from(i))));
        assert_eq!((record.closures().iter().len(), record.closures().total()), (Track::MAX_POINTS, 601));
    }
}
