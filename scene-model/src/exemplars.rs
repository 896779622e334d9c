//! Exemplars: the image patches that best show the meaning of a topic, in a store of bounded size.

use std::collections::BTreeMap;
use std::sync::Arc;

use image::{RgbImage, imageops};
use serde::{Deserialize, Serialize};

use crate::topics::TopicId;

/// A patch of a camera frame that shows a topic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarPatch {
    /// The pixels: a square of the store's edge.
    #[serde(with = "pixels")]
    pub patch: Arc<RgbImage>,
    /// How well the patch shows the topic; higher is better. A natural score is the cell's confidence.
    pub score: f32,
    /// The time of the frame, seconds.
    pub t_s: f64,
    /// The position on the ground: metres to the east and to the north.
    pub place: (f64, f64),
    /// The size of a pixel on the ground, metres.
    pub pixel_m: f64,
}

/// The best few patches of each topic.
///
/// ```
/// use image::RgbImage;
/// use scene_model::exemplars::{ExemplarPatch, ExemplarStore};
/// use scene_model::topics::TopicId;
///
/// let mut store = ExemplarStore::new(2, 32);
/// for (score, east) in [(0.5, 0.0), (0.9, 4.0), (0.7, 8.0)] {
///     let patch = RgbImage::new(64, 64).into();
///     store.offer(TopicId(3), ExemplarPatch { patch, score, t_s: 12.5, place: (east, 0.0), pixel_m: 0.004 });
/// }
/// let scores: Vec<f32> = store.all(TopicId(3)).iter().map(|exemplar| exemplar.score).collect();
/// assert_eq!(scores, [0.9, 0.7]);
/// assert_eq!(store.best(TopicId(3)).map(|exemplar| exemplar.patch.dimensions()), Some((32, 32)));
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ExemplarStore {
    per_label: usize,
    edge_px: u32,
    apart_m: f64,
    topics: BTreeMap<TopicId, Vec<ExemplarPatch>>,
}

/// The maximum number of topics. Beyond it, the topic whose best score is lowest is dropped.
const MAX_TOPICS: usize = 256;

impl ExemplarStore {
    /// Returns an empty store for at most 256 topics with at most `per_label` patches of
    /// `edge_px` x `edge_px` pixels each.
    #[must_use]
    pub fn new(per_label: usize, edge_px: u32) -> Self {
        Self { per_label: per_label.max(1), edge_px: edge_px.max(1), apart_m: 0.5, topics: BTreeMap::new() }
    }

    /// Sets the minimum distance between two patches of a topic in metres (0.5 by default), so
    /// that they show different objects.
    #[must_use]
    pub fn with_distance(self, apart_m: f64) -> Self {
        Self { apart_m, ..self }
    }

    /// Offers a patch, which is kept at the store's size if its score is high enough.
    ///
    /// `t_s` is the time of the frame in seconds, `place` its position in metres to the east and to the north. A NaN
    /// score and a patch without pixels are ignored.
    pub fn offer(&mut self, topic: TopicId, offered: ExemplarPatch) {
        let ExemplarPatch { patch, score, t_s, place, pixel_m } = offered;
        if score.is_nan() || patch.width() == 0 || patch.height() == 0 || !self.would_keep(topic, score) {
            return;
        }
        let edge = self.edge_px;
        let pixel_m = pixel_m * f64::from(patch.width()) / f64::from(edge);
        let patch = if patch.dimensions() == (edge, edge) {
            patch
        } else {
            imageops::resize(patch.as_ref(), edge, edge, imageops::FilterType::Triangle).into()
        };
        let apart = self.apart_m;
        let kept = self.topics.entry(topic).or_default();
        let near = |other: &ExemplarPatch| (other.place.0 - place.0).hypot(other.place.1 - place.1) < apart;
        if kept.iter().any(|other| near(other) && other.score >= score) {
            return;
        }
        kept.retain(|other| !near(other));
        let rank = kept.partition_point(|other| other.score >= score);
        kept.insert(rank, ExemplarPatch { patch, score, t_s, place, pixel_m });
        kept.truncate(self.per_label);
        self.drop_lowest_topic();
    }

    /// Whether a patch with this score could be kept now, so that the caller can avoid cropping it in vain.
    #[must_use]
    pub fn would_keep(&self, topic: TopicId, score: f32) -> bool {
        let kept = self.topics.get(&topic).map_or(&[][..], Vec::as_slice);
        kept.len() < self.per_label || kept.last().is_some_and(|worst| score > worst.score)
    }

