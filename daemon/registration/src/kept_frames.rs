//! Earlier frames, for closing loops: a bounded store.

use crate::camera_image::Thumbnail;
use crate::similarity::FramePose;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Largest number of frames, about 20 MB.
const MAX_FRAMES: usize = 1000;
/// A frame is kept when it is further from the last kept one than this share of its narrower side.
const SPACING: f64 = 0.15;
/// A frame of the past is a candidate from so many frames back on: before, the chain of frames has the same evidence.
const MIN_FRAMES_BACK: u32 = 6;
/// Candidates are at least so many frames apart.
const MIN_FRAMES_APART: u32 = 4;
/// Candidates have at least this expected overlap.
const MIN_OVERLAP: f64 = 0.1;
/// Rows and columns of the points by which an overlap is expected.
const POINTS: usize = 8;

/// A frame with its pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptFrame {
    /// Number of the frame since the start.
    pub(crate) number: u32,
    pub(crate) pose: FramePose,
    pub(crate) thumbnail: Thumbnail,
}

impl KeptFrame {
    /// The share of a frame at `pose` with an extent in metres that this frame shows.
    fn overlap(&self, pose: &FramePose, extent_m: [f64; 2]) -> f64 {
        let to_this = self.pose.to_map().inverse().after(&pose.to_map());
        let [width, height] = self.thumbnail.extent_m();
        let share = |i: usize| (i as f64 + 0.5) / POINTS as f64 - 0.5;
        let is_seen = |i: usize| {
            let at = Vector2::new(share(i % POINTS) * extent_m[0], share(i / POINTS) * extent_m[1]);
            let seen = to_this.apply(at);
            2.0 * seen.x.abs() < width && 2.0 * seen.y.abs() < height
        };
        (0..POINTS * POINTS).filter(|&i| is_seen(i)).count() as f64 / (POINTS * POINTS) as f64
    }
}

/// The kept frames in the order of their numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptFrames(Vec<KeptFrame>);

impl KeptFrames {
    /// Keeps a frame unless the last one is as good.
    pub(crate) fn offer(&mut self, frame: &KeptFrame) {
        let is_near = |last: &KeptFrame| {
            let side = last.thumbnail.extent_m().into_iter().fold(f64::INFINITY, f64::min);
            let turn = scenecast_core::wrap_rad(last.pose.heading_rad - frame.pose.heading_rad);
            last.pose.at().distance_m(frame.pose.at()) < SPACING * side && turn.abs() < 0.3
        };
        if self.0.last().is_some_and(is_near) {
            return;
        }
        if self.0.len() >= MAX_FRAMES {
            self.drop_one();
        }
        self.0.push(frame.clone());
    }

    /// Drops the frame that is nearest to an older one.
    fn drop_one(&mut self) {
        let distance = |i: usize| {
            let at = self.0[i].pose.at();
            self.0[..i].iter().map(|older| older.pose.at().distance_m(at)).fold(f64::INFINITY, f64::min)
        };
        if let Some(nearest) = (1..self.0.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))) {
            self.0.remove(nearest);
        }
    }

    /// The indices of at most `count` frames that overlap with the frame `number` at `pose` the most.
    pub(crate) fn candidates(&self, number: u32, pose: &FramePose, extent_m: [f64; 2], count: usize) -> Vec<usize> {
        let reach = 1.2 * extent_m[0].hypot(extent_m[1]);
        let near = self.0.iter().enumerate().filter(|(_, frame)| {
            frame.number + MIN_FRAMES_BACK <= number && frame.pose.at().distance_m(pose.at()) < reach
        });
        let mut near: Vec<(f64, usize)> = near.map(|(i, frame)| (frame.overlap(pose, extent_m), i)).collect();
        near.retain(|(overlap, _)| *overlap >= MIN_OVERLAP);
        let distance = |i: usize| self.0[i].pose.at().distance_m(pose.at());
        near.sort_by(|a, b| b.0.total_cmp(&a.0).then(distance(a.1).total_cmp(&distance(b.1))).then(a.1.cmp(&b.1)));
        let mut chosen: Vec<usize> = Vec::new();
        for (_, i) in near {
            let is_apart = |j: &usize| self.0[i].number.abs_diff(self.0[*j].number) >= MIN_FRAMES_APART;
            if chosen.len() < count && chosen.iter().all(is_apart) {
                chosen.push(i);
            }
        }
        chosen
    }

    pub(crate) fn get(&self, index: usize) -> Option<&KeptFrame> {
        self.0.get(index)
    }

    /// Whether the frames can be those of a registrar.
    pub(crate) fn is_sound(&self) -> bool {
        self.0.len() <= MAX_FRAMES
            && self.0.iter().all(|frame| frame.thumbnail.is_sound() && frame.pose.is_sound())
            && self.0.is_sorted_by(|a, b| a.number < b.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_image::{CameraImage, FlatField};
    use scenecast_protocol::coordinates::MapPoint;

    fn frame(number: u32, x_m: f64, y_m: f64) -> KeptFrame {
        let samples: Vec<u8> = (0..160 * 120u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let image = CameraImage::grey(160, 120, &samples).unwrap();
        let thumbnail = Thumbnail::new(&image, 0.04, &mut FlatField::default()).unwrap();
        KeptFrame { number, pose: FramePose::new(MapPoint::new(x_m, y_m), 0.0, 0.0), thumbnail }
    }

    #[test]
    fn candidates_overlap_and_lie_apart_in_time() {
        let mut kept = KeptFrames::default();
        (0..20).for_each(|i| kept.offer(&frame(i, f64::from(i), 0.0)));
        let pose = FramePose::new(MapPoint::new(10.2, 3.0), 0.0, 0.0);
        let chosen = kept.candidates(30, &pose, [6.4, 4.8], 3);
        let numbers: Vec<u32> = chosen.iter().map(|&i| kept.get(i).unwrap().number).collect();
        assert_eq!(numbers, [10, 14, 6]);
        assert!(kept.candidates(14, &pose, [6.4, 4.8], 3).iter().all(|&i| kept.get(i).unwrap().number <= 8));
        assert!(kept.candidates(30, &FramePose::new(MapPoint::new(10.0, 4.6), 0.0, 0.0), [6.4, 4.8], 3).is_empty());
    }

    #[test]
    fn a_full_store_drops_frames_of_places_that_it_has() {
        let mut kept = KeptFrames::default();
        (0..MAX_FRAMES as u32).for_each(|i| kept.offer(&frame(i, f64::from(i % 500), 0.2 * f64::from(i / 500))));
        (0..10u32).for_each(|i| kept.offer(&frame(2000 + i, -f64::from(i), 50.0)));
        assert_eq!(kept.0.len(), MAX_FRAMES);
        assert!((0..500).all(|i| kept.0[i as usize].number == i), "the first frame of each place stays");
        assert!(kept.is_sound());
        let before = kept.0.len();
        kept.offer(&frame(3000, -9.0, 50.1));
        assert_eq!(kept.0.len(), before, "it is as good as the last one");
    }
}
