//! Visual words of a frame: colour, texture and binary features on regular grids, with untrained vocabularies.
//!
//! Ids are consecutive: colour, then texture, then binary. The tone stretch and the statistics that the words are
//! measured against come from the first frames (`warm_up_frames`) and then stay frozen, so that a word keeps its
//! meaning through a mission; a mosaic is one frame, hence measured against itself.

mod binary;
mod colour;
mod grid;
mod plane;
mod stretch;
mod texture;

use image::RgbImage;
use serde::{Deserialize, Serialize};

use binary::Binary;
use colour::Colour;
use plane::Plane;
use stretch::Stretch;
use texture::Texture;

/// A visual word and where it is in the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// Word id, below [`WordExtractor::vocabulary_size`].
    pub id: u32,
    /// Pixels from the left edge of the frame.
    pub u: f32,
    /// Pixels from the top edge of the frame.
    pub v: f32,
}

/// How many words of each kind a cell gets, and how long the extractor looks before its measures stand still.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WordConfig {
    /// Colour words per cell (about; the grid is regular).
    pub colour: u32,
    /// Texture words per cell.
    pub texture: u32,
    /// Binary words per cell.
    pub binary: u32,
    /// Frames that the tone stretch and the word statistics are estimated on; at least 1.
    pub warm_up_frames: u32,
}

impl Default for WordConfig {
    fn default() -> Self {
        Self { colour: 36, texture: 9, binary: 4, warm_up_frames: 16 }
    }
}

impl WordConfig {
    /// Number of different words.
    pub fn vocabulary_size(&self) -> u32 {
        colour::SIZE + texture::SIZE + binary::SIZE
    }
}

/// Finds the visual words of frames, one after another.
#[derive(Clone, Debug)]
pub struct WordExtractor {
    config: WordConfig,
    frames: u32,
    stretch: Stretch,
    colour: Colour,
    texture: Texture,
    binary: Binary,
}

impl WordExtractor {
    /// An extractor that has seen no frame.
    pub fn new(config: &WordConfig) -> Self {
        Self {
            config: config.clone(),
            frames: 0,
            stretch: Stretch::default(),
            colour: Colour::default(),
            texture: Texture::default(),
            binary: Binary::default(),
        }
    }

    /// Number of different words.
    pub fn vocabulary_size(&self) -> u32 {
        self.config.vocabulary_size()
    }

    /// The words of a frame; `cell_px` is the edge of one cell in pixels at this altitude.
    ///
    /// A frame without pixels or a `cell_px` that is not above 0 gives no words. The same frames in the same order give
    /// the same words.
    pub fn extract(&mut self, frame: &RgbImage, cell_px: f32) -> Vec<Word> {
        if frame.width() == 0 || frame.height() == 0 || cell_px.is_nan() || cell_px <= 0.0 {
            return Vec::new();
        }
        let learn = self.frames < self.config.warm_up_frames.max(1);
        self.frames = self.frames.saturating_add(1);
        if learn {
            self.stretch.learn(frame);
        }
        let mut words = Vec::new();
        let spacing = |count: u32| cell_px / (count as f32).sqrt();
        if self.config.colour > 0 {
            self.colour.extract(frame, &self.stretch, spacing(self.config.colour), learn, 0, &mut words);
        }
        if self.config.texture == 0 && self.config.binary == 0 {
            return words;
        }
        let levels = Plane::pyramid(self.stretch.grey(frame));
        if self.config.texture > 0 {
            self.texture.extract(&levels, spacing(self.config.texture), learn, colour::SIZE, &mut words);
        }
        if self.config.binary > 0 {
            let first = colour::SIZE + texture::SIZE;
            self.binary.extract(&levels[1], spacing(self.config.binary), first, &mut words);
        }
        words
    }
}

/// Running mean and variance of one measure.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f32) {
        self.count += 1.0;
        self.sum += f64::from(value);
        self.squares += f64::from(value).powi(2);
    }

    /// Mean, and 1 / standard deviation (0 where nothing varies).
    fn scale(&self) -> (f32, f32) {
        let count = self.count.max(1.0);
        let mean = self.sum / count;
        let variance = (self.squares / count - mean * mean).max(0.0);
        let inverse = if variance > 1e-12 { 1.0 / variance.sqrt() } else { 0.0 };
        (mean as f32, inverse as f32)
    }
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
    fn words_stay_inside_the_frame_and_the_vocabulary() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        let words = extractor.extract(&speckle(203, 151), 25.0);
        assert!(words.len() > 49 * 8 * 6 / 2);
        for word in words {
            assert!(word.id < extractor.vocabulary_size());
            assert!((0.0..203.0).contains(&word.u) && (0.0..151.0).contains(&word.v));
        }
    }

    #[test]
    fn all_three_kinds_are_found_in_about_the_configured_ratio() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        let words = extractor.extract(&speckle(500, 500), 25.0);
        let texture = colour::SIZE..colour::SIZE + texture::SIZE;
        let share = |count: usize| count as f32 / 400.0;
        let of_texture = words.iter().filter(|word| texture.contains(&word.id)).count();
        let of_colour = words.iter().filter(|word| word.id < texture.start).count();
        assert!((share(of_colour) - 36.0).abs() < 2.0);
        assert!((share(of_texture) - 9.0).abs() < 1.0);
        assert!((share(words.len() - of_colour - of_texture) - 4.0).abs() < 0.5);
    }

    #[test]
    fn the_same_frame_gives_the_same_words_once_the_measures_stand_still() {
        let mut extractor = WordExtractor::new(&WordConfig { warm_up_frames: 1, ..WordConfig::default() });
        let first = extractor.extract(&speckle(160, 120), 20.0);
        extractor.extract(&RgbImage::from_pixel(160, 120, Rgb([200, 10, 10])), 20.0);
        assert_eq!(extractor.extract(&speckle(160, 120), 20.0), first);
    }

    #[test]
    fn tiny_and_even_images_are_no_trouble() {
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
