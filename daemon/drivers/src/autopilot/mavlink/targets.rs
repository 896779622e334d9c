//! Targets that go out, whether the autopilot reports them, and whether this end may take command of it.
//!
//! Targets in guided mode are not acknowledged, and ArduSub drops those that it does not like without a word. What it flies to
//! stands in POSITION_TARGET_LOCAL_NED and POSITION_TARGET_GLOBAL_INT, and in NAV_CONTROLLER_OUTPUT where these do not come.

use super::message::Said;
use super::{BRIDGED, Mavlink, Pose, moved, units};
use scenecast_core::{LatLon, Reminder, TangentPlane};
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// The last target that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sent {
    /// North and east in the autopilot's own frame, metres.
    Local(f64, f64),
    Global(LatLon),
}

fn degrees((lat, lon): (i32, i32)) -> LatLon {
    LatLon { lat_deg: f64::from(lat) / 1e7, lon_deg: f64::from(lon) / 1e7 }
}

impl Sent {
    /// Metres east and north from the autopilot's position to the target.
    fn way(self, pose: &Pose) -> Option<(f64, f64)> {
        match self {
            Self::Local(north, east) => {
                pose.local.map(|[at_north, at_east, _]| (east - f64::from(at_east), north - f64::from(at_north)))
            }
            Self::Global(place) => pose.place.map(|at| TangentPlane::new(degrees(at)).to_plane(place)),
        }
    }
}

impl Mavlink {
    pub(super) fn send_target(&mut self, now: Instant) {
        let Some(pose) = self.pose.filter(|p| now.since(p.heard) < BRIDGED) else { return };
        // Depths of targets count from the autopilot's own zero. While that is in doubt, the last target stays.
        let Some(zero_m) = self.outbox.depth_zero_m() else { return };
        // A target counts from the position: one false position would send the vehicle far away.
        if self.outbox.is_place_in_doubt() {
            return;
        }
        match (pose.local, self.goal) {
            (Some(at), Some(goal)) => {
                let down = goal.depth_m.map_or(at[2], |d| (d + zero_m) as f32);
                self.stay = None;
                self.send_local([at[0] + goal.north_m as f32, at[1] + goal.east_m as f32, down], now);
            }
            (Some(at), None) => {
                let stay = *self.stay.get_or_insert(at);
                self.send_local(stay, now);
            }
            (None, goal) => {
                let Some(at) = pose.place else { return };
                let (east, north) = goal.map_or((0.0, 0.0), |g| (g.east_m, g.north_m));
                let depth = goal.and_then(|g| g.depth_m).map_or(pose.depth_m, |d| d + zero_m);
                let place = moved(degrees(at), east, north);
                self.sent = Some(Sent::Global(place));
                let (lat, lon) = units(place);
                self.say(&Said::Global(lat, lon, -depth as f32), now);
            }
        }
        self.outbox.count("targets");
        self.echo.handle_target(now);
    }

    fn send_local(&mut self, place: [f32; 3], now: Instant) {
        self.sent = Some(Sent::Local(f64::from(place[0]), f64::from(place[1])));
        self.say(&Said::Local(place), now);
    }

    /// The autopilot's target in its own frame: north and east.
    pub(super) fn handle_local_target(&mut self, told: Option<[f32; 2]>, now: Instant) {
        let Some(Sent::Local(north, east)) = self.sent else { return };
        let off =
            |[told_north, told_east]: [f32; 2]| (f64::from(told_north) - north).hypot(f64::from(told_east) - east);
        self.handle_report(Report::Target(told.map(off)), now);
    }

    pub(super) fn handle_global_target(&mut self, told: Option<(i32, i32)>, now: Instant) {
        let Some((at, (east, north))) = self.pose.and_then(|pose| pose.place.zip(self.sent?.way(&pose))) else {
            return;
        };
        let plane = TangentPlane::new(degrees(at));
        let off = |told| {
            let (told_east, told_north) = plane.to_plane(degrees(told));
            (told_east - east).hypot(told_north - north)
        };
        self.handle_report(Report::Target(told.map(off)), now);
    }

    pub(super) fn handle_distance(&mut self, told_m: u16, now: Instant) {
        let Some((east, north)) = self.pose.and_then(|pose| self.sent?.way(&pose)) else { return };
        self.handle_report(Report::Distance { told_m: f64::from(told_m), given_m: east.hypot(north) }, now);
    }

    fn handle_report(&mut self, report: Report, now: Instant) {
        if let Some(note) = self.echo.handle_report(report, now) {
            self.outbox.note(note);
        }
    }
}

