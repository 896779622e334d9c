//! Measurements of distances wait for the image of their time.

use crate::Stamp;
use std::collections::VecDeque;
use std::time::Duration;

/// The last measurements, each of which serves one image.
#[derive(Debug, Clone)]
pub struct DepthTrack<D> {
    waiting: VecDeque<(Stamp, D)>,
}

/// The measurement at the time of an image.
#[derive(Debug, Clone, PartialEq)]
pub enum DepthMatch<D> {
    Found(D),
    /// It may still come in.
    NotYet,
    Missing,
}

/// Measurements that are earlier than the last one by more than this are of another clock.
const JUMP: Duration = Duration::from_secs(1);

impl<D> Default for DepthTrack<D> {
    fn default() -> Self {
        Self { waiting: VecDeque::new() }
    }
}

impl<D> DepthTrack<D> {
    /// Longest time between an image and its measurement.
    pub const MAX_APART: Duration = Duration::from_millis(20);
    /// The most measurements that are kept.
    const MAX_WAITING: usize = 12;

    /// Takes a measurement. One from long before the last one begins the track anew, as the camera's clock went back.
    pub fn push(&mut self, stamp: Stamp, depth: D) {
        if self.waiting.back().is_some_and(|(last, _)| stamp.after(JUMP) < *last) {
            self.waiting.clear();
        }
        let after = self.waiting.partition_point(|(at, _)| *at < stamp);
        self.waiting.insert(after, (stamp, depth));
        self.waiting.drain(..self.waiting.len().saturating_sub(Self::MAX_WAITING));
    }

    /// The measurement nearest in time to an image, which is taken out with those before it.
    pub fn take(&mut self, stamp: Stamp) -> DepthMatch<D> {
        let apart = |at: &Stamp| at.seconds_since(stamp).abs();
        let nearest = self.waiting.iter().enumerate().min_by(|a, b| apart(&a.1.0).total_cmp(&apart(&b.1.0)));
        let nearest = nearest.map(|(index, (at, _))| (index, apart(at)));
        match nearest {
            Some((index, apart_s)) if apart_s <= Self::MAX_APART.as_secs_f64() => {
                let found = self.waiting.drain(..=index).next_back();
                found.map_or(DepthMatch::Missing, |(_, depth)| DepthMatch::Found(depth))
            }
            _ if self.waiting.back().is_some_and(|(last, _)| *last > stamp.after(Self::MAX_APART)) => {
                DepthMatch::Missing
            }
            _ => DepthMatch::NotYet,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> Stamp {
        Stamp::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn an_image_gets_the_depth_of_its_time() {
        let mut track = DepthTrack::default();
        assert_eq!(track.take(at(100)), DepthMatch::NotYet);
        [0, 33, 66, 100].into_iter().for_each(|ms| track.push(at(ms), ms));
        assert_eq!(track.take(at(70)), DepthMatch::Found(66));
        assert_eq!(track.take(at(66)), DepthMatch::Missing, "it was taken");
        assert_eq!(track.take(at(115)), DepthMatch::Found(100));
        assert_eq!(track.take(at(500)), DepthMatch::NotYet);
    }

    #[test]
    fn old_depth_is_dropped_and_a_clock_may_go_back() {
        let mut track = DepthTrack::default();
        (0..50).for_each(|i| track.push(at(100 * i), i));
        assert_eq!(track.take(at(100)), DepthMatch::Missing);
        track.push(at(4750), 98);
        assert_eq!(track.take(at(4750)), DepthMatch::Found(98), "it came late");
        track.push(at(10), 99);
        assert_eq!(track.take(at(10)), DepthMatch::Found(99));
        assert_eq!(track.take(at(4900)), DepthMatch::NotYet);
    }
}
