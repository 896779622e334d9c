//! Measurements of distances wait for the image of their time.

use crate::Stamp;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// The last measurements and those of images that wait, each of which serves one image.
#[derive(Debug, Clone)]
pub struct DepthTrack<D> {
    waiting: VecDeque<Measured<D>>,
}

#[derive(Debug, Clone)]
struct Measured<D> {
    stamp: Stamp,
    depth: D,
    bytes: usize,
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
    /// The most measurements without an image that are kept.
    const MAX_WAITING: usize = 30;
    /// The most bytes that are kept, but for the newest measurement.
    const MAX_BYTES: usize = 128 << 20;

    /// Takes a measurement of `bytes` bytes. Those of the images that wait, at these times, are kept as long as they wait. A
    /// measurement from long before the last one begins the track anew, as the camera's clock went back.
    pub fn push(&mut self, stamp: Stamp, depth: D, bytes: usize, images: impl IntoIterator<Item = Stamp>) {
        if self.waiting.back().is_some_and(|last| stamp.after(JUMP) < last.stamp) {
            self.waiting.clear();
        }
        let after = self.waiting.partition_point(|measured| measured.stamp < stamp);
        self.waiting.insert(after, Measured { stamp, depth, bytes });
        let claimed: BTreeSet<usize> = images.into_iter().filter_map(|image| self.nearest(image)).collect();
        self.shorten(&claimed);
    }

    /// Drops the oldest measurements that are too many, those without an image first.
    fn shorten(&mut self, claimed: &BTreeSet<usize>) {
        let newest = self.waiting.len().saturating_sub(1);
        let (with, without): (Vec<usize>, Vec<usize>) = (0..newest).partition(|index| claimed.contains(index));
        let mut bytes = self.waiting.iter().fold(0_usize, |sum, measured| sum.saturating_add(measured.bytes));
        let mut unclaimed = without.len() + usize::from(!claimed.contains(&newest));
        let mut dropped = BTreeSet::new();
        for index in without.into_iter().chain(with) {
            let is_claimed = claimed.contains(&index);
            if bytes > Self::MAX_BYTES || !is_claimed && unclaimed > Self::MAX_WAITING {
                bytes = bytes.saturating_sub(self.waiting[index].bytes);
                unclaimed -= usize::from(!is_claimed);
                dropped.insert(index);
            }
        }
        let mut index = 0..;
        self.waiting.retain(|_| index.next().is_some_and(|index| !dropped.contains(&index)));
    }

    /// The measurement nearest in time to an image, if it is near enough.
    fn nearest(&self, image: Stamp) -> Option<usize> {
        let apart = self.waiting.iter().map(|measured| measured.stamp.seconds_since(image).abs()).enumerate();
        let nearest = apart.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|(_, apart_s)| *apart_s <= Self::MAX_APART.as_secs_f64()).map(|(index, _)| index)
    }

    /// The measurement nearest in time to an image, which is taken out with those before it.
    pub fn take(&mut self, stamp: Stamp) -> DepthMatch<D> {
        match self.nearest(stamp) {
            Some(index) => {
                let found = self.waiting.drain(..=index).next_back();
                found.map_or(DepthMatch::Missing, |measured| DepthMatch::Found(measured.depth))
            }
            _ if self.waiting.back().is_some_and(|last| last.stamp > stamp.after(Self::MAX_APART)) => {
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

    fn push(track: &mut DepthTrack<i64>, ms: i64, depth: i64) {
        track.push(at(ms), depth, 1, []);
    }

    #[test]
    fn an_image_gets_the_depth_of_its_time() {
        let mut track = DepthTrack::default();
        assert_eq!(track.take(at(100)), DepthMatch::NotYet);
        [0, 33, 66, 100].into_iter().for_each(|ms| push(&mut track, ms, ms));
        assert_eq!(track.take(at(70)), DepthMatch::Found(66));
        assert_eq!(track.take(at(66)), DepthMatch::Missing, "it was taken");
        assert_eq!(track.take(at(115)), DepthMatch::Found(100));
        assert_eq!(track.take(at(500)), DepthMatch::NotYet);
    }

    #[test]
    fn old_depth_is_dropped_and_a_clock_may_go_back() {
        let mut track = DepthTrack::default();
        (0..50).for_each(|i| push(&mut track, 100 * i, i));
        assert_eq!(track.take(at(100)), DepthMatch::Missing);
        push(&mut track, 4750, 98);
        assert_eq!(track.take(at(4750)), DepthMatch::Found(98), "it came late");
        push(&mut track, 10, 99);
        assert_eq!(track.take(at(10)), DepthMatch::Found(99));
        assert_eq!(track.take(at(4900)), DepthMatch::NotYet);
    }

    #[test]
    fn depth_is_kept_as_long_as_its_image_waits() {
        let mut track = DepthTrack::default();
        // Depth at 30 Hz for two seconds; images at 5 Hz, all of which wait for their poses.
        let images: Vec<i64> = (0..10).map(|i| 200 * i + 5).collect();
        for ms in (0..60).map(|i| i * 100 / 3) {
            let came = images.iter().filter(|image| **image <= ms + 30).map(|image| at(*image));
            track.push(at(ms), ms, 1, came);
        }
        assert!(track.waiting.len() <= DepthTrack::<i64>::MAX_WAITING + images.len());
        for image in images {
            let DepthMatch::Found(ms) = track.take(at(image)) else { panic!("none at {image} ms") };
            assert!((ms - image).abs() <= 20, "{ms} for {image}");
        }
    }

    #[test]
    fn large_measurements_are_kept_up_to_their_bytes() {
        let mut track = DepthTrack::default();
        let half = DepthTrack::<i64>::MAX_BYTES / 2;
        (0..4).for_each(|i| track.push(at(100 * i), i, half, [at(100)]));
        assert_eq!(track.take(at(100)), DepthMatch::Found(1), "an image waits for it");
        assert_eq!(track.take(at(300)), DepthMatch::Found(3));
        track.push(at(400), 4, usize::MAX, []);
        assert_eq!(track.take(at(400)), DepthMatch::Found(4), "the newest one stays");
    }
}
