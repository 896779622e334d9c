//! The CPU time of a mission of 20 minutes: 600 frames of 640 x 480 pixels over a procedural sea floor, extraction included.
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub)]

#[path = "../../../scene-model/benches/cpu/mod.rs"]
mod cpu;

use std::collections::BTreeMap;

use cpu::cpu_seconds;
use scene_model::project::{DownCamera, Pose};
use scene_model::publish::{LabelBook, PublishedCell};
use scene_model::topics::{SceneConfig, SceneModel};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_worlds::scoring::mutual_information_nats;
use scenecast_worlds::{Patches, patches};

fn main() {
    let mut parts = [0.0; 5];
    let mut timed = |part: usize, start: f64| parts[part] += cpu_seconds() - start;
    let start = cpu_seconds();
    let world = patches(1, 2800, 1900, 150, 8);
    println!("reef {:.2} s", cpu_seconds() - start);
    let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
    let mut extractor = WordExtractor::new(&WordConfig::default());
    let mut model = SceneModel::new(SceneConfig::default()).unwrap();
    let mut book = LabelBook::new(0);
    let mut resampled = 0;
    let (mut shown, mut changes) = (BTreeMap::new(), 0);
    for frame in 0..600u32 {
        let (line, along) = (frame / 60, frame % 60);
        let (left, top) = (along * 2160 / 60, line * 1420 / 10);
        let view = image::imageops::crop_imm(&world.image, left, top, 640, 480).to_image();
        let pose = Pose { x: f64::from(left) * 0.01, y: -f64::from(top) * 0.01, z: 3.0, yaw_rad: 0.0 };
        let start = cpu_seconds();
        let words = extractor.extract(&view, 25.0);
        timed(0, start);
        let seen = camera.project(640, 480, &pose, &words);
        let start = cpu_seconds();
        model.insert(f64::from(frame) * 2.0, &seen);
        timed(1, start);
        let start = cpu_seconds();
        resampled += model.refine(100_000);
        timed(2, start);
        let start = cpu_seconds();
        let map = model.label_map();
        timed(3, start);
        let start = cpu_seconds();
        let published = book.publish(&map);
        timed(4, start);
        let change =
            |cell: &&PublishedCell| shown.insert((cell.x, cell.y), cell.label).is_some_and(|l| l != cell.label);
        changes += published.iter().filter(change).count();
    }
    for (name, time) in ["extract", "insert", "refine", "label_map", "publish"].iter().zip(parts) {
        println!("{name:10} {:7.3} s, {:.2} ms a frame", time, time / 0.6);
    }
    let total: f64 = parts.iter().sum();
    println!(
        "total {:.2} s; {} cells, {} words, {resampled} resampled, {} labels, {} ids",
        total,
        model.cells(),
        model.words(),
        model.labels(),
        book.labels().count()
    );
    println!("{:.1} of the cells already shown change their label a frame", changes as f64 / 600.0);
    let before = truth_mi(&world, &model);
    model.sweep(30);
    println!("MI with the truth {before:.3} nats at the end, {:.3} after 30 more sweeps", truth_mi(&world, &model));
}

/// The mutual information of the map with the class at each cell's centre, nats.
fn truth_mi(world: &Patches, model: &SceneModel) -> f64 {
    // The first frame's centre is the origin of the world.
    let pairs = model.label_map().into_iter().filter_map(|cell| {
        let (u, v) = (320 + cell.x * 25 + 12, 240 - cell.y * 25 - 12);
        let (u, v) = (u32::try_from(u).ok()?, u32::try_from(v).ok()?);
        (u < world.width && v < world.height)
            .then(|| (cell.topic.0, u32::from(world.truth[(v * world.width + u) as usize])))
    });
    mutual_information_nats(pairs).nats
}
