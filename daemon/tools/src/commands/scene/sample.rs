//! `scenecast scene sample`

use clap::Args;
use scenecast_core::palette::colour;
use scenecast_core::{Takes, UserError};
use scenecast_files::write_whole;
use scenecast_worlds::{LabelWorld, sample};
use std::path::PathBuf;

/// Words in each cell of a world; the cell shows their most frequent label.
const WORDS_PER_CELL: u32 = 16;
/// Approximate edge of the image, pixels.
const IMAGE_PX: u32 = 960;
/// Maximum number of pixels of the image.
const MAX_PIXELS: u64 = 1 << 24;
/// Palette index of the space between worlds; labels have 1 to 254.
const PAPER: u8 = 255;

/// Draw random worlds from the model's prior, to show the maps that alpha and gamma favour.
///
/// Each world has a seed of its own. Each colour is a label, and the oldest label of each world has the first colour.
/// Colours repeat in worlds with more than 254 labels.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast scene sample --alpha 0.001 --gamma 0.3 --size 64x64 --grid 3x3 --seed 1 --out worlds.png"
)]
pub struct Sample {
    /// Weight of each existing label in each cell: 0 or more
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    alpha: f64,
    /// Weight of a new label: 0 or more
    #[arg(long, value_name = "G", allow_negative_numbers = true)]
    gamma: f64,
    /// Columns x rows of a world, in cells
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = pair)]
    size: (u32, u32),
    /// Columns x rows of worlds in the image
    #[arg(long, value_name = "WxH", default_value = "3x3", value_parser = pair)]
    grid: (u32, u32),
    /// Seed of the first world; the others follow from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// File to write, an indexed PNG
    #[arg(long, value_name = "FILE.png")]
    out: PathBuf,
}

/// Two numbers from 1 to 4096, as in 64x48.
fn pair(text: &str) -> Result<(u32, u32), Takes> {
    let number = |text: &str| text.parse().ok().filter(|n| (1..=4096).contains(n));
    let pair = text.split_once('x').and_then(|(a, b)| Some((number(a)?, number(b)?)));
    pair.ok_or(Takes("it takes two whole numbers from 1 to 4096, as in 64x48"))
}

impl Sample {
    pub fn run(self) -> Result<(), UserError> {
        for (name, value) in [("--alpha", self.alpha), ("--gamma", self.gamma)] {
            if !(0.0..=1e9).contains(&value) {
                return Err(UserError::Input(format!("{name} {value}: it takes a number from 0 to 1e9")));
            }
        }
        let sheet = Sheet::new(self.size, self.grid)?;
        let worlds = u64::from(self.grid.0) * u64::from(self.grid.1);
        let mut pixels = vec![PAPER; sheet.width as usize * sheet.height as usize];
        for index in 0..worlds {
            let (columns, rows) = (self.size.0 as usize, self.size.1 as usize);
            let world = sample(self.seed.wrapping_add(index), columns, rows, self.alpha, self.gamma, WORDS_PER_CELL);
            sheet.draw(&world, index as u32, &mut pixels);
        }
        let png = encode(sheet.width, sheet.height, &pixels).map_err(UserError::failed)?;
        write_whole(&self.out, &png)
    }
}

/// The arrangement of the worlds in the image.
struct Sheet {
    across: u32,
    size: (u32, u32),
    /// Edge of a cell in the image, pixels.
    scale: u32,
    gap: u32,
    width: u32,
    height: u32,
}

impl Sheet {
    fn new(size: (u32, u32), grid: (u32, u32)) -> Result<Self, UserError> {
        let cells = (size.0 * grid.0).max(size.1 * grid.1);
        let scale = (IMAGE_PX / cells).max(1);
        let gap = (IMAGE_PX / 80).max(1);
        let length = |cells: u32, worlds: u32| worlds * (cells * scale + gap) + gap;
        let (width, height) = (length(size.0, grid.0), length(size.1, grid.1));
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            let cause = format!("--size and --grid make {width} x {height} pixels, more than the {MAX_PIXELS} allowed");
            return Err(UserError::Input(cause));
        }
        Ok(Self { across: grid.0, size, scale, gap, width, height })
    }

    fn draw(&self, world: &LabelWorld, index: u32, pixels: &mut [u8]) {
        let left = self.gap + index % self.across * (self.size.0 * self.scale + self.gap);
        let top = self.gap + index / self.across * (self.size.1 * self.scale + self.gap);
        for y in 0..self.size.1 * self.scale {
            let from = ((top + y) * self.width + left) as usize;
            let row = &mut pixels[from..][..(self.size.0 * self.scale) as usize];
            for (x, pixel) in row.iter_mut().enumerate() {
                let cell = (y / self.scale) as usize * world.columns + x / self.scale as usize;
                *pixel = (world.labels[cell] % 254) as u8 + 1;
            }
        }
    }
}

fn encode(width: u32, height: u32, pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut palette: Vec<u8> = (0..PAPER).flat_map(colour).collect();
    palette.extend([255; 3]);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_two_whole_numbers() {
        assert_eq!(pair("64x48"), Ok((64, 48)));
        for wrong in ["64", "0x5", "5x", "5000x5", "-1x2", "3x3x3"] {
            assert!(pair(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn worlds_lie_side_by_side_on_paper() {
        let sheet = Sheet::new((10, 5), (2, 3)).unwrap();
        let world = |label| LabelWorld { columns: 10, rows: 5, labels: vec![label; 50] };
        let mut pixels = vec![PAPER; (sheet.width * sheet.height) as usize];
        (0..6).for_each(|index| sheet.draw(&world(index), index, &mut pixels));
        for label in 1..=6 {
            let drawn = pixels.iter().filter(|&&pixel| pixel == label).count() as u32;
            assert_eq!(drawn, 50 * sheet.scale * sheet.scale);
        }
        assert_eq!(pixels[0], PAPER);
    }
}
