//! Bytes and CPU time of map chunks on survey series, stills and a large map, against the best PNG.
//!
//! `cargo bench -p scenecast-protocol --bench map_codec [-- [quick] [no-png] [real | procedural | large]]`; zopfli
//! takes nearly all of the time.
#![allow(clippy::disallowed_methods)]

mod large;
mod real;

use cpu_time::ThreadTime;
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::map_codec::{Codec, LabelRaster, decode, encode_all};
use scenecast_training::Zopfli;
use scenecast_training::{Flips, MapRng, MapScene, Survey};
use std::time::Duration;

const ROOMS: [usize; 3] = [64, 256, 1000];
const SIDE: usize = 192;
const STEPS: usize = 40;

fn main() {
    let asked = |word: &str| std::env::args().any(|argument| argument == word);
    let seeds = if asked("quick") { 1 } else { 3 };
    let every = !["real", "procedural", "large"].into_iter().any(asked);
    if every || asked("procedural") {
        procedural(seeds);
    }
    if every || asked("large") {
        large::measure();
    }
    if every || asked("real") {
        real_stills(seeds as usize);
        real_series(seeds as usize);
    }
}

fn real_stills(most: usize) {
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
            totals.add(&series(&[LabelRaster::uniform(SIDE, SIDE, 0), crop]));
        }
        totals.print(&format!("{} / {step}", name.split('/').next().unwrap_or(name)));
    }
}

fn real_series(most: usize) {
    println!("series over real maps; and one year to the next");
    if let Some(map) = real::map("benthic_map/map_idx_10cm.png", 1, 1) {
        for (name, flips) in regimes() {
            let mut totals = Totals::default();
            for crop in real::crops(&map, SIDE, 3).into_iter().take(most) {
                totals.add(&series(&survey(1, crop, flips)));
            }
            totals.print(name);
        }
    }
    let years = ["2013", "2014"].map(|year| real::map(&format!("scripps_2014/{year}_label_idx.png"), 8, 1));
    if let [Some(before), Some(after)] = years {
        let mut totals = Totals::default();
        for (column, row) in [(0, 0), (180, 0), (0, 180), (180, 180)] {
            totals.add(&series(&[&before, &after].map(|map| real::crop(map, column, row, SIDE))));
        }
        totals.print("2013 to 2014");
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

fn procedural(seeds: u64) {
    println!("series: {SIDE} x {SIDE}, {STEPS} steps, 8 labels, {seeds} scenes; bytes a step");
    let mut all = Totals::default();
    for (name, flips) in regimes() {
        let mut totals = Totals::default();
        for seed in 0..seeds {
            let mut rng = MapRng::new(900 + seed);
            let scene = MapScene::ALL[seed as usize % 4].draw(&mut rng, SIDE, SIDE, 8);
            totals.add(&series(&survey(seed, scene, flips)));
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
            totals.add(&series(&[LabelRaster::uniform(SIDE, SIDE, 0), raster]));
        }
        totals.print(&format!("{scene:?}"));
    }
}

#[derive(Default, Clone)]
struct Totals {
    steps: usize,
    full_png: usize,
    best_png: usize,
    bytes: [usize; 3],
    chunks: [usize; 3],
    encode: [Duration; 3],
    slowest: [Duration; 3],
    decode: [Duration; 3],
}

impl Totals {
    fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.full_png += other.full_png;
        self.best_png += other.best_png;
        for i in 0..ROOMS.len() {
            self.bytes[i] += other.bytes[i];
            self.chunks[i] += other.chunks[i];
            self.encode[i] += other.encode[i];
            self.decode[i] += other.decode[i];
            self.slowest[i] = self.slowest[i].max(other.slowest[i]);
        }
    }

    fn print(&self, name: &str) {
        let steps = self.steps.max(1);
        print!("{name:<18} full {:6} best {:5} |", self.full_png / steps, self.best_png / steps);
        for (i, room) in ROOMS.iter().enumerate() {
            print!(
                " {room:4}: {:5} B {:.3} {:4.1} ch {:4.1}+{:4.1} max {:4.1} ms |",
                self.bytes[i] / steps,
                self.bytes[i] as f64 / self.best_png as f64,
                self.chunks[i] as f64 / steps as f64,
                self.encode[i].as_secs_f64() * 1000.0 / steps as f64,
                self.decode[i].as_secs_f64() * 1000.0 / steps as f64,
                self.slowest[i].as_secs_f64() * 1000.0,
            );
        }
        println!(" of full {:.3}", self.bytes[2] as f64 / self.full_png as f64);
    }
}

fn series(maps: &[LabelRaster]) -> Totals {
    let mut totals = Totals::default();
    for pair in maps.windows(2) {
        let [before, after] = pair else { continue };
        if before == after {
            continue;
        }
        totals.steps += 1;
        if !std::env::args().any(|argument| argument == "no-png") {
            totals.full_png += after.smallest_png(&mut Zopfli);
            totals.best_png += after.smallest_delta_png(before, &mut Zopfli);
        }
        let (base, target) = (before.to_grid(), after.to_grid());
        for (i, &room) in ROOMS.iter().enumerate() {
            step(&mut totals, i, room, &base, &target);
        }
    }
    totals
}

fn step(totals: &mut Totals, i: usize, room: usize, base: &LabelGrid, target: &LabelGrid) {
    let start = ThreadTime::now();
    let chunks = encode_all(Codec::Auto, base, target, room).expect("room for a cell");
    let encoded = start.elapsed();
    totals.encode[i] += encoded;
    totals.slowest[i] = totals.slowest[i].max(encoded);
    let start = ThreadTime::now();
    let mut replica = base.clone();
    for chunk in &chunks {
        for (cell, label) in decode(base, &chunk.bytes).expect("own chunk") {
            replica.set(cell, label);
        }
    }
    totals.decode[i] += start.elapsed();
    assert_eq!(&replica, target);
    totals.bytes[i] += chunks.iter().map(|chunk| chunk.bytes.len()).sum::<usize>();
    totals.chunks[i] += chunks.len();
}
