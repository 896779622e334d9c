//! What the log says about a vehicle without anybody's order: silence, modes, labels.

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{EquipmentFaults, ModeReason, VehicleMode};
use std::collections::BTreeSet;
use std::time::Duration;

/// A vehicle counts as silent after this many times its usual silence, and not before [`MIN_SILENCE`].
const SILENCES: u32 = 3;
const MIN_SILENCE: Duration = Duration::from_secs(60);
/// Time between two entries about faults that are not grave.
const MINOR_PAUSE: Duration = Duration::from_secs(1800);

/// The text where an autopilot does not answer, beside those of [`EquipmentFaults::iter`].
pub const AUTOPILOT_SILENT: &str = "the autopilot does not answer";
/// The text of the end of all faults.
pub const NO_FAULT: &str = "no fault any more";

/// The facts about a vehicle that the log has.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    last_received: Option<Instant>,
    is_silent: bool,
    mode: Option<(VehicleMode, ModeReason)>,
    faults: EquipmentFaults,
    /// Reports in a row that say that the autopilot does not answer.
    silent_reports: u32,
    /// When faults that are not grave were logged last.
    minor_logged: Option<Instant>,
    /// The labels of an epoch.
    labels: (u8, BTreeSet<u8>),
    /// The next labels are known from an earlier run of the surface.
    are_labels_known: bool,
}

impl Watch {
    /// A frame of the vehicle was accepted. The text is for the log.
    pub(crate) fn handle_frame(&mut self, now: Instant) -> Option<String> {
        let before = self.last_received.replace(now);
        let was_silent = std::mem::take(&mut self.is_silent);
        match before {
            None => Some("received".to_owned()),
            Some(before) => was_silent.then(|| format!("received again after {}", span(now.since(before)))),
        }
    }

    /// Whether a frame of the vehicle was accepted since this end began.
    pub(crate) fn has_received(&self) -> bool {
        self.last_received.is_some()
    }

    /// Time passes; `usual` is the usual pause between two frames. The text is for the log.
    pub(crate) fn handle_time(&mut self, usual: Option<Duration>, now: Instant) -> Option<String> {
        let last = self.last_received?;
        let allowed = (usual.unwrap_or_default() * SILENCES).max(MIN_SILENCE);
        let is_new = !self.is_silent && now.since(last) > allowed;
        self.is_silent |= is_new;
        is_new.then(|| format!("silent for {}", span(now.since(last))))
    }

    /// The vehicle reports a mode, of which the log would have `text`; returns whether it is news. Of the first one, that depends on
    /// the last mode that an earlier run of the surface has logged; without one the vehicle is expected to survey.
    pub(crate) fn handle_mode<'a>(
        &mut self,
        mode: (VehicleMode, ModeReason),
        text: &str,
        logged: impl FnOnce() -> Option<&'a str>,
    ) -> bool {
        match self.mode.replace(mode) {
            Some(before) => before != mode,
            None => logged().map_or(mode.0 != VehicleMode::Survey, |logged| logged != text),
        }
    }

    /// The vehicle reports the faults of its equipment, and whether its autopilot does not answer. The text is for the log: at once
    /// when that or a grave fault comes or goes, and seldom for the others, which may come and go for hours.
    pub(crate) fn handle_faults(
        &mut self,
        faults: EquipmentFaults,
        is_autopilot_silent: bool,
        now: Instant,
    ) -> Option<String> {
        let before = std::mem::replace(&mut self.faults, faults);
        // The first report of a run may leave before the autopilot has answered.
        let was_silent = self.silent_reports > 1;
        self.silent_reports = if is_autopilot_silent { self.silent_reports.saturating_add(1) } else { 0 };
        let is_silent = self.silent_reports > 1;
        let is_minor_due = self.minor_logged.is_none_or(|at| now.since(at) >= MINOR_PAUSE);
        let is_minor = faults != faults.grave() && is_minor_due;
        if before.grave() == faults.grave() && was_silent == is_silent && !is_minor {
            return None;
        }
        if faults != faults.grave() {
            self.minor_logged = Some(now);
        }
        let silence = is_silent.then_some(AUTOPILOT_SILENT);
        let texts: Vec<&str> = silence.into_iter().chain(faults.iter().map(|(text, _)| text)).collect();
        Some(if texts.is_empty() { NO_FAULT.to_owned() } else { texts.join(", ") })
    }

    /// Takes the labels on the map; returns those that are new in this epoch.
    pub(crate) fn handle_labels(&mut self, epoch: u8, labels: impl Iterator<Item = u8>) -> Vec<u8> {
        if std::mem::take(&mut self.are_labels_known) {
            self.labels = (epoch, labels.collect());
            return Vec::new();
        }
        if self.labels.0 != epoch {
            self.labels = (epoch, BTreeSet::new());
        }
        labels.filter(|&label| self.labels.1.insert(label)).collect()
    }

    /// An earlier run of the surface has logged the labels that come next.
    pub(crate) fn assume_labels_known(&mut self) {
        self.are_labels_known = true;
    }
}