/// Two targets this close to each other are the same, metres.
const SAME_M: f64 = 3.0;

/// Time with reports of other targets only, after which the targets count as refused.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Time without any report after which people are told. The streams must be asked for first.
const MUTE: Duration = Duration::from_secs(15);

/// What an autopilot reports about its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Report {
    /// Metres between its target and the one that it was given; `None` if its target is no position.
    Target(Option<f64>),
    /// Metres to its waypoint, and to the one that it was given.
    Distance { told_m: f64, given_m: f64 },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Verdict {
    /// Nothing was given yet, or the answer is awaited.
    #[default]
    Open,
    Follows,
    /// It reports another target than the one that was given.
    Refuses,
    /// It has reported no target for a while.
    Mute,
}

/// Compares the targets that were given with the autopilot's reports.
#[derive(Debug, Default)]
pub(super) struct Echo {
    /// The first target, or the last one that was confirmed.
    since: Option<Instant>,
    /// The last report of any kind.
    heard: Option<Instant>,
    /// The last report of a target.
    heard_target: Option<Instant>,
    /// The last report, if it does not match.
    other: Option<Report>,
    verdict: Verdict,
}

impl Echo {
    pub(super) fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// Targets do not count any more, as no one is to follow them.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// A target goes out; from the first one on, reports are awaited.
    pub(super) fn handle_target(&mut self, now: Instant) {
        self.since.get_or_insert(now);
    }

    /// A report came in. Returns a note for people when the autopilot follows again.
    pub(super) fn handle_report(&mut self, report: Report, now: Instant) -> Option<String> {
        self.since?;
        let is_same = match report {
            Report::Target(off_m) => {
                self.heard_target = Some(now);
                off_m.is_some_and(|off_m| off_m <= SAME_M)
            }
            // A distance is a weak witness beside a target.
            Report::Distance { .. } if self.heard_target.is_some_and(|at| now.since(at) < TIMEOUT) => return None,
            Report::Distance { told_m, given_m } => (told_m - given_m).abs() <= SAME_M,
        };
        self.heard = Some(now);
        self.other = (!is_same).then_some(report);
        if !is_same {
            return None;
        }
        self.since = Some(now);
        match std::mem::replace(&mut self.verdict, Verdict::Follows) {
            Verdict::Refuses => Some("the autopilot follows the waypoint again".to_owned()),
            Verdict::Mute => Some("the autopilot reports its target, which is the waypoint".to_owned()),
            Verdict::Open | Verdict::Follows => None,
        }
    }

    /// Lets time pass. Returns a note for people when the verdict gets worse.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<String> {
        let since = self.since?;
        let is_heard = self.heard.is_some_and(|at| now.since(at) < TIMEOUT);
        let verdict = match self.other {
            Some(_) if is_heard && now.since(since) >= TIMEOUT => Verdict::Refuses,
            _ if !is_heard && now.since(self.heard.unwrap_or(since).max(since)) >= MUTE => Verdict::Mute,
            _ => return None,
        };
        if std::mem::replace(&mut self.verdict, verdict) == verdict {
            return None;
        }
        let what = match (verdict, self.other) {
            (Verdict::Refuses, Some(Report::Target(Some(off_m)))) => {
                format!("it reports a target {off_m:.0} m away from it")
            }
            (Verdict::Refuses, Some(Report::Target(None))) => "it reports a target without a position".to_owned(),
            (Verdict::Refuses, Some(Report::Distance { told_m, given_m })) => {
                format!("it reports {told_m:.0} m to go instead of {given_m:.0} m")
            }
            _ => return Some("the autopilot does not report its target: whether it follows is not known".to_owned()),
        };
        Some(format!("the autopilot does not follow the waypoint: {what}"))
    }
}

/// Uncertainty of the time at which it restarted.
const RESTART_MARGIN: Duration = Duration::from_secs(1);
/// Depth below which an autopilot that has restarted is armed again, metres.
const MIN_ARMED_DEPTH_M: f64 = 0.5;

/// The autopilot's runs, and when it was in command.
#[derive(Debug, Default)]
pub(super) struct CommandWatch {
    /// Whether it was in command once: from then on whoever takes it out of that is obeyed.
    was_in_command: bool,
    /// When it was taken out of command last, and the notes of that.
    left: Option<Instant>,
    notes: Reminder,
    /// When it started again, until it is in command again.
    restarted: Option<Instant>,
    /// Whether it was under water when it started again.
    was_under_water: bool,
}

