//! Map chunks of survey series, stills and a large map: bytes and CPU time, against the best PNG.

mod large;
mod real;
mod totals;

use clap::{Args, ValueEnum};
use scenecast_core::UserError;
use scenecast_protocol::map_codec::LabelRaster;
use scenecast_training::{Flips, MapRng, MapScene, Survey};
use totals::Totals;

const SIDE: usize = 192;
const STEPS: usize = 40;

/// Bytes and CPU time of map chunks on survey series, stills and a large map, against the best PNG.
///
/// The compression of the PNG files by zopfli takes nearly all of the time.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench map-codec procedural --quick --no-png")]
pub(crate) struct MapCodecBench {
    /// Kind of maps [default: every kind]
    #[arg(value_enum)]
    maps: Option<Maps>,
    /// One scene of each kind instead of three
    #[arg(long)]
    quick: bool,
    /// Do not compare with PNG files
    #[arg(long)]
    no_png: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Maps {
    /// Drawn maps, and surveys over them
    Procedural,
    /// A drawn map of 2048 x 2048 cells
    Large,
    /// Maps of the shared data; skipped where they are absent
    Real,
}

impl MapCodecBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let seeds = if self.quick { 1 } else { 3 };
        let is_asked = |maps| self.maps.is_none_or(|asked| asked == maps);
        if is_asked(Maps::Procedural) {
            self.procedural(seeds);
        }
        if is_asked(Maps::Large) {
            large::measure();
        }
        if is_asked(Maps::Real) {
            self.real_stills(seeds as usize);
            self.real_series(seeds as usize);
        }
        Ok(())
    }

    fn real_stills(&self, most: usize) {
        println!("stills of real maps, {SIDE} x {SIDE}");
        for (name, step, shift) in [
            ("benthic_map/map_idx_2cm.png", 1, 1),
            ("benthic_map/map_idx_10cm.png", 1, 1),
            ("scripps_2014/2014_label_idx.png", 8, 1),
            ("scripps_2014/2014_label_idx.png", 4, 1),
        ] {
            let Some(map) = real::map(name, step, shift) else { continue };
            let mut totals = Totals::default();
            for crop in real::crops(&map, SIDE, 3).into_iter().take(2 * most) {
                totals.measure(&[LabelRaster::uniform(SIDE, SIDE, 0), crop], !self.no_png);
            }
            totals.print(&format!("{} / {step}", name.split('/').next().unwrap_or(name)));
        }
    }

    fn real_series(&self, most: usize) {
        println!("series over real maps; and one year to the next");
        if let Some(map) = real::map("benthic_map/map_idx_10cm.png", 1, 1) {
            for (name, flips) in regimes() {
                let mut totals = Totals::default();
                for crop in real::crops(&map, SIDE, 3).into_iter().take(most) {
                    totals.measure(&survey(1, crop, flips), !self.no_png);
                }
                totals.print(name);
            }
        }
        let years = ["2013", "2014"].map(|year| real::map(&format!("scripps_2014/{year}_label_idx.png"), 8, 1));
        if let [Some(before), Some(after)] = years {
            let mut totals = Totals::default();
            for (column, row) in [(0, 0), (180, 0), (0, 180), (180, 180)] {
                totals.measure(&[&before, &after].map(|map| real::crop(map, column, row, SIDE)), !self.no_png);
            }
            totals.print("2013 to 2014");
        }
    }

    fn procedural(&self, seeds: u64) {
        println!("series: {SIDE} x {SIDE}, {STEPS} steps, 8 labels, {seeds} scenes; bytes a step");
        let mut all = Totals::default();
        for (name, flips) in regimes() {
            let mut totals = Totals::default();
            for seed in 0..seeds {
                let mut rng = MapRng::new(900 + seed);
                let scene = MapScene::ALL[seed as usize % 4].draw(&mut rng, SIDE, SIDE, 8);
                totals.measure(&survey(seed, scene, flips), !self.no_png);
            }
            totals.print(name);
            all.add(&totals);
        }
        all.print("all");
        println!("stills from nothing, {SIDE} x {SIDE}");
        for (i, scene) in MapScene::ALL.into_iter().enumerate() {
            let mut totals = Totals::default();
            for seed in 0..seeds {
                let raster = scene.draw(&mut MapRng::new(700 + i as u64 * 10 + seed), SIDE, SIDE, 8);
                totals.measure(&[LabelRaster::uniform(SIDE, SIDE, 0), raster], !self.no_png);
            }
            totals.print(&format!("{scene:?}"));
        }
    }
}

fn regimes() -> [(&'static str, Flips); 3] {
    [
        ("0.5 % of border", Flips { border: 5000, anywhere: 0, settling: 0 }),
        ("3 % of border", Flips { border: 30_000, anywhere: 0, settling: 0 }),
        ("1 % of all seen", Flips { border: 0, anywhere: 10_000, settling: 0 }),
    ]
}

fn survey(seed: u64, scene: LabelRaster, flips: Flips) -> Vec<LabelRaster> {
    let mut survey = Survey::new(seed, scene, flips, STEPS);
    let mut maps = vec![survey.map().clone()];
    for _ in 0..STEPS {
        survey.advance();
        maps.push(survey.map().clone());
    }
    maps
}
