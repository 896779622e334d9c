//! Scores on real imagery: our defaults and the baselines over a folder of images with `*_label.png` beside them.
//!
//! `cargo bench -p scene-model --bench imagery -- DIR [SEEDS]`; without DIR it looks for the shared Eilat scenes.
#![allow(missing_docs)]

use std::path::{Path, PathBuf};

use scene_model::project::{DownCamera, Pose};
use scene_model::score::{Annotations, LabelGrid, SceneScore, mean_lab_labels, pooled_word_labels, score};
use scene_model::topics::{SceneConfig, SceneModel};
use scene_model::words::{Word, WordConfig, WordExtractor};

const K: usize = 16;
const METHODS: [&str; 3] = ["k-means Lab", "k-means pooled words", "scene model"];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let shared = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/eilatmixx");
    let folder = PathBuf::from(arguments.first().map_or(shared, String::as_str));
    let seeds: u64 = arguments.get(1).and_then(|text| text.parse().ok()).unwrap_or(3);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: no folder {}", folder.display());
        return;
    };
    let mut images: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|p| label_of(p).exists()).collect();
    images.sort();
    let mut all: [Vec<SceneScore>; 3] = Default::default();
    for image in &images {
        for (kept, of_scene) in all.iter_mut().zip(scene(image, seeds)) {
            kept.push(of_scene);
        }
        let name = image.file_stem().unwrap_or_default().to_string_lossy();
        let latest: Vec<String> = all.iter().filter_map(|kept| kept.last()).map(show).collect();
        println!("{name:12} {}", latest.join(" | "));
    }
    for (method, scores) in METHODS.iter().zip(&all) {
        let median = |pick: fn(&SceneScore) -> f64| median(scores.iter().map(pick).collect());
        println!(
            "median {method:22} MI {:.3}  null {:.3}  excess {:.3}  NMI {:.3}",
            median(|s| s.mutual_information.nats),
            median(|s| s.null_nats),
            median(|s| s.excess_nats),
            median(|s| s.mutual_information.normalised)
        );
    }
    for (reference, method) in METHODS.iter().enumerate().take(2) {
        let gain = |pick: fn(&SceneScore) -> f64| {
            let gains = all[2].iter().zip(&all[reference]).map(|(ours, other)| pick(ours) - pick(other));
            gains.sum::<f64>() / all[2].len() as f64
        };
        println!(
            "mean gain over {method}: MI {:+.3}, excess {:+.3}",
            gain(|s| s.mutual_information.nats),
            gain(|s| s.excess_nats)
        );
    }
}

/// Scores of the three methods on one scene, means over seeds.
fn scene(path: &Path, seeds: u64) -> [SceneScore; 3] {
    let image = image::open(path).unwrap().to_rgb8();
    let labels = image::open(label_of(path)).unwrap().to_luma8();
    let size = image.dimensions();
    let cell_px = size.0 as f32 / 100.0;
    let annotations = Annotations::new(&labels, size, cell_px, &[255]).unwrap();
    let config = WordConfig::default();
    let words = WordExtractor::new(&config).extract(&image, cell_px);
    let vocabulary = config.vocabulary_size();
    let grade = |label: &dyn Fn(u64) -> LabelGrid| mean((1..=seeds).map(|s| score(&label(s), &annotations)).collect());
    [
        grade(&|seed| mean_lab_labels(&image, cell_px, K, seed)),
        grade(&|seed| pooled_word_labels(&words, vocabulary, size, cell_px, K, seed)),
        grade(&|seed| scene_model_labels(&words, vocabulary, size, cell_px, seed)),
    ]
}

fn scene_model_labels(words: &[Word], vocabulary: u32, size: (u32, u32), cell_px: f32, seed: u64) -> LabelGrid {
    let camera = DownCamera { metres_per_pixel: 1.0 / f64::from(cell_px), altitude_m: 0.0 };
    let (columns, rows) = ((size.0 as f32 / cell_px).ceil(), (size.1 as f32 / cell_px).ceil());
    let middle = (f64::from(size.0) / f64::from(cell_px) / 2.0, -f64::from(size.1) / f64::from(cell_px) / 2.0);
    let pose = Pose { x: middle.0, y: middle.1, z: 0.0, yaw_rad: 0.0 };
    let observations = camera.project(size.0, size.1, &pose, words);
    let config = SceneConfig { cell_m: [1.0; 3], vocabulary, seed, max_labels: K as u32, ..SceneConfig::default() };
    let mut model = SceneModel::new(config).unwrap();
    model.insert(0.0, &observations);
    model.sweep(30);
    LabelGrid::from_map(&model.label_map(), 0, -1, columns as usize, rows as usize)
}

fn label_of(image: &Path) -> PathBuf {
    let stem = image.file_stem().unwrap_or_default().to_string_lossy();
    image.with_file_name(format!("{stem}_label.png"))
}

fn mean(scores: Vec<SceneScore>) -> SceneScore {
    let mut mean = scores[0];
    let average = |pick: fn(&SceneScore) -> f64| scores.iter().map(pick).sum::<f64>() / scores.len() as f64;
    mean.mutual_information.nats = average(|s| s.mutual_information.nats);
    mean.mutual_information.normalised = average(|s| s.mutual_information.normalised);
    mean.null_nats = average(|s| s.null_nats);
    mean.excess_nats = average(|s| s.excess_nats);
    mean
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

fn show(score: &SceneScore) -> String {
    format!("{:.3} / {:.3} ({})", score.mutual_information.nats, score.excess_nats, score.labels)
}
