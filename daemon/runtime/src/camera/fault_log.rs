//! What is logged about a camera and the source of its poses: each kind of fault once, then how often.

use scenecast_sensors::{CameraFault, CameraTally, FrameMatcher};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Shortest time between the first two lines about the same kind of fault; it doubles with each line, up to the longest.
const MIN_INTERVAL: Duration = Duration::from_secs(30);
const MAX_INTERVAL: Duration = Duration::from_secs(480);

/// What was last logged of each kind of fault.
#[derive(Debug, Default)]
pub(super) struct FaultLog {
    logged: BTreeMap<CameraFault, Logged>,
}

#[derive(Debug)]
struct Logged {
    at: Instant,
    count: u64,
    /// The shortest time from this line to the next one about the same kind of fault.
    interval: Duration,
}

impl FaultLog {
    /// Lines about the kinds of faults that have grown since their last line; `explain` says more about a kind.
    pub(super) fn lines(
        &mut self,
        tally: &CameraTally,
        now: Instant,
        explain: impl Fn(CameraFault) -> Option<String>,
    ) -> Vec<String> {
        let mut lines = Vec::new();
        for (fault, count) in tally.iter() {
            let last = self.logged.get(&fault);
            if last.is_some_and(|last| count == last.count || now.duration_since(last.at) < last.interval) {
                continue;
            }
            let interval = last.map_or(MIN_INTERVAL, |last| (last.interval * 2).min(MAX_INTERVAL));
            self.logged.insert(fault, Logged { at: now, count, interval });
            let what = if fault.is_dropped_image() { "dropped, " } else { "" };
            let why = explain(fault).map(|text| format!(": {text}")).unwrap_or_default();
            let of = if fault.is_of_navigation() { "navigation" } else { "camera" };
            lines.push(format!("{of}: {what}{} ({count} so far){why}", fault.name()));
        }
        lines
    }
}

/// The last text about each kind of fault, and whether the camera is away.
#[derive(Debug, Default)]
pub(super) struct FaultReports {
    log: FaultLog,
    texts: BTreeMap<CameraFault, String>,
    /// Whether the camera was lost or has stalled since its last image.
    is_lost: bool,
    was_matched: bool,
}

impl FaultReports {
    pub(super) fn handle_fault(&mut self, fault: CameraFault, text: String) {
        self.is_lost |= matches!(fault, CameraFault::SourceLost | CameraFault::Stalled);
        self.texts.insert(fault, text);
    }

    pub(super) fn handle_image(&mut self) {
        if std::mem::take(&mut self.is_lost) {
            tracing::info!("camera: images come in again");
        }
    }

    pub(super) fn handle_matched(&mut self) {
        if !std::mem::replace(&mut self.was_matched, true) {
            tracing::info!("camera: the first image has a pose");
        }
    }

    /// Whether the camera was lost or has stalled since its last image.
    pub(super) fn is_silent(&self) -> bool {
        self.is_lost
    }

    /// Logs the kinds of faults that are new or have grown.
    pub(super) fn log<I>(&mut self, matcher: &FrameMatcher<I>) {
        let texts = &self.texts;
        let explain = |fault| match fault {
            CameraFault::NoPose => Some(matcher.times()),
            _ => texts.get(&fault).cloned(),
        };
        for line in self.log.lines(matcher.tally(), std::time::Instant::now(), explain) {
            tracing::warn!("{line}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_logged_at_once_and_then_rarely() {
        let (mut log, mut tally, began) = (FaultLog::default(), CameraTally::default(), Instant::now());
        let mut lines =
            |tally: &CameraTally, s| log.lines(tally, began + Duration::from_secs(s), |_| Some("why".to_owned()));
        assert!(lines(&tally, 0).is_empty());
        tally.count(CameraFault::NoPose);
        assert_eq!(lines(&tally, 1), ["camera: dropped, no pose at its time (1 so far): why"]);
        tally.count(CameraFault::NoPose);
        assert!(lines(&tally, 2).is_empty());
        tally.count(CameraFault::Stalled);
        assert_eq!(lines(&tally, 3), ["camera: camera stalled (1 so far): why"]);
        assert_eq!(lines(&tally, 31), ["camera: dropped, no pose at its time (2 so far): why"]);
        assert!(lines(&tally, 90).is_empty());
    }
}
