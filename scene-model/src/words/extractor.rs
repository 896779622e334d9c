//! The extractor: frames in, visual words out.

use image::RgbImage;
use serde::{Deserialize, Serialize};

use super::binary::BinaryWords;
use super::colour::{ColourField, ColourWords};
use super::config::{Word, WordConfig};
use super::context::{ContextWords, SpreadWords};
use super::discriminant::{Discriminant, MEASURES, MeasuredPlace};
use super::flat_field::{Moments, Stretch};
use super::grey_plane::GreyPlane;
use super::ids::first_id;
use super::texture::TextureWords;

/// The tone stretch, means and deviations that features are compared with to become words.
///
/// Store it together with the model: with other measures the same word ids would mean something else.
/// [`vocabulary`](crate::vocabulary) turns it into bytes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measures {
    config: WordConfig,
    frames: u32,
    stretch: Stretch,
    colour: ColourWords,
    context: ContextWords,
    spread: SpreadWords,
    texture: [Moments; 3],
    /// Not part of the serialised measures: files have it beside them.
    #[serde(skip)]
    discriminant: Option<Discriminant>,
}

impl Measures {
    /// The configuration of the extractor that learnt these measures.
    #[must_use]
    pub fn config(&self) -> &WordConfig {
        &self.config
    }

    /// The discriminant of the extractor.
    #[must_use]
    pub fn discriminant(&self) -> Option<&Discriminant> {
        self.discriminant.as_ref()
    }

    /// Returns these measures with a discriminant. Serialised measures do not contain it.
    #[must_use]
    pub fn with_discriminant(self, discriminant: Option<Discriminant>) -> Self {
        Self { discriminant, ..self }
    }

    /// Returns whether the measures are frozen, so that frames change none of them.
    #[must_use]
    pub fn are_frozen(&self) -> bool {
        self.frames == FROZEN
    }

    /// Returns the number of different words (V).
    #[must_use]
    pub fn vocabulary_size(&self) -> u32 {
        vocabulary_size(&self.config, self.discriminant.as_ref())
    }
}

/// The number of frames of an extractor whose warm-up has ended.
const FROZEN: u32 = u32::MAX;

/// Extracts the visual words of frames, one after another.
///
/// ```
/// use image::{Rgb, RgbImage};
/// use scene_model::words::{WordConfig, WordExtractor};
///
/// let sand_beside_algae = RgbImage::from_fn(320, 240, |x, y| {
///     let shade = ((x * 7 + y * 13) % 32) as u8;
///     Rgb(if x < 160 { [190 + shade, 180 + shade, 150] } else { [60, 90 + shade, 50 + shade] })
/// });
/// let mut extractor = WordExtractor::new(&WordConfig::default());
/// // A cell is 40 pixels wide at this altitude.
/// let words = extractor.extract(&sand_beside_algae, 40.0);
///
/// // 8 x 6 cells with about 67 words each.
/// assert!((48 * 60..48 * 75).contains(&words.len()));
/// assert!(words.iter().all(|word| word.id < extractor.vocabulary_size()));
/// ```
#[derive(Clone, Debug)]
pub struct WordExtractor {
    config: WordConfig,
    frames: u32,
    stretch: Stretch,
    colour: ColourWords,
    context: ContextWords,
    spread: SpreadWords,
    texture: TextureWords,
    binary: BinaryWords,
    discriminant: Option<Discriminant>,
    /// Those of the last frame that was measured; their memory is used again for the next.
    scores: Scores,
}

impl WordExtractor {
    /// Returns an extractor at the beginning of its warm-up.
    #[must_use]
    pub fn new(config: &WordConfig) -> Self {
        Self {
            config: config.clone(),
            frames: 0,
            stretch: Stretch::default(),
            colour: ColourWords::default(),
            context: ContextWords::default(),
            spread: SpreadWords::default(),
            texture: TextureWords::default(),
            binary: BinaryWords::default(),
            discriminant: None,
            scores: Scores::default(),
        }
    }

    /// Returns an extractor that continues with the measures of another one, warm-up included.
    #[must_use]
    pub fn from_measures(measures: Measures) -> Self {
        Self {
            config: measures.config,
            frames: measures.frames,
            stretch: measures.stretch.restored(),
            colour: measures.colour,
            context: measures.context,
            spread: measures.spread,
            texture: TextureWords::with_energy(measures.texture),
            binary: BinaryWords::default(),
            discriminant: measures.discriminant,
            scores: Scores::default(),
        }
    }

    /// Adds an image to the tone stretch: the first pass of training a vocabulary, over all images of a site.
    ///
    /// See [`vocabulary`](crate::vocabulary) for both passes. A mission without a trained
    /// vocabulary learns in [`Self::extract`] instead.
    pub fn learn_tones(&mut self, image: &RgbImage) {
        self.stretch.learn(image);
    }

