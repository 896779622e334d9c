//! The choice of the patches of a camera frame that represent the labels best.

use scene_model::exemplars::{ExemplarPatch, ExemplarStore};
use scene_model::topics::{FlatCell, TopicId};
use scenecast_protocol::exemplar::edge_px;

/// Edge of a patch in pixels, the largest that is sent.
pub(super) const PATCH_PX: u32 = 128;
/// Distance in pixels between two candidate patches.
const STEP_PX: u32 = 64;
/// Minimum score of a patch that represents its label.
const MIN_SCORE: f32 = 0.3;

/// The map by which patches are scored.
pub(super) struct Judge<'a> {
    /// Sorted by row and column.
    pub(super) flat: &'a [FlatCell],
    pub(super) cell_m: f64,
    pub(super) metres_per_pixel: f64,
}

impl Judge<'_> {
    /// The topic at a place, and the mean confidence that the smallest image of the place shows only this topic.
    fn score(&self, place: (f64, f64)) -> Option<(TopicId, f32)> {
        let topic = self.at(place)?.topic;
        let reach = f64::from(edge_px(0)) * 0.375 * self.metres_per_pixel;
        let mut sum = 0.0;
        for (east, north) in (0..9).map(|i| (f64::from(i % 3 - 1), f64::from(i / 3 - 1))) {
            let cell = self.at((place.0 + reach * east, place.1 + reach * north));
            sum += cell.filter(|c| c.topic == topic).map_or(0.0, |c| c.confidence);
        }
        Some((topic, sum / 9.0))
    }

    fn at(&self, place: (f64, f64)) -> Option<&FlatCell> {
        let index = |metres: f64| (metres / self.cell_m).floor() as i32;
        let wanted = (index(place.1), index(place.0));
        let at = self.flat.binary_search_by_key(&wanted, |c| (c.y, c.x)).ok()?;
        self.flat.get(at)
    }

    /// Scores the kept patches again, because the labels of cells change as the model learns.
    pub(super) fn review(&self, store: &mut ExemplarStore) {
        store.review(|topic, place| {
            let (now, score) = self.score(place)?;
            (now == topic && score >= MIN_SCORE).then_some(score)
        });
    }

    /// Offers the patches of a frame, whose pixels `place_of` puts on the map. Those in the middle come first, because the
    /// camera distorts least there.
    pub(super) fn offer(
        &self,
        store: &mut ExemplarStore,
        frame: &image::RgbImage,
        place_of: impl Fn(f32, f32) -> Option<(f64, f64)>,
        t_s: f64,
    ) {
        let (width, height) = frame.dimensions();
        let edge = PATCH_PX.min(width).min(height);
        if edge < edge_px(0) {
            return;
        }
        for (left, top) in places(width - edge, height - edge) {
            let middle = (left as f32 + edge as f32 / 2.0, top as f32 + edge as f32 / 2.0);
            let Some(place) = place_of(middle.0, middle.1) else { continue };
            let Some((topic, score)) = self.score(place).filter(|s| s.1 >= MIN_SCORE) else { continue };
            if store.would_keep(topic, score) {
                let patch = image::imageops::crop_imm(frame, left, top, edge, edge).to_image().into();
                let pixel_m = self.metres_per_pixel;
                store.offer(topic, ExemplarPatch { patch, score, t_s, place, pixel_m });
            }
        }
    }
}

/// The corners of the candidate patches from the middle outwards. `across` and `down` are the pixels
/// that a patch leaves free.
fn places(across: u32, down: u32) -> Vec<(u32, u32)> {
    let along = |room: u32| {
        let steps = (room / 2) / STEP_PX;
        let middle = room / 2;
        (0..=2 * steps).map(move |i| middle + i * STEP_PX - steps * STEP_PX)
    };
    let mut all: Vec<(u32, u32)> = along(down).flat_map(|y| along(across).map(move |x| (x, y))).collect();
    let off = |at: u32, room: u32| u64::from(at.abs_diff(room / 2));
    all.sort_by_key(|&(x, y)| off(x, across).pow(2) + off(y, down).pow(2));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;

    /// The place of a pixel below a camera at the origin.
    fn below(u: f32, v: f32) -> Option<(f64, f64)> {
        Some(((f64::from(u) - 320.0) * 0.01, (240.0 - f64::from(v)) * 0.01))
    }

    /// A map of topic 1 west of the middle and of topic 2 east of it.
    fn halves(confidence: f32) -> Vec<FlatCell> {
        let cell = |x: i32, y: i32| FlatCell {
            x,
            y,
            z: 0,
            topic: TopicId(if x < 0 { 1 } else { 2 }),
            words: 9,
            confidence,
            perplexity: 1.0,
        };
        (-20..20).flat_map(|y| (-20..20).map(move |x| cell(x, y))).collect()
    }

    fn judge(flat: &[FlatCell]) -> Judge<'_> {
        Judge { flat, cell_m: 0.25, metres_per_pixel: 0.01 }
    }

    fn frame() -> RgbImage {
        RgbImage::from_fn(640, 480, |x, _| image::Rgb([if x < 320 { 10 } else { 200 }, 0, 0]))
    }

    #[test]
    fn each_visible_label_gets_a_patch_of_itself_alone() {
        let flat = halves(0.9);
        let mut store = ExemplarStore::new(4, PATCH_PX);
        judge(&flat).offer(&mut store, &frame(), below, 1.0);
        for (topic, shade) in [(1, 10), (2, 200)] {
            let best = store.best(TopicId(topic)).unwrap();
            assert!(best.score > 0.85, "{}", best.score);
            let small = crate::exemplar::middle(&best.patch, 0).unwrap().1;
            assert!(small.pixels().all(|p| p.0[0] == shade), "topic {topic} at {:?}", best.place);
        }
        assert!(store.all(TopicId(1)).len() > 1, "there are others to show");
    }

    #[test]
    fn a_relabelled_patch_is_no_exemplar_of_its_old_label() {
        let flat = halves(0.9);
        let mut store = ExemplarStore::new(4, PATCH_PX);
        judge(&flat).offer(&mut store, &frame(), below, 1.0);
        let mut changed = halves(0.5);
        changed.iter_mut().for_each(|c| c.topic = TopicId(2));
        judge(&changed).review(&mut store);
        assert!(store.best(TopicId(1)).is_none());
        assert!(store.best(TopicId(2)).unwrap().score < 0.6);
    }

    #[test]
    fn too_small_frames_give_no_patch() {
        let flat = halves(0.9);
        let mut store = ExemplarStore::new(4, PATCH_PX);
        judge(&flat).offer(&mut store, &RgbImage::new(63, 480), below, 1.0);
        assert!(store.best(TopicId(1)).is_none() && store.best(TopicId(2)).is_none());
        assert_eq!(places(0, 0), [(0, 0)]);
        assert_eq!(places(100, 150)[0], (50, 75));
    }
}
