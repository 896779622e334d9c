//! Word extraction from frames of 640 x 480 pixels: frames a second on one core.
//!
//! `cargo bench -p scenecast-worlds --bench words`
#![allow(missing_docs)]

use divan::Bencher;
use divan::counter::ItemsCount;
use scene_model::random::CounterRng;
use scene_model::words::{Discriminant, FEATURES, MAX_DIRECTIONS, WordConfig, WordExtractor};
use scenecast_worlds::patches;

const NONE: WordConfig = WordConfig { colour: 0, context: 0, spread: 0, texture: 0, binary: 0, warm_up_frames: 1 };

fn main() {
    divan::main();
}

/// All kinds of words in the default ratio.
#[divan::bench]
fn all(bencher: Bencher<'_, '_>) {
    frames(bencher, WordConfig { warm_up_frames: 1, ..WordConfig::default() });
}

/// All kinds, and the words of an annotated vocabulary: 8 directions, 256 prototypes.
#[divan::bench]
fn annotated(bencher: Bencher<'_, '_>) {
    let mut rng = CounterRng::new(1);
    let mut draw = |count: usize| (0..count).map(|_| rng.normal() as f32).collect::<Vec<f32>>();
    let directions: Vec<[f32; FEATURES]> = draw(FEATURES * MAX_DIRECTIONS)
        .as_chunks()
        .0
        .iter()
        .map(|weights| weights.map(|weight| weight * 0.1))
        .collect();
    let prototypes: Vec<Vec<f32>> = (0..256).map(|_| draw(MAX_DIRECTIONS)).collect();
    let discriminant = Discriminant::new(&directions, &prototypes).unwrap();
    let config = WordConfig { warm_up_frames: 1, ..WordConfig::default() };
    let measures = WordExtractor::new(&config).measures().with_discriminant(Some(discriminant));
    run(bencher, WordExtractor::from_measures(measures));
}

#[divan::bench]
fn colour_alone(bencher: Bencher<'_, '_>) {
    frames(bencher, WordConfig { colour: 36, context: 9, spread: 9, ..NONE });
}

#[divan::bench]
fn texture_alone(bencher: Bencher<'_, '_>) {
    frames(bencher, WordConfig { texture: 9, ..NONE });
}

#[divan::bench]
fn binary_alone(bencher: Bencher<'_, '_>) {
    frames(bencher, WordConfig { binary: 4, ..NONE });
}

fn frames(bencher: Bencher<'_, '_>, config: WordConfig) {
    run(bencher, WordExtractor::new(&config));
}

fn run(bencher: Bencher<'_, '_>, mut extractor: WordExtractor) {
    let frame = patches(1, 640, 480, 150, 8).image;
    extractor.extract(&frame, 25.0);
    bencher.counter(ItemsCount::new(1usize)).bench_local(|| extractor.extract(&frame, 25.0));
}
