//! Word extraction from frames of 640 x 480 pixels: frames a second on one core.
//!
//! `cargo bench -p scene-model --bench words`
#![allow(missing_docs)]

use divan::Bencher;
use divan::counter::ItemsCount;
use scene_model::words::{WordConfig, WordExtractor};
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
    let frame = patches(1, 640, 480, 150, 8).image;
    let mut extractor = WordExtractor::new(&config);
    extractor.extract(&frame, 25.0);
    bencher.counter(ItemsCount::new(1usize)).bench_local(|| extractor.extract(&frame, 25.0));
}
