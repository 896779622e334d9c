//! The behaviour of the public interface over hand-made words.

use scene_model::project::Observation;
use scene_model::topics::{SceneConfig, SceneModel};

fn config(seed: u64) -> SceneConfig {
    SceneConfig { cell_m: [0.25, 0.25, 1e4], seed, ..SceneConfig::default() }
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
