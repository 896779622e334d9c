//! `scenecast scene score`

use super::pairs::{Pair, pairs};
use crate::progress::Progress;
use clap::Args;
use image::GrayImage;
use scene_model::topics::Kernel;
use scenecast_core::UserError;
use scenecast_files::{read_classes, read_image};
use scenecast_scoring::{AnnotatedScene, MeanScore, Method, Trial, TrialError};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Score the scene model and two baselines on annotated images of the sea floor.
///
/// Each NAME_label.png (grey or indexed, pixel value = class) belongs to the image NAME.jpg, .png or .tif of the same
/// size. The spatial null value is the mean mutual information of a method's map after 3 flips and 12 torus shifts: that of
/// any map with such patches. The excess over it measures the information that the map takes from the image.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast scene score --dir reefs --seeds 3 --json")]
pub struct Score {
    /// Folder of images with NAME_label.png beside them
    #[arg(long, value_name = "DIR")]
    dir: PathBuf,
    /// Number of seeds over which each value is averaged
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Maximum number of labels of each method
    #[arg(long, value_name = "K", default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..=254))]
    max_labels: u32,
    /// Cells across an image
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(4..=1000))]
    cells_across: u32,
    /// Sweeps of the scene model over all words
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    sweeps: u32,
    /// Classes that are ignored
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', default_value = "255")]
    ignore: Vec<u8>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// All scores of a folder.
#[derive(Debug, Serialize)]
struct Report {
    max_labels: u32,
    cells_across: u32,
    sweeps: u32,
    seeds: u64,
    ignored_classes: Vec<u8>,
    kernel: &'static str,
    scenes: Vec<SceneReport>,
    /// Over the scenes, figure by figure and method by method.
    median: BTreeMap<&'static str, MeanScore>,
    /// Of the scene model over each baseline, mean over the scenes.
    mean_gain: BTreeMap<&'static str, Gain>,
}

#[derive(Debug, Serialize)]
struct SceneReport {
    scene: String,
    width_px: u32,
    height_px: u32,
    cell_px: f32,
    cells: usize,
    annotated_cells: usize,
    classes: usize,
    methods: BTreeMap<&'static str, MeanScore>,
}

#[derive(Debug, Serialize)]
struct Gain {
    mutual_information_nats: f64,
    excess_nats: f64,
}

impl Score {
    pub fn run(self) -> Result<(), UserError> {
        let pairs = pairs(&self.dir)?;
        let trial =
            Trial { labels: self.max_labels, cells_across: self.cells_across, sweeps: self.sweeps, seeds: self.seeds };
        let scenes = self.scenes(trial, &pairs)?;
        let json = self.json;
        let report = self.report(scenes);
        if json {
            let text = serde_json::to_string_pretty(&report).map_err(|e| UserError::Failed(e.to_string()))?;
            println!("{text}");
        } else {
            report.print();
        }
        Ok(())
    }

    /// Scores of all scenes in the order of their names, on all cores; the first problem in that order if there is one.
    fn scenes(&self, trial: Trial, pairs: &[Pair]) -> Result<Vec<SceneReport>, UserError> {
        let (next, steps) = (AtomicUsize::new(0), pairs.len() * Method::ALL.len());
        let done = Mutex::new((BTreeMap::new(), Progress::new("scenes"), 0));
        let step = || {
            let mut done = done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            done.2 += 1;
            let share = f64::from(done.2) / steps as f64;
            done.1.show(share);
        };
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(pair) = pairs.get(index) else { return };
                let scene = scene(trial, pair, &self.ignore, &step);
                let failed = scene.is_err();
                done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).0.insert(index, scene);
                if failed {
                    next.store(pairs.len(), Ordering::Relaxed);
                }
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(pairs.len());
        std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
        let (scenes, ..) = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        scenes.into_values().collect()
    }

    fn report(self, scenes: Vec<SceneReport>) -> Report {
        let of = |method: Method| scenes.iter().map(move |scene| scene.methods[method.name()]);
        let median = Method::ALL.map(|method| (method.name(), MeanScore::median(&of(method).collect::<Vec<_>>())));
        let gain_over = |baseline: Method| {
            let gain = |pick: fn(&MeanScore) -> f64| {
                let gains = of(Method::SceneModel).zip(of(baseline)).map(|(ours, other)| pick(&ours) - pick(&other));
                gains.sum::<f64>() / scenes.len() as f64
            };
            Gain { mutual_information_nats: gain(|s| s.mutual_information_nats), excess_nats: gain(|s| s.excess_nats) }
        };
        let mean_gain = [Method::MeanLab, Method::PooledWords].map(|baseline| (baseline.name(), gain_over(baseline)));
        Report {
            max_labels: self.max_labels,
            cells_across: self.cells_across,
            sweeps: self.sweeps,
            seeds: self.seeds,
            ignored_classes: self.ignore,
            kernel: Kernel::detect().name(),
            median: median.into(),
            mean_gain: mean_gain.into(),
            scenes,
        }
    }
}

fn scene(trial: Trial, pair: &Pair, ignore: &[u8], step: &dyn Fn()) -> Result<SceneReport, UserError> {
    let image = read_image(&pair.image)?.to_rgb8();
    let (width_px, height_px) = image.dimensions();
    let classes = read_classes(&pair.classes, image.dimensions())?;
    let classes = GrayImage::from_raw(width_px, height_px, classes)
        .ok_or_else(|| UserError::file(&pair.classes, "has another number of pixels than its head says"))?;
    let refused = |error: TrialError| {
        let of_classes = matches!(error, TrialError::Annotations(_) | TrialError::NoClasses);
        UserError::file(if of_classes { &pair.classes } else { &pair.image }, error)
    };
    let scene = AnnotatedScene::new(trial, &image, &classes, ignore).map_err(refused)?;
    let mut methods = BTreeMap::new();
    for method in Method::ALL {
        methods.insert(method.name(), scene.mean_score(method).map_err(refused)?);
        step();
    }
    let (columns, rows) = scene.annotations().size();
    let (annotated_cells, classes) = scene.annotations().cells().unwrap_or_default();
    Ok(SceneReport {
        scene: name(&pair.image),
        width_px,
        height_px,
        cell_px: scene.cell_px(),
        cells: columns * rows,
        annotated_cells,
        classes,
        methods,
    })
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

impl Report {
    fn print(&self) {
        println!("K {}, {} sweeps, mean of {} seeds, nats", self.max_labels, self.sweeps, self.seeds);
        println!("{:<20} {:<20} {:>6} {:>6} {:>6} {:>7}", "scene", "method", "MI", "NMI", "null", "excess");
        for scene in &self.scenes {
            print_methods(&scene.scene, &scene.methods);
        }
        print_methods("median", &self.median);
        for (baseline, gain) in &self.mean_gain {
            let Gain { mutual_information_nats, excess_nats } = gain;
            println!(
                "mean gain of scene_model over {baseline}: MI {mutual_information_nats:+.3}, excess {excess_nats:+.3}"
            );
        }
    }
}

fn print_methods(scene: &str, methods: &BTreeMap<&'static str, MeanScore>) {
    for (row, (method, score)) in methods.iter().enumerate() {
        println!(
            "{:<20} {method:<20} {:>6.3} {:>6.3} {:>6.3} {:>7.3}",
            if row == 0 { scene } else { "" },
            score.mutual_information_nats,
            score.normalised_mutual_information,
            score.null_mutual_information_nats,
            score.excess_nats
        );
    }
}