    /// Adds an image to the means and deviations of the features: the second pass of training, after the tone stretch
    /// is complete.
    ///
    /// `cell_px` is the edge of a cell in pixels. An image that [`Self::extract`] refuses is ignored.
    pub fn learn_statistics(&mut self, image: &RgbImage, cell_px: f32) {
        if is_usable(image, cell_px) {
            self.words(image, cell_px, true, false);
        }
    }

    /// Ends the warm-up: later frames change no measure.
    pub fn freeze(&mut self) {
        self.frames = FROZEN;
    }

    /// Returns a copy of the measures so far, to be stored with the model.
    #[must_use]
    pub fn measures(&self) -> Measures {
        Measures {
            config: self.config.clone(),
            frames: self.frames,
            stretch: self.stretch.clone(),
            colour: self.colour.clone(),
            context: self.context.clone(),
            spread: self.spread.clone(),
            texture: self.texture.learnt(),
            discriminant: self.discriminant.clone(),
        }
    }

    /// Returns the number of different words (V).
    #[must_use]
    pub fn vocabulary_size(&self) -> u32 {
        vocabulary_size(&self.config, self.discriminant.as_ref())
    }

    /// Returns the words of a frame; `cell_px` is the edge of a cell in pixels at this altitude.
    ///
    /// During the warm-up the frame is learnt from first. A frame without pixels, or a `cell_px` that is not above 0,
    /// gives no words. The same frames in the same order give the same words.
    pub fn extract(&mut self, frame: &RgbImage, cell_px: f32) -> Vec<Word> {
        if !is_usable(frame, cell_px) {
            return Vec::new();
        }
        let learn = self.begin_frame(frame);
        self.words(frame, cell_px, learn, self.discriminant.is_some())
    }

    /// Returns the measures of a frame, from which directions are learnt: a place for each word of a
    /// [`Discriminant`]. The frame counts as one of [`Self::extract`].
    ///
    /// There are none if [`WordConfig`] has no colour words, or different numbers of context, spread and texture words.
    pub fn measure(&mut self, frame: &RgbImage, cell_px: f32) -> Vec<MeasuredPlace> {
        if !is_usable(frame, cell_px) {
            return Vec::new();
        }
        let learn = self.begin_frame(frame);
        self.words(frame, cell_px, learn, true);
        self.scores.places().collect()
    }

    /// Counts a frame; returns whether it is learnt from.
    fn begin_frame(&mut self, frame: &RgbImage) -> bool {
        let learn = self.frames < self.config.warm_up_frames.max(1);
        self.frames = self.frames.saturating_add(1);
        if learn {
            self.stretch.learn(frame);
        }
        learn
    }

    fn words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool, measure: bool) -> Vec<Word> {
        let mut words = Vec::new();
        self.scores.clear();
        self.colour_words(frame, cell_px, learn, measure, &mut words);
        self.texture_words(frame, cell_px, learn, measure, &mut words);
        if let Some(discriminant) = &self.discriminant {
            discriminant.extract(self.scores.places(), first_id(5), &mut words);
        }
        words
    }

    fn colour_words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool, measure: bool, words: &mut Vec<Word>) {
        let WordConfig { colour, context, spread, .. } = self.config;
        if colour + context + spread == 0 {
            return;
        }
        let field =
            ColourField::lab(frame, &self.stretch, spacing(cell_px, if colour > 0 { colour } else { 36 }), cell_px);
        if colour > 0 {
            self.colour.extract(&field, learn, first_id(0), words);
        }
        if context > 0 {
            let kept = measure.then_some(&mut self.scores.context);
            self.context.extract(&field, spacing(cell_px, context), learn, first_id(1), words, kept);
        }
        if spread > 0 {
            let kept = measure.then_some(&mut self.scores.spread);
            self.spread.extract(&field, spacing(cell_px, spread), learn, first_id(2), words, kept);
        }
        if measure && colour > 0 && context > 0 {
            self.colour.scores(&field, spacing(cell_px, context), &mut self.scores.colour);
        }
    }

    fn texture_words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool, measure: bool, words: &mut Vec<Word>) {
        let WordConfig { texture, binary, .. } = self.config;
        if texture + binary == 0 {
            return;
        }
        let levels = GreyPlane::pyramid(self.stretch.grey(frame));
        if texture > 0 {
            let kept = measure.then_some(&mut self.scores.texture);
            self.texture.extract(&levels, spacing(cell_px, texture), learn, first_id(3), words, kept);
        }
        if binary > 0 {
            self.binary.extract(&levels[1], spacing(cell_px, binary), first_id(4), words);
        }
    }
}

