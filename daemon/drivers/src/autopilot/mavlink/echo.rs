//! Whether the autopilot reports the target that it was given.
//!
//! Targets in guided mode are not acknowledged, and ArduSub drops those that it does not like without a word. What it flies to
//! stands in POSITION_TARGET_LOCAL_NED and POSITION_TARGET_GLOBAL_INT, and in NAV_CONTROLLER_OUTPUT where these do not come.

use scenecast_protocol::time::Instant;
use std::time::Duration;

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
}
