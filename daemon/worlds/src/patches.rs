//! A procedural sea floor: an image with the class of each pixel.

use image::RgbImage;
use scene_model::random::derive;

use crate::noise::Noise;
use crate::patch_labels::PatchLabels;
use crate::skin::{self, Skin};

/// A procedural sea floor with known truth.
#[derive(Clone, Debug)]
pub struct Patches {
    /// The sea floor from above, without effects of light and water.
    pub image: RgbImage,
    /// The class of each pixel, row by row from the top.
    pub truth: Vec<u8>,
    /// Columns of the image, pixels.
    pub width: u32,
    /// Rows of the image, pixels.
    pub height: u32,
}

/// Draws a world of patches: a sample of the spatial Chinese Restaurant Process on patches of about `patch_px` pixels.
/// Each class has its own colours and texture.
///
/// At most `classes` classes occur (1 to 24), fewer if there are few patches. Sizes below 1 are raised to 1.
///
/// ```
/// let (a, b) = (scenecast_worlds::patches(3, 90, 60, 15, 6), scenecast_worlds::patches(3, 90, 60, 15, 6));
/// assert_eq!((a.image, a.truth), (b.image, b.truth));
/// ```
#[must_use]
pub fn patches(seed: u64, width_px: u32, height_px: u32, patch_px: u32, classes: u8) -> Patches {
    let (width, height, patch) = (width_px.max(1), height_px.max(1), patch_px.max(1));
    let classes = classes.clamp(1, skin::MAX_CLASSES);
    // Two more patches on each side, because the bent edges of the patches reach beyond the border.
    let (columns, rows) = (width.div_ceil(patch) as usize + 4, height.div_ceil(patch) as usize + 4);
    let patches = PatchLabels::sample(derive(seed, 1), columns, rows, classes);
    let skins = skin::palette(derive(seed, 2), classes);
    let painter = Painter { patch: patch as f32, patches, skins, noise: Noise::new(derive(seed, 3)) };
    let mut image = RgbImage::new(width, height);
    let mut truth = Vec::with_capacity(width as usize * height as usize);
    for (y, row) in image.as_mut().chunks_exact_mut(3 * width as usize).enumerate() {
        for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (class, colour) = painter.pixel(x as f32, y as f32);
            truth.push(class);
            *pixel = colour;
        }
    }
    Patches { image, truth, width, height }
}

struct Painter {
    patch: f32,
    patches: PatchLabels,
    skins: Vec<Skin>,
    noise: Noise,
}

impl Painter {
    /// The class and the colour of a pixel. Noise bends the edges of the patches, so that they look natural.
    fn pixel(&self, x: f32, y: f32) -> (u8, [u8; 3]) {
        let (u, v) = (x / self.patch + 2.0, y / self.patch + 2.0);
        let bend = |offset: f32| {
            let coarse = self.noise.value(u * 0.9 + offset, v * 0.9) - 0.5;
            let fine = self.noise.value(u * 4.1, v * 4.1 + offset) - 0.5;
            1.3 * coarse + 0.35 * fine
        };
        let class = self.patches.at(u + bend(17.0), v + bend(91.0));
        (class, self.skins[class as usize].colour(&self.noise, x, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn world_is_a_function_of_its_seed() {
        let (a, b) = (patches(5, 90, 60, 15, 6), patches(5, 90, 60, 15, 6));
        assert_eq!((a.image.as_raw(), &a.truth), (b.image.as_raw(), &b.truth));
        assert_ne!(a.truth, patches(6, 90, 60, 15, 6).truth);
        assert_eq!((a.truth.len(), a.width, a.height), (90 * 60, 90, 60));
    }

    #[test]
    fn world_has_several_classes_within_the_bound() {
        for seed in 0..6 {
            let world = patches(seed, 400, 300, 20, 6);
            let used: std::collections::BTreeSet<u8> = world.truth.iter().copied().collect();
            assert!(used.len() >= 3 && used.iter().all(|&class| class < 6), "seed {seed}: {used:?}");
        }
    }

    #[test]
    fn sizes_below_one_are_raised_to_one() {
        assert_eq!(patches(1, 0, 0, 0, 0).truth.len(), 1);
    }
}
