//! Scores on real imagery: the defaults and the baselines over a folder of images with annotations in `*_label.png`.
//!
//! `cargo bench -p scenecast-worlds --bench imagery -- DIR [SEEDS]`; `scenecast scene score` is the same with more options.
#![allow(missing_docs)]

use std::path::{Path, PathBuf};

use scenecast_worlds::scoring::{AnnotatedScene, MeanScore, Method, Trial};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let Some(folder) = arguments.first().map(PathBuf::from) else {
        println!("skipped: no folder given");
        return;
    };
    let seeds = arguments.get(1).and_then(|text| text.parse().ok()).unwrap_or(3);
    let trial = Trial { seeds, ..Trial::default() };
    let entries = std::fs::read_dir(&folder).unwrap().flatten().map(|entry| entry.path());
    let mut images: Vec<PathBuf> = entries.filter(|path| classes_of(path).exists()).collect();
    images.sort();
    let mut all: [Vec<MeanScore>; 3] = Default::default();
    for path in &images {
        let image = image::open(path).unwrap().to_rgb8();
        let classes = image::open(classes_of(path)).unwrap().to_luma8();
        let scene = AnnotatedScene::new(trial, &image, &classes, &[255]).unwrap();
        print!("{:12}", path.file_stem().unwrap_or_default().to_string_lossy());
        for (scores, method) in all.iter_mut().zip(Method::ALL) {
            let score = scene.mean_score(method).unwrap();
            print!("  {:.3} / {:.3}", score.mutual_information_nats, score.excess_nats);
            scores.push(score);
        }
        println!();
    }
    for (method, scores) in Method::ALL.iter().zip(&all) {
        let median = MeanScore::median(scores);
        println!(
            "median {:20} MI {:.3}  excess {:.3}",
            method.name(),
            median.mutual_information_nats,
            median.excess_nats
        );
    }
}

fn classes_of(image: &Path) -> PathBuf {
    let stem = image.file_stem().unwrap_or_default().to_string_lossy();
    image.with_file_name(format!("{stem}_label.png"))
}
