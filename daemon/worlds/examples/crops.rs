//! Crops of photos of the sea floor and of drawn reefs, mixed, for people who sort them:
//! `cargo run --release -p scenecast-worlds --example crops -- OUT PHOTO=METRES_PER_PIXEL...`
//!
//! OUT/mixed.png has 20 crops in rows of 5, OUT/key.txt tells which of them are drawn, OUT/drawn.png and OUT/real.png
//! have ten each. All show 2.6 x 2 m, or as much of that as a photo has, and are resampled and blurred alike. The photos
//! are not part of the project.
#![allow(clippy::disallowed_methods)]

use image::imageops::{FilterType, blur, crop_imm, overlay, resize};
use image::{Rgb, RgbImage};
use scene_model::random::CounterRng;
use scenecast_worlds::{Reef, ReefCamera, View};

/// Width and height of a crop, pixels and metres.
const CROP_PX: (u32, u32) = (260, 200);
const CROP_M: (f64, f64) = (2.6, 2.0);
const GAP: u32 = 6;
/// Standard deviation of the blur of all crops, pixels: photos that were scaled down would be sharper than others.
const BLUR_PX: f32 = 0.6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("the folder for the crops is missing")?;
    let photos: Vec<String> = arguments.collect();
    let mut rng = CounterRng::new(16);
    let drawn: Vec<RgbImage> = (0..10).map(|i| drawn(i, &mut rng)).collect();
    sheet(&drawn).save(format!("{out}/drawn.png"))?;
    let mut real = Vec::new();
    for i in 0..if photos.is_empty() { 0 } else { 10 } {
        let (path, scale) =
            photos[i % photos.len()].rsplit_once('=').ok_or("a photo is given as FILE=METRES_PER_PIXEL")?;
        let photo = image::open(path)?.to_rgb8();
        let scale: f64 = scale.parse()?;
        real.push(crop(&photo, scale, &mut rng));
    }
    if !real.is_empty() {
        sheet(&real).save(format!("{out}/real.png"))?;
    }
    let mut all: Vec<(bool, RgbImage)> = drawn.into_iter().map(|crop| (true, crop)).collect();
    all.extend(real.into_iter().map(|crop| (false, crop)));
    for i in (1..all.len()).rev() {
        all.swap(i, rng.below(i + 1));
    }
    let key: Vec<String> = all
        .iter()
        .enumerate()
        .map(|(i, crop)| format!("{} {}\n", i + 1, if crop.0 { "drawn" } else { "real" }))
        .collect();
    std::fs::write(format!("{out}/key.txt"), key.concat())?;
    sheet(&all.into_iter().map(|crop| crop.1).collect::<Vec<_>>()).save(format!("{out}/mixed.png"))?;
    Ok(())
}

/// A crop of a frame over the survey's area of a reef; every other one has a reef, a meadow or the wreck in it.
fn drawn(number: u64, rng: &mut CounterRng) -> RgbImage {
    let reef = Reef::new(100 + number);
    let wanted = [3, 0, 4, 2, 3, 1, 5, 3, 0, 6][number as usize % 10];
    let [west, south, east, north] = Reef::SURVEY_M;
    let mut place = || (west + (east - west) * rng.unit(), south + (north - south) * rng.unit());
    let mut at = place();
    for _ in 0..400 {
        if reef.class_of_square(at.0, at.1, 0.5) == wanted {
            break;
        }
        at = place();
    }
    let heading_rad = std::f64::consts::TAU * rng.unit();
    let view =
        View { x_m: at.0, y_m: at.1, heading_rad, altitude_m: 4.0, width_px: 640, height_px: 480, moment: number };
    let frame = ReefCamera::new(reef, 0.01).frame(&view);
    crop(&frame, 0.01, rng)
}

/// A part of an image at random, in the size of all crops.
fn crop(image: &RgbImage, metres_per_pixel: f64, rng: &mut CounterRng) -> RgbImage {
    let wanted = [CROP_M.0 / metres_per_pixel, CROP_M.1 / metres_per_pixel];
    let [width, height] = [image.width(), image.height()].map(f64::from);
    let share = (width / wanted[0]).min(height / wanted[1]).min(1.0);
    let size = wanted.map(|pixels| ((pixels * share) as u32).max(1));
    let free = [image.width().saturating_sub(size[0]), image.height().saturating_sub(size[1])];
    let [left, top] = free.map(|free| (rng.unit() * f64::from(free)) as u32);
    let part = crop_imm(image, left, top, size[0], size[1]).to_image();
    blur(&resize(&part, CROP_PX.0, CROP_PX.1, FilterType::Triangle), BLUR_PX)
}

fn sheet(crops: &[RgbImage]) -> RgbImage {
    let rows = crops.len().div_ceil(5) as u32;
    let (wide, high) = (CROP_PX.0 + GAP, CROP_PX.1 + GAP);
    let mut sheet = RgbImage::from_pixel(5 * wide, rows * high, Rgb([255; 3]));
    for (i, crop) in (0u32..).zip(crops) {
        overlay(&mut sheet, crop, i64::from(i % 5 * wide), i64::from(i / 5 * high));
    }
    sheet
}
