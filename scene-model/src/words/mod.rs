//! Visual words of a frame: colour, context, spread, texture and binary features on regular grids, with untrained
//! vocabularies.
//!
//! Ids are consecutive in that order. The tone stretch and the statistics that the words are
//! measured against come from the first frames (`warm_up_frames`) and then stay frozen, so that a word keeps its
//! meaning through a mission; a mosaic is one frame, hence measured against itself.

mod binary;
mod colour;
mod context;
mod field;
mod grid;
mod plane;
mod stretch;
mod texture;

use image::RgbImage;
use serde::{Deserialize, Serialize};

use binary::Binary;
use colour::Colour;
pub use colour::LEVELS as COLOUR_LEVELS;
use context::{Context, Spread};
use field::Field;
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
    /// Words per cell for the mean colour and contrast of about three cells around.
    pub context: u32,
    /// Words per cell for the spread of colours within about two cells around.
    pub spread: u32,
    /// Texture words per cell.
    pub texture: u32,
    /// Binary words per cell.
    pub binary: u32,
    /// Frames that the tone stretch and the word statistics are estimated on; at least 1.
    pub warm_up_frames: u32,
}

impl Default for WordConfig {
    fn default() -> Self {
        Self { colour: 36, context: 9, spread: 9, texture: 9, binary: 4, warm_up_frames: 16 }
    }
}

impl WordConfig {
    /// Number of different words.
    pub fn vocabulary_size(&self) -> u32 {
        first_id(5)
    }
}

/// What an extractor measures words against; keep it with the model, or the words mean something else after a restart.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measures {
    config: WordConfig,
    frames: u32,
    stretch: Stretch,
    colour: Colour,
    context: Context,
    spread: Spread,
    texture: [Moments; 3],
}

impl Measures {
    /// How many words of each kind a cell gets.
    pub fn config(&self) -> &WordConfig {
        &self.config
    }
}

/// First id of the `kind`-th vocabulary: colour, context, spread, texture, binary, none.
fn first_id(kind: usize) -> u32 {
    let sizes = [colour::SIZE, context::SIZE, context::SPREAD_SIZE, texture::SIZE, binary::SIZE];
    sizes.iter().take(kind).sum()
}

/// Finds the visual words of frames, one after another.
#[derive(Clone, Debug)]
pub struct WordExtractor {
    config: WordConfig,
    frames: u32,
    stretch: Stretch,
    colour: Colour,
    context: Context,
    spread: Spread,
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
            context: Context::default(),
            spread: Spread::default(),
            texture: Texture::default(),
            binary: Binary::default(),
        }
    }

    /// An extractor that goes on where another one was.
    pub fn from_measures(measures: Measures) -> Self {
        Self {
            config: measures.config,
            frames: measures.frames,
            stretch: measures.stretch.restored(),
            colour: measures.colour,
            context: measures.context,
            spread: measures.spread,
            texture: Texture::with_energy(measures.texture),
            binary: Binary::default(),
        }
    }

    /// Measures learnt from a set of images before a mission, frozen: tones from all of them first, then the rest.
    ///
    /// `images` is called twice and gives the same images each time, so that not all of them are held at once. Each
    /// comes with the edge of a cell in its pixels; those that [`WordExtractor::extract`] would refuse are passed over.
    pub fn train<I: Iterator<Item = (RgbImage, f32)>>(config: &WordConfig, images: impl Fn() -> I) -> Measures {
        let mut extractor = Self::new(config);
        let usable = || images().filter(|(image, cell_px)| is_usable(image, *cell_px));
        usable().for_each(|(image, _)| extractor.stretch.learn(&image));
        for (image, cell_px) in usable() {
            extractor.words(&image, cell_px, true);
        }
        extractor.frames = u32::MAX;
        extractor.measures()
    }

    /// What the words are measured against by now.
    pub fn measures(&self) -> Measures {
        Measures {
            config: self.config.clone(),
            frames: self.frames,
            stretch: self.stretch.clone(),
            colour: self.colour.clone(),
            context: self.context.clone(),
            spread: self.spread.clone(),
            texture: self.texture.learnt(),
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
        if !is_usable(frame, cell_px) {
            return Vec::new();
        }
        let learn = self.frames < self.config.warm_up_frames.max(1);
        self.frames = self.frames.saturating_add(1);
        if learn {
            self.stretch.learn(frame);
        }
        self.words(frame, cell_px, learn)
    }

    fn words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool) -> Vec<Word> {
        let mut words = Vec::new();
        self.colour_words(frame, cell_px, learn, &mut words);
        self.texture_words(frame, cell_px, learn, &mut words);
        words
    }

    fn colour_words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool, words: &mut Vec<Word>) {
        let WordConfig { colour, context, spread, .. } = self.config;
        if colour + context + spread == 0 {
            return;
        }
        let field = Field::new(frame, &self.stretch, spacing(cell_px, if colour > 0 { colour } else { 36 }), cell_px);
        if colour > 0 {
            self.colour.extract(&field, learn, first_id(0), words);
        }
        if context > 0 {
            self.context.extract(&field, spacing(cell_px, context), learn, first_id(1), words);
        }
        if spread > 0 {
            self.spread.extract(&field, spacing(cell_px, spread), learn, first_id(2), words);
        }
    }

    fn texture_words(&mut self, frame: &RgbImage, cell_px: f32, learn: bool, words: &mut Vec<Word>) {
        let WordConfig { texture, binary, .. } = self.config;
        if texture + binary == 0 {
            return;
        }
        let levels = Plane::pyramid(self.stretch.grey(frame));
        if texture > 0 {
            self.texture.extract(&levels, spacing(cell_px, texture), learn, first_id(3), words);
        }
        if binary > 0 {
            self.binary.extract(&levels[1], spacing(cell_px, binary), first_id(4), words);
        }
    }
}

