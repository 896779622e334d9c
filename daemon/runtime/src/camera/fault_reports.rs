//! What is logged about the faults of a live camera and of the source of its poses.

use super::fault_log::FaultLog;
use scenecast_sensors::{CameraFault, FrameMatcher};
use std::collections::BTreeMap;

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
