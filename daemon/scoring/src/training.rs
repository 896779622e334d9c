//! Training of a vocabulary: the measures of visual words, learnt from images of a site.

use image::RgbImage;
use scene_model::words::{Measures, WordConfig, WordExtractor};

/// Learns the measures of a vocabulary from a set of images before a mission, and freezes them.
///
/// Each image comes with the edge of a cell in its pixels. The training has two passes: the tone stretch of all images,
/// then the means and deviations of their features. `images` is therefore called twice and must give the same images
/// each time, so that not all of them are in memory at once. Images without pixels, or with a cell edge that is not
/// above 0, are skipped.
///
/// ```
/// use scene_model::words::{WordConfig, WordExtractor};
/// use scenecast_scoring::train_vocabulary;
///
/// let site = || (1..4).map(|seed| (scenecast_worlds::patches(seed, 120, 90, 20, 5).image, 25.0));
/// let mut extractor = WordExtractor::from_measures(train_vocabulary(&WordConfig::default(), site));
/// let image = scenecast_worlds::patches(9, 120, 90, 20, 5).image;
/// assert_eq!(extractor.extract(&image, 25.0), extractor.extract(&image, 25.0));
/// ```
pub fn train_vocabulary<I: Iterator<Item = (RgbImage, f32)>>(config: &WordConfig, images: impl Fn() -> I) -> Measures {
    let mut extractor = WordExtractor::new(config);
    let usable = || images().filter(|(image, cell_px)| image.width() > 0 && image.height() > 0 && *cell_px > 0.0);
    usable().for_each(|(image, _)| extractor.learn_tones(&image));
    usable().for_each(|(image, cell_px)| extractor.learn_statistics(&image, cell_px));
    extractor.freeze();
    extractor.measures()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn speckle(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let bits = scene_model::random::mix(u64::from(x / 3) << 32 | u64::from(y / 2));
            Rgb([bits as u8, (bits >> 8) as u8 / 2, (bits >> 16) as u8 / 3 + 40])
        })
    }

    #[test]
    fn trained_measures_are_frozen() {
        let images = [(speckle(100, 80), 20.0), (RgbImage::from_pixel(50, 50, Rgb([200, 9, 9])), 20.0)];
        let measures = train_vocabulary(&WordConfig::default(), || images.iter().cloned());
        let mut extractor = WordExtractor::from_measures(measures);
        let first = extractor.extract(&images[0].0, 20.0);
        extractor.extract(&images[1].0, 20.0);
        assert_eq!(extractor.extract(&images[0].0, 20.0), first);
    }
}