fn is_usable(frame: &RgbImage, cell_px: f32) -> bool {
    frame.width() > 0 && frame.height() > 0 && cell_px > 0.0
}

/// Distance between the words of a kind, pixels.
fn spacing(cell_px: f32, per_cell: u32) -> f32 {
    cell_px / (per_cell as f32).sqrt()
}

/// Mean CIE Lab colour of each cell, unstretched: cells across, cells down, colours row by row from the top left corner.
pub(crate) fn cell_lab(image: &RgbImage, cell_px: f32) -> (usize, usize, Vec<[f32; 3]>) {
    let cells = |length: u32| (length as f32 / cell_px).ceil().max(1.0) as usize;
    let (columns, rows) = (cells(image.width()), cells(image.height()));
    let place = |at: u32, count: usize| ((at as f32 / cell_px) as usize).min(count - 1);
    let across: Vec<usize> = (0..image.width()).map(|x| place(x, columns)).collect();
    let mut sums = vec![[0u64; 4]; columns * rows];
    for (y, row) in image.rows().enumerate() {
        let cells = &mut sums[place(y as u32, rows) * columns..][..columns];
        for (pixel, &column) in row.zip(&across) {
            let [red, green, blue] = pixel.0.map(u64::from);
            let sum = &mut cells[column];
            *sum = [sum[0] + red, sum[1] + green, sum[2] + blue, sum[3] + 1];
        }
    }
    let share = |sum: &[u64; 4]| [0, 1, 2].map(|i| sum[i] as f32 / (sum[3].max(1) as f32 * 255.0));
    (columns, rows, sums.iter().map(|sum| field::lab(share(sum))).collect())
}

/// Running mean and variance of one measure.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
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

    /// One for each component of the points of a sample.
    fn learn<const N: usize>(moments: &mut [Self; N], sample: &[[f32; N]]) {
        for point in sample {
            moments.iter_mut().zip(point).for_each(|(moments, &value)| moments.add(value));
        }
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
    fn all_kinds_are_found_in_about_the_configured_ratio() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        let words = extractor.extract(&speckle(500, 500), 25.0);
        for (kind, wanted) in [36.0, 9.0, 9.0, 9.0, 4.0f32].into_iter().enumerate() {
            let ids = first_id(kind)..first_id(kind + 1);
            let found = words.iter().filter(|word| ids.contains(&word.id)).count() as f32 / 400.0;
            assert!((found / wanted - 1.0).abs() < 0.1, "kind {kind}: {found}");
        }
    }

    #[test]
    fn the_same_frame_gives_the_same_words_once_the_measures_stand_still() {
        let mut extractor = WordExtractor::new(&WordConfig { warm_up_frames: 1, ..WordConfig::default() });
        let first = extractor.extract(&speckle(160, 120), 20.0);
        extractor.extract(&RgbImage::from_pixel(160, 120, Rgb([200, 10, 10])), 20.0);
        assert_eq!(extractor.extract(&speckle(160, 120), 20.0), first);
    }

    #[test]
    fn words_keep_their_meaning_through_a_restart() {
        let mut extractor = WordExtractor::new(&WordConfig::default());
        extractor.extract(&speckle(160, 120), 20.0);
        let bytes = postcard::to_allocvec(&extractor.measures()).unwrap();
        let mut restarted = WordExtractor::from_measures(postcard::from_bytes(&bytes).unwrap());
        let next = speckle(200, 100);
        assert_eq!(restarted.extract(&next, 20.0), extractor.extract(&next, 20.0));
    }

    #[test]
    fn trained_measures_stand_still() {
        let images = [(speckle(100, 80), 20.0), (RgbImage::from_pixel(50, 50, Rgb([200, 9, 9])), 20.0)];
        let measures = WordExtractor::train(&WordConfig::default(), || images.iter().cloned());
        let mut extractor = WordExtractor::from_measures(measures);
        let first = extractor.extract(&images[0].0, 20.0);
        extractor.extract(&images[1].0, 20.0);
        assert_eq!(extractor.extract(&images[0].0, 20.0), first);
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
