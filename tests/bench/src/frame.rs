//! `scenecast-bench frame`: what a camera frame costs the vehicle on a map of many cells.

use crate::cpu_meter::CpuMeter;
use crate::surveys::print_json;
use clap::Args;
use image::{Rgb, RgbImage};
use scene_model::habitats::measure;
use scene_model::project::Pose;
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_config::{Config, cell_m, modem_profile};
use scenecast_core::{Area, UserError};
use scenecast_protocol::time::Instant;
use scenecast_tools::Progress;
use scenecast_vehicle::{Durable, Frame, Mapper, Vehicle};
use scenecast_worlds::scoring::median;
use serde::Serialize;
use std::time::Duration;

/// Cells along the edge of a frame.
const EDGE: u32 = 32;
/// Time between two frames, seconds.
const INTERVAL_S: f64 = 2.0;
/// Frames whose median is a row.
const MEASURED: usize = 9;

/// A camera frame at the vehicle: CPU time from the image to the map that the link sends, as the map grows.
///
/// The frames lie side by side, 1024 cells each, on a floor of four textures. `image` is the CPU time from the image to
/// its words, those of the habitats included; `scene model` is that from the words to the changes of the map, refinement
/// included; `vehicle` is that from there to the layers of the link. Each row is the median of nine frames.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench frame --cells 100000")]
pub(crate) struct FrameBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of cells of the map at the last row
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(20_000..=1_000_000))]
    cells: u32,
}

/// CPU time of a frame, milliseconds.
#[derive(Debug, Clone, Serialize)]
struct FrameCost {
    cells: usize,
    image_ms: f64,
    scene_model_ms: f64,
    vehicle_ms: f64,
}

impl FrameBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let mut survey = Survey::new(&scenecast_config::load(None, &[])?, self.seed)?;
        let last = (self.cells / (EDGE * EDGE)) as usize;
        let mut progress = Progress::new("cells");
        let mut rows = Vec::new();
        for frames in [last / 8, last / 4, last / 2, last] {
            while survey.frames + MEASURED < frames {
                survey.fly();
                progress.show(survey.frames as f64 / last as f64);
            }
            let costs: Vec<FrameCost> = (0..MEASURED).map(|_| survey.fly()).collect();
            rows.push(middle(&costs));
        }
        drop(progress);
        if self.json {
            return print_json(&serde_json::json!(rows));
        }
        println!("   cells    image  scene model  vehicle  from words     all   CPU time of a frame, ms");
        for FrameCost { cells, image_ms, scene_model_ms, vehicle_ms } in &rows {
            let from_words = scene_model_ms + vehicle_ms;
            let all = image_ms + from_words;
            println!(
                "{cells:>8} {image_ms:>8.1} {scene_model_ms:>12.1} {vehicle_ms:>8.1} {from_words:>11.1} {all:>7.1}"
            );
        }
        Ok(())
    }
}

fn middle(costs: &[FrameCost]) -> FrameCost {
    let of = |part: fn(&FrameCost) -> f64| median(&costs.iter().map(part).collect::<Vec<f64>>());
    FrameCost {
        cells: costs.last().map_or(0, |cost| cost.cells),
        image_ms: of(|cost| cost.image_ms),
        scene_model_ms: of(|cost| cost.scene_model_ms),
        vehicle_ms: of(|cost| cost.vehicle_ms),
    }
}

/// A vehicle whose frames lie side by side.
struct Survey {
    mapper: Mapper,
    /// Finds the words of each image once more, to time them.
    extractor: WordExtractor,
    vehicle: Vehicle,
    floors: Vec<RgbImage>,
    /// Edge of a frame, metres.
    edge_m: f64,
    frames: usize,
}

impl Survey {
    fn new(config: &Config, seed: u64) -> Result<Self, UserError> {
        let edge_m = cell_m(config) * f64::from(EDGE);
        let pixels = (edge_m / config.camera.metres_per_pixel).round() as u32;
        let area = Area { west: 0.0, south: 0.0, east: 500.0, north: 500.0 };
        let modem = modem_profile(config, 10_000.0);
        let durable = Durable { labels: u8::MAX - 1, ..Durable::default() };
        Ok(Self {
            mapper: Mapper::new(config, None, 0, seed)?,
            extractor: WordExtractor::new(&WordConfig::default()),
            vehicle: scenecast_vehicle::assemble(config, None, modem, area, durable, seed, Instant::ZERO)?,
            floors: (0..4).map(|kind| floor(pixels, kind)).collect(),
            edge_m,
            frames: 0,
        })
    }

    /// CPU time of the words of an image of this floor, those of the habitats included, milliseconds.
    fn image_ms(&mut self, floor: usize) -> f64 {
        let image = &self.floors[floor];
        let cell_px = image.width() as f32 / EDGE as f32;
        let meter = CpuMeter::start();
        std::hint::black_box((self.extractor.extract(image, cell_px), measure(image, cell_px)));
        meter.ms()
    }

    /// Takes the frame of the next place, and measures the time of each part.
    fn fly(&mut self) -> FrameCost {
        let (row, column) = (self.frames / 16, self.frames % 16);
        let place = |index: usize| (index as f64 + 0.5) * self.edge_m;
        let pose = Pose { x: place(column), y: place(row), z: -4.0, yaw_rad: 0.0 };
        let t_s = self.frames as f64 * INTERVAL_S;
        let now = Instant::ZERO + Duration::from_secs_f64(t_s);
        let floor = (row / 2 + column / 4) % self.floors.len();
        let meter = CpuMeter::start();
        let changes = self.mapper.handle_frame(&Frame::flat(&self.floors[floor], pose, 1.0), t_s);
        let mapper_ms = meter.ms();
        let meter = CpuMeter::start();
        self.vehicle.handle_changes(&changes, now);
        let vehicle_ms = meter.ms();
        let image_ms = self.image_ms(floor);
        self.frames += 1;
        FrameCost { cells: self.mapper.cells(), image_ms, scene_model_ms: mapper_ms - image_ms, vehicle_ms }
    }
}

/// A texture with grains of its own size and colour.
fn floor(pixels: u32, kind: u32) -> RgbImage {
    RgbImage::from_fn(pixels, pixels, |x, y| {
        let grain = 2 + 3 * kind;
        let noise = (x / grain).wrapping_mul(0x9e37_79b1) ^ (y / grain).wrapping_mul(0x85eb_ca6b);
        let noise = (noise ^ (noise >> 13)).wrapping_mul(0xc2b2_ae35) >> 26;
        let base = 60 + 30 * kind;
        Rgb([base + noise, 90 + noise, 150 - 20 * kind + noise / 2].map(|level| level as u8))
    })
}
