//! A camera that plays a recording.

use super::CameraFrame;
use crate::clock::Clock;
use scenecast_core::UserError;
use scenecast_files::{RecordedFrame, Recording};
use scenecast_protocol::time::Instant;
use scenecast_sensors::{CameraFault, CameraTally};

/// The frames of a recording in order, each at its time; no frames without a recording.
pub(crate) struct RecordedCamera {
    frames: std::iter::Peekable<std::vec::IntoIter<RecordedFrame>>,
    clock: Clock,
    /// Mission time at which this run's clock began.
    began_s: f64,
    tally: CameraTally,
}

impl RecordedCamera {
    /// A camera that plays a recording, if there is one. Playback resumes after the frame of `seen_s`, the
    /// last one in the checkpoint.
    pub(crate) fn new(recording: Option<Recording>, clock: Clock, seen_s: Option<f64>) -> Self {
        let mut frames = recording.map(|r| r.frames).unwrap_or_default();
        let mapped = seen_s.and_then(|t_s| frames.iter().rposition(|frame| frame.t_s == t_s));
        let began_s = match mapped {
            Some(index) => frames.drain(..=index).next_back().map_or(0.0, |frame| frame.t_s),
            None => 0.0,
        };
        Self { frames: frames.into_iter().peekable(), clock, began_s, tally: CameraTally::default() }
    }

    /// Whether the recording has ended.
    pub(super) fn is_over(&self) -> bool {
        self.frames.len() == 0
    }

    /// Waits until the next frame is due; never returns after the last one.
    pub(super) async fn wait(&mut self) {
        let began_s = self.began_s;
        match self.frames.peek() {
            Some(frame) => tokio::time::sleep_until(self.clock.wall(due(frame, began_s))).await,
            None => std::future::pending().await,
        }
    }

    /// The next frame, if it is due.
    pub(super) fn poll_frame(&mut self) -> Option<CameraFrame> {
        let (now, began_s) = (self.clock.now(), self.began_s);
        let frame = self.frames.next_if(|frame| due(frame, began_s) <= now)?;
        self.tally.matched += 1;
        Some(CameraFrame::from(frame))
    }

    /// A frame cannot be read, or the scene model does not take it.
    pub(super) fn handle_missed(&mut self, error: &UserError) {
        self.tally.matched -= 1;
        self.tally.count(CameraFault::Unreadable);
        tracing::error!("a camera frame was skipped, {} so far: {error}", self.tally.of(CameraFault::Unreadable));
    }

    /// The frame that was polled last only moves the vehicle, whose labels come from another program.
    pub(super) fn leave_unmapped(&mut self) {
        self.tally.matched -= 1;
    }

    /// What became of the frames; `None` before the first one, as of a vehicle without a camera.
    pub(super) fn tally(&self) -> Option<&CameraTally> {
        Some(&self.tally).filter(|tally| **tally != CameraTally::default())
    }
}

/// When a frame is due by the clock of a run that began at the mission time `began_s`.
fn due(frame: &RecordedFrame, began_s: f64) -> Instant {
    Instant::from_secs_f64((frame.t_s - began_s).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_cannot_be_read_are_counted() {
        let mut camera = RecordedCamera::new(None, Clock::new(1.0), None);
        assert_eq!(camera.tally(), None);
        camera.tally.matched = 3;
        camera.handle_missed(&UserError::failed("no image"));
        let tally = camera.tally().unwrap();
        assert_eq!((tally.matched, tally.of(CameraFault::Unreadable)), (2, 1));
    }
}