impl CommandWatch {
    /// It has restarted so many milliseconds ago. `depth_m` is the last reported depth.
    pub(super) fn handle_restart(&mut self, ms: u32, depth_m: Option<f64>, now: Instant) {
        self.restarted = Some(now - Duration::from_millis(u64::from(ms)));
        self.was_under_water = depth_m.is_some_and(|depth_m| depth_m > MIN_ARMED_DEPTH_M);
    }

    /// Takes whether it is in command; returns whether people should know that it no longer is.
    pub(super) fn handle_heartbeat(&mut self, before: bool, is_in_command: bool, now: Instant) -> bool {
        if is_in_command {
            (self.was_in_command, self.restarted) = (true, None);
        }
        let has_left = before && !is_in_command;
        if has_left {
            self.left = Some(now);
        }
        has_left && self.notes.handle(now).is_some()
    }

    /// Whether it may be armed and switched to guided mode: it never was, or nobody but its own restart has ended that, and it
    /// was under water. On deck, its thrusters must not start by themselves.
    pub(super) fn may_be_armed(&self) -> bool {
        let ended = self.left.zip(self.restarted);
        let is_out_by_restart = ended.is_some_and(|(left, restarted)| left + RESTART_MARGIN >= restarted);
        !self.was_in_command || self.was_under_water && is_out_by_restart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Instant {
        Instant::ZERO + Duration::from_secs(s)
    }

    /// Reports once a second; returns the notes with their times.
    fn notes(reports: &[Option<Report>]) -> (Vec<(u64, String)>, Verdict) {
        let mut echo = Echo::default();
        let mut notes = Vec::new();
        for (s, report) in (0..).zip(reports) {
            echo.handle_target(at(s));
            let better = report.and_then(|report| echo.handle_report(report, at(s)));
            let worse = echo.handle_timeout(at(s));
            notes.extend(better.into_iter().chain(worse).map(|note| (s, note)));
        }
        (notes, echo.verdict())
    }

    const SAME: Option<Report> = Some(Report::Target(Some(0.5)));
    const OTHER: Option<Report> = Some(Report::Target(Some(42.0)));

    #[test]
    fn a_refused_target_is_named_once_and_so_is_its_end() {
        let reports = [vec![SAME; 3], vec![OTHER; 20], vec![SAME; 2]].concat();
        let (notes, verdict) = notes(&reports);
        let texts = [
            (7, "the autopilot does not follow the waypoint: it reports a target 42 m away from it".to_owned()),
            (23, "the autopilot follows the waypoint again".to_owned()),
        ];
        assert_eq!((notes.as_slice(), verdict), (texts.as_slice(), Verdict::Follows));
    }

    #[test]
    fn a_new_target_has_time_to_be_taken() {
        let reports = [vec![SAME; 3], vec![OTHER; 4], vec![SAME; 1], vec![OTHER; 4]].concat();
        assert_eq!(notes(&reports), (Vec::new(), Verdict::Follows));
    }

    #[test]
    fn a_distance_counts_where_no_target_is_reported() {
        let distance = Some(Report::Distance { told_m: 0.0, given_m: 30.0 });
        let (told, verdict) = notes(&[distance; 8]);
        assert_eq!((told.len(), verdict), (1, Verdict::Refuses));
        assert!(told[0].1.ends_with("it reports 0 m to go instead of 30 m"), "{told:?}");
        let (told, verdict) = notes(&[SAME, distance, distance, SAME, distance, distance].repeat(3));
        assert_eq!((told.len(), verdict), (0, Verdict::Follows));
    }

    #[test]
    fn silence_about_the_target_is_no_refusal() {
        let (told, verdict) = notes(&[None; 30]);
        assert_eq!((told.len(), told[0].0, verdict), (1, 15, Verdict::Mute));
        let (told, verdict) = notes(&[vec![None; 20], vec![SAME; 2]].concat());
        assert_eq!((told.len(), verdict), (2, Verdict::Follows));
        let (told, verdict) = notes(&[Some(Report::Target(None)); 10]);
        assert!(told[0].1.ends_with("it reports a target without a position") && verdict == Verdict::Refuses);
    }

    #[test]
    fn a_mode_that_flips_each_second_is_noted_ever_more_rarely() {
        let mut watch = CommandWatch::default();
        let flip = |s: &u64| watch.handle_heartbeat(!s.is_multiple_of(2), s.is_multiple_of(2), at(*s));
        assert_eq!((0..300).filter(flip).collect::<Vec<_>>(), [1, 61, 181]);
    }
}
