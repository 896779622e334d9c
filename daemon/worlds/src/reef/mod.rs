//! A sea floor of 120 x 80 m that looks like one: rippled sand, a channel, rubble, seagrass, corals, boulders, a wreck.
//!
//! Everything is a function of the seed and of the position. Nothing of a floor is stored except the tiles that the
//! camera has drawn last; patterns of 51 MB, which all floors share, are painted at the first use.

mod camera;
mod corals;
mod fields;
mod grass;
mod ground;
mod layout;
mod optics;
mod patterns;
mod relief;
mod scatter;
mod shading;
mod surface;
mod texture;
mod things;

pub use camera::ReefCamera;
pub use optics::View;

use ground::Ground;
use image::{GrayImage, RgbImage};
use layout::Layout;
use optics::Water;
use scene_model::random::{CounterRng, derive};
use surface::Surface;

const SAND: u8 = 0;
const RUBBLE: u8 = 1;
const SEAGRASS: u8 = 2;
const CORAL: u8 = 3;
const THICKET: u8 = 4;
const ROCK: u8 = 5;
const WRECK: u8 = 6;

const NAMES: [&str; 7] = ["sand", "rubble", "seagrass", "coral", "branching coral", "rock and algae", "wreck"];

/// The sea floor of one seed.
///
/// ```
/// use scenecast_worlds::{Reef, ReefCamera, View};
///
/// let reef = Reef::new(1);
/// let class = reef.class_at(60.0, 40.0);
/// println!("{} at a depth of {:.1} m", Reef::class_names()[usize::from(class)], 20.0 - reef.relief_m(60.0, 40.0));
///
/// let view = View {
///     x_m: 60.0, y_m: 40.0, heading_rad: 0.0, altitude_m: 4.0, width_px: 64, height_px: 48, moment: 0,
/// };
/// let mut camera = ReefCamera::new(reef, 0.01);
/// assert_eq!(camera.frame(&view), camera.frame(&view));
/// ```
#[derive(Clone, Debug)]
pub struct Reef {
    key: u64,
    layout: Layout,
    ground: Ground,
    water: Water,
}

impl Reef {
    /// Metres from west to east, and from south to north.
    pub const SIZE_M: [f64; 2] = [120.0, 80.0];
    /// West, south, east and north limits of a survey that meets sand, meadow and reef early, and the wreck at its edge.
    pub const SURVEY_M: [f64; 4] = [45.0, 28.0, 75.0, 53.0];

    /// The sea floor of a seed. This draws nothing yet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let key = derive(seed, 0x5EA);
        let (sin, cos) = (std::f64::consts::PI * CounterRng::new(derive(key, 3)).unit()).sin_cos();
        Self {
            key,
            layout: Layout::new(key),
            ground: Ground::new(derive(key, 4), [cos as f32, sin as f32]),
            water: Water::new(derive(key, 5)),
        }
    }

    /// The names of the classes, by their number.
    #[must_use]
    pub fn class_names() -> &'static [&'static str] {
        &NAMES
    }

    /// The class of what covers the floor at a position.
    #[must_use]
    pub fn class_at(&self, x_m: f64, y_m: f64) -> u8 {
        self.class_of_square(x_m - 0.005, y_m - 0.005, 0.01)
    }

    /// The class that covers most of a square, by its south-west corner and its edge in metres.
    #[must_use]
    pub fn class_of_square(&self, west_m: f64, south_m: f64, edge_m: f64) -> u8 {
        let pitch = (edge_m / 6.0).clamp(0.01, 0.25);
        let first = |low: f64| (low / pitch).round() as i32;
        let count = ((edge_m / pitch).round() as usize).clamp(1, 64);
        let surface = Surface::of_classes(self, [first(west_m), first(south_m)], [count; 2], pitch as f32);
        let mut counts = [0u32; NAMES.len()];
        surface.class.iter().for_each(|&class| counts[usize::from(class)] += 1);
        let most = counts.iter().max().copied().unwrap_or(0);
        counts.iter().position(|&count| count == most).unwrap_or(0) as u8
    }

    /// Metres of the floor above the nominal depth; heads, boulders and the wreck not counted.
    #[must_use]
    pub fn relief_m(&self, x_m: f64, y_m: f64) -> f64 {
        f64::from(self.layout.at(x_m as f32, y_m as f32).relief_m)
    }

    /// The middle of the wreck, metres.
    #[must_use]
    pub fn wreck_m(&self) -> [f64; 2] {
        [f64::from(self.layout.berth.x), f64::from(self.layout.berth.y)]
    }

    /// The surveyed part of the floor ([`Reef::SURVEY_M`]) and its classes, as [`Reef::picture`] and [`Reef::classes`] draw them.
    #[must_use]
    pub fn survey(&self, metres_per_pixel: f64) -> (RgbImage, GrayImage) {
        let [west, south, east, north] = Self::SURVEY_M;
        let [columns, rows] = [east - west, north - south].map(|metres| (metres / metres_per_pixel).round() as u32);
        let picture = self.picture(west, south, columns, rows, metres_per_pixel);
        (picture, self.classes(west, south, columns, rows, metres_per_pixel))
    }

    /// The floor from above, without the effects of water and camera; the first row is the northern one.
    #[must_use]
    pub fn picture(&self, west_m: f64, south_m: f64, columns: u32, rows: u32, metres_per_pixel: f64) -> RgbImage {
        let raster = Raster::new([west_m, south_m], [columns, rows], metres_per_pixel);
        let mut light = shading::shade(&Surface::new(self, raster.corner, raster.size, raster.pitch_m));
        raster.turn_north_up(&mut light);
        optics::develop(&light, raster.size[0] as u32, raster.size[1] as u32)
    }

    /// The class of each pixel of [`Reef::picture`] with the same arguments.
    #[must_use]
    pub fn classes(&self, west_m: f64, south_m: f64, columns: u32, rows: u32, metres_per_pixel: f64) -> GrayImage {
        let raster = Raster::new([west_m, south_m], [columns, rows], metres_per_pixel);
        let mut classes = Surface::of_classes(self, raster.corner, raster.size, raster.pitch_m).class;
        raster.turn_north_up(&mut classes);
        GrayImage::from_raw(raster.size[0] as u32, raster.size[1] as u32, classes).unwrap_or_default()
    }
}

/// The pixels of a picture from above, as nodes of the floor.
struct Raster {
    corner: [i32; 2],
    /// Columns and rows, at least one each.
    size: [usize; 2],
    pitch_m: f32,
}

impl Raster {
    fn new(south_west_m: [f64; 2], size: [u32; 2], metres_per_pixel: f64) -> Self {
        let pitch = metres_per_pixel.max(0.001);
        let corner = south_west_m.map(|low| (low / pitch).round() as i32);
        Self { corner, size: size.map(|count| count.max(1) as usize), pitch_m: pitch as f32 }
    }

    /// Reverses rows that begin in the south.
    fn turn_north_up<T>(&self, values: &mut [T]) {
        let [width, height] = self.size;
        for row in 0..height / 2 {
            let (lower, upper) = values.split_at_mut((height - 1 - row) * width);
            lower[row * width..][..width].swap_with_slice(&mut upper[..width]);
        }
    }
}

#[cfg(test)]
mod tests;