/// The z-scores behind the words of a frame, each list in the order of its words.
#[derive(Clone, Debug, Default)]
struct Scores {
    colour: Vec<(f32, f32, [f32; 3])>,
    context: Vec<[f32; 4]>,
    spread: Vec<[f32; 3]>,
    texture: Vec<[f32; 3]>,
}

impl Scores {
    fn clear(&mut self) {
        self.colour.clear();
        self.context.clear();
        self.spread.clear();
        self.texture.clear();
    }

    /// The measures of the places, if all kinds lie on one grid.
    fn places(&self) -> impl Iterator<Item = MeasuredPlace> {
        let of_kinds = [self.context.len(), self.spread.len(), self.texture.len()];
        let count = if of_kinds == [self.colour.len(); 3] { self.colour.len() } else { 0 };
        (0..count).map(|i| {
            let (u, v, colour) = self.colour[i];
            let mut scores = [0.0; MEASURES];
            scores[..3].copy_from_slice(&colour);
            scores[3..7].copy_from_slice(&self.context[i]);
            scores[7..10].copy_from_slice(&self.spread[i]);
            scores[10..].copy_from_slice(&self.texture[i]);
            MeasuredPlace { u, v, scores }
        })
    }
}

fn vocabulary_size(config: &WordConfig, discriminant: Option<&Discriminant>) -> u32 {
    config.vocabulary_size() + discriminant.map_or(0, Discriminant::vocabulary_size)
}

fn is_usable(frame: &RgbImage, cell_px: f32) -> bool {
    frame.width() > 0 && frame.height() > 0 && cell_px > 0.0
}

/// The distance between neighbouring words of a kind, pixels.
fn spacing(cell_px: f32, per_cell: u32) -> f32 {
    cell_px / (per_cell as f32).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn speckle(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let bits = crate::random::mix(u64::from(x / 3) << 32 | u64::from(y / 2));
            Rgb([bits as u8, (bits >> 8) as u8 / 2, (bits >> 16) as u8 / 3 + 40])
        })
    }

    #[test]
    fn words_lie_in_the_frame_and_in_the_vocabulary() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        let words = extractor.extract(&speckle(203, 151), 25.0);
        assert!(words.len() > 49 * 8 * 6 / 2);
        for word in words {
            assert!(word.id < extractor.vocabulary_size());
            assert!((0.0..203.0).contains(&word.u) && (0.0..151.0).contains(&word.v));
        }
    }

    #[test]
    fn kinds_occur_in_about_the_configured_ratio() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        let words = extractor.extract(&speckle(500, 500), 25.0);
        for (kind, wanted) in [36.0, 9.0, 9.0, 9.0, 4.0f32].into_iter().enumerate() {
            let ids = first_id(kind)..first_id(kind + 1);
            let found = words.iter().filter(|word| ids.contains(&word.id)).count() as f32 / 400.0;
            assert!((found / wanted - 1.0).abs() < 0.1, "kind {kind}: {found}");
        }
    }

    #[test]
    fn equal_frames_give_equal_words_after_the_warm_up() {
        let mut extractor = WordExtractor::new(&WordConfig { warm_up_frames: 1, ..WordConfig::default() });
        let first = extractor.extract(&speckle(160, 120), 20.0);
        extractor.extract(&RgbImage::from_pixel(160, 120, Rgb([200, 10, 10])), 20.0);
        assert_eq!(extractor.extract(&speckle(160, 120), 20.0), first);
    }

    #[test]
    fn words_keep_their_meaning_after_a_restart() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        extractor.extract(&speckle(160, 120), 20.0);
        let bytes = postcard::to_allocvec(&extractor.measures()).unwrap();
        let mut restarted = WordExtractor::from_measures(postcard::from_bytes(&bytes).unwrap());
        let next = speckle(200, 100);
        assert_eq!(restarted.extract(&next, 20.0), extractor.extract(&next, 20.0));
    }

    #[test]
    fn tiny_and_uniform_images_are_accepted() {
        for size in [(1, 1), (1, 40), (2, 3)] {
            let mut extractor = WordExtractor::new(&WordConfig::default());
            let words = extractor.extract(&RgbImage::from_pixel(size.0, size.1, Rgb([9, 9, 9])), 25.0);
            assert!(!words.is_empty());
        }
        let mut extractor = WordExtractor::new(&WordConfig::default());
        assert!(extractor.extract(&RgbImage::new(0, 0), 25.0).is_empty());
        assert!(extractor.extract(&speckle(9, 9), f32::NAN).is_empty());
    }
}
