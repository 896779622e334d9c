//! What the log says about a vehicle without anybody's order: silence, modes, labels.

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{EquipmentFaults, ModeReason, VehicleMode};
use std::collections::BTreeSet;
use std::time::Duration;

/// A vehicle counts as silent after this many times its usual silence, and not before [`LEAST_SILENCE`].
const SILENCES: u32 = 3;
const LEAST_SILENCE: Duration = Duration::from_secs(60);

/// The facts about a vehicle that the log has.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    last_received: Option<Instant>,
    is_silent: bool,
    mode: Option<(VehicleMode, ModeReason)>,
    faults: EquipmentFaults,
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

    /// Time passes; `usual` is the usual pause between two frames. The text is for the log.
    pub(crate) fn handle_time(&mut self, usual: Option<Duration>, now: Instant) -> Option<String> {
        let last = self.last_received?;
        let allowed = (usual.unwrap_or_default() * SILENCES).max(LEAST_SILENCE);
        let is_new = !self.is_silent && now.since(last) > allowed;
        self.is_silent |= is_new;
        is_new.then(|| format!("silent for {}", span(now.since(last))))
    }

    /// The vehicle reports a mode; returns whether it is another one than before.
    pub(crate) fn handle_mode(&mut self, mode: VehicleMode, reason: ModeReason) -> bool {
        self.mode.replace((mode, reason)).is_some_and(|before| before != (mode, reason))
    }

    /// The vehicle reports the faults of its equipment. The text is for the log.
    pub(crate) fn handle_faults(&mut self, faults: EquipmentFaults) -> Option<String> {
        let before = std::mem::replace(&mut self.faults, faults);
        let names: Vec<&str> = faults.iter().map(|(text, _)| text).collect();
        (before != faults).then(|| if names.is_empty() { "no fault any more".to_owned() } else { names.join(", ") })
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
    fn a_fault_is_logged_when_it_comes_and_when_it_goes() {
        let mut watch = Watch::default();
        let faults = EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..EquipmentFaults::default() };
        assert_eq!(watch.handle_faults(EquipmentFaults::default()), None);
        assert_eq!(watch.handle_faults(faults).as_deref(), Some("the autopilot does not follow, no image comes in"));
        assert_eq!(watch.handle_faults(faults), None);
        assert_eq!(watch.handle_faults(EquipmentFaults::default()).as_deref(), Some("no fault any more"));
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
