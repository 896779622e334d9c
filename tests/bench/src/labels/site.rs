//! Sea floors with their true classes, and worse sights of them.

use image::{GrayImage, Rgb, RgbImage};
use scene_model::random::mix;
use scenecast_core::UserError;
use scenecast_files::{read_classes, read_image};
use scenecast_worlds::Reef;
use std::collections::BTreeMap;
use std::path::Path;

/// Edge of a cell, metres and pixels.
pub(super) const CELL_M: f64 = 0.25;
pub(super) const CELL_PX: u32 = 25;
/// A class that is not annotated in drawn material.
const NO_CLASS: u8 = 255;

/// An image of a sea floor from above, a pixel a centimetre.
pub struct Site {
    pub(super) name: String,
    pub(super) image: RgbImage,
    /// The class of most pixels of each cell that is annotated, by column and row from the north-west.
    classes: BTreeMap<(u32, u32), u32>,
}

impl Site {
    fn new(name: String, image: RgbImage, classes: &GrayImage) -> Self {
        Self::annotated(name, image, classes, NO_CLASS)
    }

    fn annotated(name: String, image: RgbImage, classes: &GrayImage, no_class: u8) -> Self {
        let mut counts: BTreeMap<(u32, u32), BTreeMap<u8, u32>> = BTreeMap::new();
        for (x, y, pixel) in classes.enumerate_pixels() {
            *counts.entry((x / CELL_PX, y / CELL_PX)).or_default().entry(pixel.0[0]).or_default() += 1;
        }
        let most =
            |counts: BTreeMap<u8, u32>| counts.into_iter().max_by_key(|&(_, count)| count).map(|(class, _)| class);
        let class = |(place, counts)| Some((place, most(counts).filter(|&class| class != no_class)?.into()));
        Self { name, image, classes: counts.into_iter().filter_map(class).collect() }
    }

    /// The surveyed part of the drawn reef of a seed.
    pub fn reef(seed: u64) -> Self {
        let (image, classes) = Reef::new(seed).survey(CELL_M / f64::from(CELL_PX));
        Self::new(format!("reef {seed}"), image, &classes)
    }

    /// A mosaic with the classes of this file, or of NAME_label.png; without this file, the site has no classes.
    pub fn mosaic(path: &Path, classes: Option<&Path>, no_class: u8) -> Result<Self, UserError> {
        let image = read_image(path)?.to_rgb8();
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let file = classes.map_or_else(|| path.with_file_name(format!("{name}_label.png")), Path::to_owned);
        let (width, height) = image.dimensions();
        let classes = match classes.is_some() || file.is_file() {
            true => read_classes(&file, (width, height))?,
            false => vec![no_class; (width * height) as usize],
        };
        let classes = GrayImage::from_raw(width, height, classes).unwrap_or_default();
        Ok(Self::annotated(name, image, &classes, no_class))
    }

    /// Sand all over: a colour with grain of three sizes.
    pub fn sand() -> Self {
        let grain = |x: u32, y: u32, size: u32| (mix(u64::from(x / size) << 32 | u64::from(y / size)) % 17) as f64;
        let value = |x, y| (grain(x, y, 1) + grain(x, y, 3) + grain(x, y, 9)) / 1.5;
        Self::uniform("sand", move |x, y| [140, 130, 100].map(|base| base + value(x, y) as u8))
    }

    /// Nothing to see but the noise of the camera.
    pub fn featureless() -> Self {
        let noise = |x: u32, y: u32, channel: u64| (mix(u64::from(x) << 36 | u64::from(y) << 4 | channel) % 5) as u8;
        Self::uniform("featureless", move |x, y| [0, 1, 2].map(|channel| 88 + noise(x, y, channel)))
    }

    fn uniform(name: &str, pixel: impl Fn(u32, u32) -> [u8; 3]) -> Self {
        let image = RgbImage::from_fn(3000, 2500, |x, y| Rgb(pixel(x, y)));
        let classes = GrayImage::new(image.width(), image.height());
        Self::new(name.to_owned(), image, &classes)
    }

    #[cfg(test)]
    pub(super) fn two_grounds() -> Self {
        let image = RgbImage::from_fn(1500, 1000, |x, y| {
            let noise = (mix(u64::from(x) << 32 | u64::from(y)) % 24) as u8;
            Rgb(if x < 700 { [150 + noise, 140 + noise, 110 + noise] } else { [50 + noise, 90 + noise, 40 + noise] })
        });
        let classes = GrayImage::from_fn(1500, 1000, |x, _| image::Luma([u8::from(x < 700)]));
        Self::new("two grounds".to_owned(), image, &classes)
    }

    /// The true class of the cell at (x, y), which is north up with row -1 at the image's upper edge.
    pub(super) fn class(&self, (x, y): (i32, i32)) -> Option<u32> {
        self.classes.get(&(u32::try_from(x).ok()?, u32::try_from(-1 - y).ok()?)).copied()
    }

    /// Columns and rows of cells.
    pub(super) fn size(&self) -> (u32, u32) {
        (self.image.width() / CELL_PX, self.image.height() / CELL_PX)
    }
}

/// How the camera sees a floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sight {
    Grey,
    Turbid,
    Dark,
    Blurred,
}

impl Sight {
    pub(super) const OTHERS: [Self; 4] = [Self::Grey, Self::Turbid, Self::Dark, Self::Blurred];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Grey => "grey",
            Self::Turbid => "turbid",
            Self::Dark => "dark",
            Self::Blurred => "blurred",
        }
    }

    pub(super) fn of(self, image: &RgbImage) -> RgbImage {
        let each = |change: &dyn Fn(u32, u32, [u8; 3]) -> [f64; 3]| {
            RgbImage::from_fn(image.width(), image.height(), |x, y| {
                Rgb(change(x, y, image.get_pixel(x, y).0).map(|value| value.round().clamp(0.0, 255.0) as u8))
            })
        };
        match self {
            Self::Grey => {
                each(&|_, _, [r, g, b]| [0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b); 3])
            }
            // A third of the contrast under a veil of green water.
            Self::Turbid => each(&|_, _, pixel| {
                let veil = [40.0, 110.0, 90.0];
                [0, 1, 2].map(|c| 0.33 * f64::from(pixel[c]) + 0.67 * veil[c])
            }),
            // A fifth of the light with the noise of a sensor.
            Self::Dark => each(&|x, y, pixel| {
                let noise = |c: u64| (mix(u64::from(x) << 36 | u64::from(y) << 4 | c) % 9) as f64 - 4.0;
                [0, 1, 2].map(|c| 0.2 * f64::from(pixel[c]) + noise(c as u64))
            }),
            Self::Blurred => image::imageops::fast_blur(image, 3.0),
        }
    }
}
