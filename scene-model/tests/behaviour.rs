//! The behaviour of the public interface over procedural sea floors and hand-made words.

use scene_model::project::{DownCamera, Observation, Pose};
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
fn bad_words_are_counted_and_skipped() {
    let mut model = SceneModel::new(SceneConfig { vocabulary: 10, max_words_per_cell: 3, ..config(1) }).unwrap();
    let good = Observation { word: 3, x: 1.0, y: 1.0, z: 0.0 };
    let seen = [
        good,
        Observation { x: f64::NAN, ..good },
        Observation { z: f64::INFINITY, ..good },
        Observation { y: 1e30, ..good },
        Observation { word: 10, ..good },
        good,
        good,
        good,
    ];
    let outcome = model.insert(0.0, &seen);
    assert_eq!((outcome.accepted, outcome.skipped_bad, outcome.skipped_full), (3, 4, 1));
    assert_eq!((model.cells(), model.words(), model.labels()), (1, 3, 1));
    assert_eq!(model.refine(10), 12);
}

#[test]
fn empty_model_has_an_empty_map() {
    let mut model = SceneModel::new(config(1)).unwrap();
    assert_eq!((model.refine(1000), model.sweep(3), model.cells(), model.labels()), (0, 0, 0, 0));
    assert!(model.label_map().is_empty());
    assert_eq!(model.perplexity(), 1.0);
}

#[test]
fn world_may_lie_on_both_sides_of_the_origin() {
    let mut model = SceneModel::new(config(1)).unwrap();
    let at = |x, y| Observation { word: 1, x, y, z: -30.0 };
    model.insert(0.0, &[at(-0.1, -0.1), at(0.1, -0.1), at(-1e6, 1e6)]);
    let places: Vec<(i32, i32)> = model.label_map().iter().map(|cell| (cell.x, cell.y)).collect();
    assert_eq!(places, [(-1, -1), (0, -1), (-4_000_000, 4_000_000)]);
}

#[test]
fn label_with_most_words_of_a_column_is_shown() {
    let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 4, gamma: 1.0, ..config(1) };
    let mut model = SceneModel::new(config).unwrap();
    let at = |word, z| Observation { word, x: 0.5, y: 0.5, z };
    let mut seen = vec![at(0, 9.0); 40];
    seen.extend(vec![at(3, 2.0); 90]);
    model.insert(0.0, &seen);
    model.sweep(50);
    let map = model.label_map();
    assert_eq!(map.len(), 1);
    assert_eq!((map[0].z, map[0].words), (2, 130));
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
fn cells_beside_the_map_expect_its_topics() {
    let mut model = SceneModel::new(SceneConfig { cell_m: [1.0; 3], vocabulary: 4, ..config(1) }).unwrap();
    model.insert(0.0, &vec![Observation { word: 2, x: 0.5, y: 0.5, z: 0.0 }; 50]);
    model.sweep(5);
    let topic = model.label_map()[0].topic;
    let beside = model.expected_at([1.5, 0.5, 0.0]);
    assert_eq!(beside[0].0, topic);
    assert!((beside.iter().map(|entry| entry.1).sum::<f32>() - 1.0).abs() < 1e-5);
    assert!(model.expected_at([3.5, 0.5, 0.0]).is_empty());
    assert!(model.expected_at([f64::NAN, 0.5, 0.0]).is_empty());
}

#[test]
fn stacked_cells_have_labels_and_heights_of_their_own() {
    let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 4, gamma: 1.0, ..config(1) };
    let mut model = SceneModel::new(config).unwrap();
    let at = |word, x, z| Observation { word, x, y: -7.5, z };
    for _ in 0..2 {
        // In the second pass the cells exist already.
        model.insert(0.0, &[vec![at(0, 0.5, 9.0); 40], vec![at(3, 0.5, -2.0); 30], vec![at(3, 5.5, 1.0); 30]].concat());
        model.sweep(30);
    }
    let volume = model.label_volume();
    let places: Vec<(i32, i32, i32, u32)> = volume.iter().map(|cell| (cell.x, cell.y, cell.z, cell.words)).collect();
    assert_eq!(places, [(0, -8, 9, 80), (0, -8, -2, 60), (5, -8, 1, 60)]);
    assert!(volume[0].topic != volume[1].topic);
    let map = model.label_map();
    assert_eq!((map.len(), map[0].z, map[0].topic, map[0].words), (2, 9, volume[0].topic, 140));
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
