//! The frames of a real link, lost again.

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;
use std::sync::Arc;
use std::time::Duration;

/// How far a frame may be from a recorded one to share its fate.
const TOLERANCE: Duration = Duration::from_millis(100);
/// Over how much time before and after it a frame between the recorded ones counts them.
const SURROUNDINGS: Duration = Duration::from_secs(60);

/// One direction of a link, of which it is known for each frame whether it arrived.
///
/// A frame whose end arrives within 0.1 s of the end of a recorded one shares its fate, so that the same traffic loses the same frames.
/// Another frame is lost with the share of the recorded ones that were lost within a minute of it. After its end the record
/// starts again.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::loss::Replayed;
///
/// let frames = [(0, true), (2, false), (4, true), (6, true)].map(|(s, delivered)| (Duration::from_secs(s), delivered));
/// assert_eq!(Replayed::new(frames).unwrap().loss_rate(), 0.25);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Replayed {
    /// When the end of each frame arrived, or would have, since the start of the run, and whether it did.
    frames: Arc<[(Duration, bool)]>,
    period: Duration,
}

impl Replayed {
    /// A link that carried these frames; `None` without any.
    #[must_use]
    pub fn new(frames: impl IntoIterator<Item = (Duration, bool)>) -> Option<Self> {
        let mut frames: Vec<(Duration, bool)> = frames.into_iter().collect();
        frames.sort_by_key(|(at, _)| *at);
        let period = frames.last()?.0 + SURROUNDINGS;
        Some(Self { frames: frames.into(), period })
    }

    /// Share of the frames that were lost, 0..=1.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        share_lost(&self.frames)
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(self.clone())
    }

    /// The fate of the recorded frame that ended next to this time, if there is one.
    fn fate(&self, end: Duration) -> Option<bool> {
        let after = self.frames.partition_point(|(at, _)| *at < end);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let nearest = near.filter_map(|index| self.frames.get(index)).min_by_key(|(at, _)| at.abs_diff(end))?;
        (nearest.0.abs_diff(end) <= TOLERANCE).then_some(nearest.1)
    }

    /// The share of frames that were lost around this time; that of the whole record where it has none.
    fn loss_around(&self, end: Duration) -> f64 {
        let from = self.frames.partition_point(|(at, _)| *at + SURROUNDINGS < end);
        let to = self.frames.partition_point(|(at, _)| *at <= end + SURROUNDINGS);
        match self.frames.get(from..to) {
            Some(around) if !around.is_empty() => share_lost(around),
            _ => self.loss_rate(),
        }
    }
}

fn share_lost(frames: &[(Duration, bool)]) -> f64 {
    frames.iter().filter(|(_, delivered)| !delivered).count() as f64 / frames.len().max(1) as f64
}

impl LinkLoss for Replayed {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        let end = frame.at + frame.airtime;
        let end = Duration::from_nanos((end.as_nanos() % self.period.as_nanos().max(1)) as u64);
        let delivered = self.fate(end).unwrap_or_else(|| !rng.bernoulli(self.loss_around(end)));
        FrameFate::lost_if(!delivered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::LossModel;
    use crate::loss::tests::{losses, share};

    fn replayed(frames: &[(u64, bool)]) -> Replayed {
        Replayed::new(frames.iter().map(|&(ms, delivered)| (Duration::from_millis(ms), delivered))).unwrap()
    }

    #[test]
    fn the_same_frames_are_lost_again() {
        // Frames of `losses` begin each second and end half a second later.
        let recorded: Vec<(u64, bool)> = (0..40).map(|n| (1000 * n + 540 - n % 3 * 40, n % 4 != 1)).collect();
        let lost = losses(&LossModel::from(replayed(&recorded)), Duration::from_secs(1), 40);
        assert_eq!(lost, recorded.iter().map(|(_, delivered)| !delivered).collect::<Vec<_>>());
    }

    #[test]
    fn other_frames_are_lost_as_often_as_those_around_them() {
        let quiet = (0..300).map(|n| (1000 * n, true));
        let loud = (300..600).map(|n| (1000 * n, n % 2 == 0));
        let model = LossModel::from(replayed(&quiet.chain(loud).collect::<Vec<_>>()));
        let lost = losses(&model, Duration::from_secs(1), 600);
        assert_eq!(share(&lost[..230]), 0.0);
        assert!((0.35..0.65).contains(&share(&lost[370..])), "{}", share(&lost[370..]));
    }

    #[test]
    fn the_record_starts_again_after_its_end() {
        let model = replayed(&[(500, false), (1500, true)]);
        assert_eq!(model.fate(Duration::from_millis(450)), Some(false));
        let lost = losses(&LossModel::from(model), Duration::from_millis(61_500), 2);
        assert_eq!(lost, [true, true], "a frame at 0 s and one a period later");
        assert_eq!(Replayed::new([]), None);
    }
}
