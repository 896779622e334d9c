//! The distances of a live camera's pixels: each image waits for a moment for those of its time.

use scenecast_sensors::{DepthMatch, DepthMessage, DepthTrack, Stamp};
use scenecast_sources::{LiveSource, SourceReport};
use std::time::Duration;

/// Longest time that an image waits for its distances.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// Units in a metre of whole-number depth images of ROS 2 (REP 118).
const ROS_UNITS_PER_M: f64 = 1000.0;

/// The source of the distances, and those that wait for their images.
pub(super) struct DepthFeed {
    source: Option<LiveSource>,
    track: DepthTrack<DepthMessage>,
    units_per_m: f64,
}

impl DepthFeed {
    /// `units_per_m` is 0 for the units of ROS 2.
    pub(super) fn new(source: Option<LiveSource>, units_per_m: f64) -> Self {
        let units_per_m = if units_per_m > 0.0 { units_per_m } else { ROS_UNITS_PER_M };
        Self { source, track: DepthTrack::default(), units_per_m }
    }

    /// The next report of the source. Cancel-safe.
    pub(super) async fn next(&mut self) -> SourceReport {
        LiveSource::next_of(&mut self.source).await
    }

    /// Takes distances, which are kept for the images that wait, at these times.
    pub(super) fn handle_depth(
        &mut self,
        stamp: Stamp,
        message: DepthMessage,
        images: impl IntoIterator<Item = Stamp>,
    ) {
        let bytes = message.size();
        self.track.push(stamp, message, bytes, images);
    }

    /// The distances at the time of an image that waits since `since`; `None` as long as it waits for them.
    pub(super) fn poll(&mut self, stamp: Stamp, since: Stamp, now: Stamp) -> Option<DepthAnswer> {
        if self.source.is_none() {
            return Some(DepthAnswer::Unmeasured);
        }
        match self.track.take(stamp) {
            DepthMatch::Found(message) => Some(DepthAnswer::Measured(message, self.units_per_m)),
            DepthMatch::NotYet if now < Self::due(since) => None,
            DepthMatch::NotYet | DepthMatch::Missing => Some(DepthAnswer::Missing),
        }
    }

    /// The moment at which an image that waits since `since` is mapped without distances.
    pub(super) fn due(since: Stamp) -> Stamp {
        since.after(MAX_WAIT)
    }
}

/// The distances of an image.
#[derive(Debug, PartialEq)]
pub(super) enum DepthAnswer {
    /// They were measured, whole numbers in so many units a metre.
    Measured(DepthMessage, f64),
    /// A source is configured, and has none for this image.
    Missing,
    /// No source of distances is configured.
    Unmeasured,
}