fn span(time: Duration) -> String {
    let seconds = time.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Instant {
        Instant::from_secs_f64(seconds)
    }

    #[test]
    fn the_first_mode_is_news_if_an_earlier_run_has_not_logged_it() {
        let first =
            |mode, logged| Watch::default().handle_mode((mode, ModeReason::Fence), "returning: fence", || logged);
        assert!(first(VehicleMode::Return, None) && first(VehicleMode::Return, Some("surveying")));
        assert!(!first(VehicleMode::Return, Some("returning: fence")), "it is in the log");
        assert!(!first(VehicleMode::Survey, None), "as expected");
        let mut watch = Watch::default();
        watch.handle_mode((VehicleMode::Survey, ModeReason::Survey), "surveying", || None);
        assert!(watch.handle_mode((VehicleMode::Return, ModeReason::Fence), "returning: fence", || None));
        assert!(!watch.handle_mode((VehicleMode::Return, ModeReason::Fence), "returning: fence", || None));
    }

    #[test]
    fn a_silence_is_logged_once_and_its_end_with_its_length() {
        let mut watch = Watch::default();
        let usual = Some(Duration::from_secs(30));
        assert_eq!(watch.handle_time(usual, at(500.0)), None, "a vehicle that was never received is not silent");
        assert_eq!(watch.handle_frame(at(1000.0)).as_deref(), Some("received"));
        assert_eq!(watch.handle_time(usual, at(1080.0)), None);
        assert_eq!(watch.handle_time(usual, at(1091.0)).as_deref(), Some("silent for 1 min 31 s"));
        assert_eq!(watch.handle_time(usual, at(2000.0)), None);
        assert_eq!(watch.handle_frame(at(4700.0)).as_deref(), Some("received again after 1 h 1 min"));
        assert_eq!(watch.handle_frame(at(4710.0)), None);
        assert_eq!(watch.handle_time(None, at(4760.0)), None, "a minute at least");
    }

    #[test]
    fn grave_faults_are_logged_at_once_and_others_rarely() {
        let (mut watch, none) = (Watch::default(), EquipmentFaults::default());
        let grave = EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..none };
        let minor = EquipmentFaults { images_dropped: true, ..none };
        assert_eq!(watch.handle_faults(none, false, at(0.0)), None);
        let text = watch.handle_faults(grave, false, at(1.0));
        assert_eq!(text.as_deref(), Some("the autopilot does not follow, no image comes in"));
        assert_eq!(watch.handle_faults(grave, false, at(2.0)), None);
        assert_eq!(watch.handle_faults(none, false, at(3.0)).as_deref(), Some("no fault any more"));
        assert_eq!(watch.handle_faults(none, true, at(3.1)), None);
        assert_eq!(watch.handle_faults(none, true, at(3.2)).as_deref(), Some("the autopilot does not answer"));
        assert_eq!(watch.handle_faults(none, false, at(3.3)).as_deref(), Some("no fault any more"));
        assert_eq!(watch.handle_faults(minor, false, at(4.0)).as_deref(), Some("images are dropped"));
        for second in 5..600 {
            let faults = if second % 2 == 0 { minor } else { none };
            assert_eq!(watch.handle_faults(faults, false, at(f64::from(second))), None);
        }
        assert_eq!(watch.handle_faults(minor, false, at(1804.0)).as_deref(), Some("images are dropped"));
    }

    #[test]
    fn labels_are_new_once_in_an_epoch() {
        let mut watch = Watch::default();
        assert_eq!(watch.handle_labels(1, [1, 2].into_iter()), [1, 2]);
        assert_eq!(watch.handle_labels(1, [2, 3].into_iter()), [3]);
        assert_eq!(watch.handle_labels(2, [3].into_iter()), [3]);
        watch.assume_labels_known();
        assert!(watch.handle_labels(2, [3, 4].into_iter()).is_empty());
        assert_eq!(watch.handle_labels(2, [3, 4, 5].into_iter()), [5]);
    }
}
