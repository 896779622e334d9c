//! A camera that plays a recording.

use super::CameraFrame;
use crate::clock::Clock;
use scenecast_files::{RecordedFrame, Recording};
use scenecast_protocol::time::Instant;

/// The frames of a recording in order, each at its time; no frames without a recording.
pub(crate) struct RecordedCamera {
    frames: std::iter::Peekable<std::vec::IntoIter<RecordedFrame>>,
    clock: Clock,
    /// Mission time at which this run's clock began.
    began_s: f64,
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
        Self { frames: frames.into_iter().peekable(), clock, began_s }
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
        self.frames.next_if(|frame| due(frame, began_s) <= now).map(CameraFrame::from)
    }
}

/// When a frame is due by the clock of a run that began at the mission time `began_s`.
fn due(frame: &RecordedFrame, began_s: f64) -> Instant {
    Instant::from_secs_f64((frame.t_s - began_s).max(0.0))
}
