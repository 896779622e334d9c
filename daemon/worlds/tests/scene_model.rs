//! The scene model over procedural sea floors.

use scene_model::project::{DownCamera, Pose};
use scene_model::publish::LabelBook;
use scene_model::random::mix;
use scene_model::topics::{FlatCell, SceneConfig, SceneModel};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_worlds::scoring::mutual_information_nats;
use scenecast_worlds::{Patches, patches};

const CELL_PX: f32 = 25.0;

fn config(seed: u64) -> SceneConfig {
    SceneConfig { cell_m: [0.25, 0.25, 1e4], seed, ..SceneConfig::default() }
}

fn learn(world: &Patches, config: SceneConfig) -> SceneModel {
    let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
    let words = WordExtractor::new(&WordConfig::default()).extract(&world.image, CELL_PX);
    let seen = camera.project(world.width, world.height, &Pose::default(), &words);
    let mut model = SceneModel::new(config).unwrap();
    assert_eq!(model.insert(0.0, &seen).accepted, words.len() as u64);
    model.sweep(30);
    model
}

/// The mutual information of the truth at the cell centres with the map, which is shifted by whole cells on a torus.
fn score(world: &Patches, map: &[FlatCell], shift: (i32, i32)) -> f64 {
    let left = map.iter().map(|cell| cell.x).min().unwrap();
    let bottom = map.iter().map(|cell| cell.y).min().unwrap();
    let (columns, rows) = (world.width as i32 / 25, world.height as i32 / 25);
    let pairs = map.iter().filter_map(|cell| {
        let (x, y) = ((cell.x - left + shift.0).rem_euclid(columns), (cell.y - bottom + shift.1).rem_euclid(rows));
        let (u, v) = (x * 25 + 12, world.height as i32 - 1 - (y * 25 + 12));
        let index = usize::try_from(v).ok()? * world.width as usize + usize::try_from(u).ok()?;
        Some((cell.topic.0, u32::from(*world.truth.get(index)?)))
    });
    mutual_information_nats(pairs).nats
}

#[test]
fn reef_is_recovered_well_above_the_spatial_null() {
    let world = patches(4, 1000, 800, 100, 6);
    let map = learn(&world, config(1)).label_map();
    let found = score(&world, &map, (0, 0));
    let shifts = [(20, 0), (0, 16), (20, 16), (10, 8), (30, 24), (13, 20)];
    let null = shifts.iter().map(|&shift| score(&world, &map, shift)).sum::<f64>() / shifts.len() as f64;
    assert!(found > 0.8 && found > null + 0.5, "MI {found:.3}, null {null:.3}");
}

#[test]
fn labels_depend_on_the_seed_alone() {
    let world = patches(9, 500, 400, 60, 5);
    let map = |seed| learn(&world, config(seed)).label_map();
    assert_eq!(map(1), map(1));
    assert_ne!(map(1), map(2));
}

#[test]
fn labels_keep_their_meaning_during_a_mission() {
    let world = patches(2, 900, 700, 80, 6);
    let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
    let mut extractor = WordExtractor::new(&WordConfig::default());
    let mut model = SceneModel::new(config(3)).unwrap();
    let mut book = LabelBook::new(7);
    let mut meanings = std::collections::BTreeMap::new();
    for frame in 0..24u32 {
        let (left, top) = (frame % 6 * 100, frame / 6 * 100);
        let view = image::imageops::crop_imm(&world.image, left, top, 320, 240).to_image();
        let pose = Pose { x: f64::from(left) * 0.01, y: -f64::from(top) * 0.01, z: 3.0, yaw_rad: 0.0 };
        let words = extractor.extract(&view, CELL_PX);
        model.insert(f64::from(frame), &camera.project(320, 240, &pose, &words));
        model.refine(20_000);
        let published = book.publish(&model.label_map());
        for label in published.iter().map(|cell| cell.label) {
            let topic = book.topic_of(label).unwrap();
            assert_eq!(*meanings.entry(label).or_insert(topic), topic, "label {label} changed its meaning");
        }
    }
    assert_eq!(book.epoch(), 7);
    assert!(meanings.len() > 1 && meanings.len() <= 40, "{} labels", meanings.len());
}

#[test]
fn words_without_a_discriminant_are_those_of_earlier_builds() {
    let mut extractor = WordExtractor::new(&WordConfig::default());
    let (mut count, mut hash) = (0, 0);
    for seed in 1..4 {
        for word in extractor.extract(&patches(seed, 203, 151, 40, 5).image, 24.0) {
            let parts = [word.id, word.u.to_bits(), word.v.to_bits()];
            hash = parts.iter().fold(hash, |hash, &part| mix(hash ^ u64::from(part)));
            count += 1;
        }
    }
    assert_eq!((count, hash), (10_752, 0x1435_4c8c_adca_f660));
}
