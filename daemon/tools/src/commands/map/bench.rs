//! `scenecast map bench`

use super::Coding;
use super::change::{PngSizes, Sizes, encode, numbered, read_map, refused, same_size, sizes};
use crate::progress::Progress;
use clap::Args;
use scenecast_core::{UserError, outln};
use scenecast_protocol::map_codec::LabelRaster;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Measure a folder of numbered maps, each encoded against the one before, and the first against an empty map.
///
/// Each step is decoded and compared with its map. The output also has the sizes of the best PNG files: the whole map
/// of each step, and the smaller of delta image and dirty box. Their compression by zopfli takes most of the time.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast map bench --series steps --frame-bytes 256")]
pub struct MapBench {
    /// Folder of indexed PNG files of one size, in the order of the last number in their names
    #[arg(long, value_name = "DIR")]
    series: PathBuf,
    #[command(flatten)]
    coding: Coding,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

/// Totals over all steps of a series.
#[derive(Debug, Default, Serialize)]
struct Totals {
    steps: usize,
    frame_bytes: u16,
    #[serde(flatten)]
    sizes: Sizes,
    /// Ratio of our bytes to those of whole PNG files; `None` if there are none.
    ratio_full: Option<f64>,
    ratio_delta: Option<f64>,
    /// Mean and maximum time of a step, encoding and decoding together, ms.
    step_ms_mean: f64,
    step_ms_max: f64,
}

impl MapBench {
    pub fn run(self) -> Result<(), UserError> {
        let files = numbered(&self.series)?;
        let mut totals = Totals { frame_bytes: self.coding.frame_bytes, ..Totals::default() };
        totals.sizes.codec = self.coding.codec.to_string();
        let mut progress = Progress::new("maps");
        let mut before: Option<(&PathBuf, LabelRaster)> = None;
        for (done, path) in files.iter().enumerate() {
            progress.show(done as f64 / files.len() as f64);
            let map = read_map(path)?;
            let base = match &before {
                Some((base_path, base)) => {
                    same_size((base_path, base), (path, &map))?;
                    base.clone()
                }
                None => LabelRaster::uniform(map.width, map.height, 0),
            };
            totals.add(&self.coding, &base, &map)?;
            before = Some((path, map));
        }
        drop(progress);
        totals.finish();
        if self.json {
            outln!("{}", serde_json::to_string(&totals).map_err(UserError::failed)?);
        } else {
            totals.print();
        }
        Ok(())
    }
}

impl Totals {
    fn add(&mut self, coding: &Coding, base: &LabelRaster, target: &LabelRaster) -> Result<(), UserError> {
        let started = Instant::now();
        let (file, cells_changed) = encode(coding, base, target)?;
        let decoded = file.apply(Some(base)).map_err(refused)?;
        let ms = started.elapsed().as_secs_f64() * 1000.0;
        if decoded != *target {
            return Err(UserError::Failed(format!("step {} does not decode to its map", self.steps + 1)));
        }
        self.steps += 1;
        self.step_ms_mean += ms;
        self.step_ms_max = self.step_ms_max.max(ms);
        let png = PngSizes::measure(base, target);
        self.sizes.add(&sizes(coding, &file, cells_changed, Some(png)));
        Ok(())
    }

    fn finish(&mut self) {
        let ratio = |of: usize| (of > 0).then(|| self.sizes.bytes as f64 / of as f64);
        let PngSizes { png_full_bytes, png_delta_bytes } = self.sizes.png.unwrap_or_default();
        (self.ratio_full, self.ratio_delta) = (ratio(png_full_bytes), ratio(png_delta_bytes));
        self.step_ms_mean /= self.steps.max(1) as f64;
    }

    fn print(&self) {
        let Sizes { bytes, frames, cells_changed, codec, png } = &self.sizes;
        let PngSizes { png_full_bytes, png_delta_bytes } = png.unwrap_or_default();
        let shown = |ratio: Option<f64>| ratio.map_or("-".to_owned(), |r| format!("{r:.3}"));
        outln!("{} steps, {cells_changed} cells changed, frames of {} bytes", self.steps, self.frame_bytes);
        outln!("{:<16} {:>10} {:>12}", "", "bytes", "ours to it");
        outln!("{:<16} {bytes:>10}  {frames} frames", format!("ours ({codec})"));
        outln!("{:<16} {png_full_bytes:>10} {:>12}", "best PNG, whole", shown(self.ratio_full));
        outln!("{:<16} {png_delta_bytes:>10} {:>12}", "best PNG, delta", shown(self.ratio_delta));
        outln!("a step is coded and read in {:.1} ms, at most {:.1} ms", self.step_ms_mean, self.step_ms_max);
    }
}