    /// Replaces the score of every patch by `score(topic, place)`, and drops the patches for which it is `None` or NaN.
    ///
    /// Call it after refinement, since patches may then lie in cells of another topic.
    pub fn review(&mut self, score: impl Fn(TopicId, (f64, f64)) -> Option<f32>) {
        for (&topic, kept) in &mut self.topics {
            kept.retain_mut(|exemplar| match score(topic, exemplar.place).filter(|score| !score.is_nan()) {
                Some(score) => {
                    exemplar.score = score;
                    true
                }
                None => false,
            });
            kept.sort_by(|a, b| b.score.total_cmp(&a.score));
        }
        self.topics.retain(|_, kept| !kept.is_empty());
    }

    /// Returns the patch of a topic with the highest score.
    #[must_use]
    pub fn best(&self, topic: TopicId) -> Option<&ExemplarPatch> {
        self.topics.get(&topic)?.first()
    }

    /// Returns all patches of a topic, best first.
    #[must_use]
    pub fn all(&self, topic: TopicId) -> &[ExemplarPatch] {
        self.topics.get(&topic).map_or(&[], Vec::as_slice)
    }

    fn drop_lowest_topic(&mut self) {
        if self.topics.len() <= MAX_TOPICS {
            return;
        }
        let best = |kept: &[ExemplarPatch]| kept.first().map_or(f32::NEG_INFINITY, |exemplar| exemplar.score);
        let weakest = self.topics.iter().min_by(|a, b| best(a.1).total_cmp(&best(b.1)));
        if let Some(topic) = weakest.map(|entry| *entry.0) {
            self.topics.remove(&topic);
        }
    }
}

/// The serialised form of an image: width, height and bytes.
mod pixels {
    use std::sync::Arc;

    use image::RgbImage;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(image: &RgbImage, serializer: S) -> Result<S::Ok, S::Error> {
        (image.width(), image.height(), image.as_raw()).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<RgbImage>, D::Error> {
        let (width, height, raw): (u32, u32, Vec<u8>) = Deserialize::deserialize(deserializer)?;
        let is_whole = u64::from(width) * u64::from(height) * 3 == raw.len() as u64;
        let image = RgbImage::from_raw(width, height, raw).filter(|_| is_whole);
        image.map(Arc::new).ok_or_else(|| D::Error::custom("an image of another size than its bytes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch((width, height): (u32, u32), score: f32, east_m: f64) -> ExemplarPatch {
        let patch = RgbImage::new(width, height).into();
        ExemplarPatch { patch, score, t_s: 1.0, place: (east_m, 0.0), pixel_m: 0.01 }
    }

    fn offer(store: &mut ExemplarStore, topic: u32, score: f32) {
        store.offer(TopicId(topic), patch((20, 10), score, f64::from(score) * 100.0));
    }

    #[test]
    fn better_of_two_views_of_one_place_is_kept() {
        let mut store = ExemplarStore::new(4, 8);
        for (score, east) in [(0.5, 0.0), (0.4, 0.1), (0.3, 9.0), (0.8, 0.2)] {
            store.offer(TopicId(1), patch((8, 8), score, east));
        }
        let scores: Vec<f32> = store.all(TopicId(1)).iter().map(|exemplar| exemplar.score).collect();
        assert_eq!(scores, [0.8, 0.3]);
    }

    #[test]
    fn best_patches_are_kept_at_the_size_of_the_store() {
        let mut store = ExemplarStore::new(2, 16);
        for score in [0.3, 0.9, 0.1, 0.5, f32::NAN] {
            offer(&mut store, 4, score);
        }
        let scores: Vec<f32> = store.all(TopicId(4)).iter().map(|exemplar| exemplar.score).collect();
        assert_eq!(scores, [0.9, 0.5]);
        assert_eq!(store.best(TopicId(4)).unwrap().patch.dimensions(), (16, 16));
        assert!(store.best(TopicId(5)).is_none());
    }

    #[test]
    fn store_survives_serialisation() {
        let mut store = ExemplarStore::new(2, 4);
        offer(&mut store, 4, 0.5);
        let mut bytes = postcard::to_allocvec(&store).unwrap();
        let back: ExemplarStore = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(back.all(TopicId(4)), store.all(TopicId(4)));
        let width = bytes.iter().position(|&byte| byte == 4).unwrap();
        for at in width..bytes.len() {
            bytes[at] ^= 1;
            drop(postcard::from_bytes::<ExemplarStore>(&bytes));
        }
    }

    #[test]
    fn number_of_topics_is_bounded() {
        let mut store = ExemplarStore::new(1, 2);
        for topic in 0..400 {
            offer(&mut store, topic, if topic == 3 { 0.01 } else { 0.5 });
        }
        assert_eq!(store.topics.len(), MAX_TOPICS);
        assert!(store.best(TopicId(3)).is_none());
    }
}
