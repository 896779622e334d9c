//! `scenecast scene score`

use super::choices::compare;
use super::scenes::Scenes;
use crate::annotated_images::{AnnotatedImage, Pair, pairs};
use clap::Args;
use scene_model::topics::Kernel;
use scenecast_core::{UserError, outln};
use scenecast_worlds::scoring::{AnnotatedScene, MeanScore, Method, Trial};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Score the topics and the habitats of the scene model, and two baselines, on annotated images of the sea floor.
///
/// Each NAME_label.png (grey or indexed, pixel value = class) belongs to the image NAME.jpg, .png or .tif of the same
/// size. The spatial null value is the mean mutual information of a method's map after 3 flips and 12 torus shifts:
/// that of any map with such patches. The excess over it measures the information that the map takes from the image.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast scene score --dir reefs --seeds 3 --json
Example: scenecast scene score --dir reefs --seeds 9 --choices")]
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
    /// Number of cells across an image
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(4..=1000))]
    cells_across: u32,
    /// Sweeps of the scene model over all words
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    sweeps: u32,
    /// Classes that are ignored, separated by commas
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', default_value = "255")]
    ignore: Vec<u8>,
    /// Compare the choices of an operator instead of the methods: --max-labels and twice as many labels, each with the
    /// built-in vocabulary and with one learnt from the annotations of all other images, and the bits of a whole map
    #[arg(long)]
    choices: bool,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

/// The scores of all images of a folder.
#[derive(Debug, Serialize)]
struct ScoreReport {
    max_labels: u32,
    cells_across: u32,
    sweeps: u32,
    seeds: u64,
    ignored_classes: Vec<u8>,
    kernel: &'static str,
    scenes: Vec<SceneReport>,
    /// Medians over the scenes of each score, by method.
    median: BTreeMap<&'static str, MeanScore>,
    /// Gain of the scene model over each baseline, mean over the scenes.
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
        let json = self.json;
        if self.choices {
            let report = compare(trial, &pairs, &self.ignore)?;
            if json {
                return print_json(&report);
            }
            report.print();
            return Ok(());
        }
        let scenes = Scenes::new("scenes", &pairs, Method::ALL.len());
        let scenes = scenes.each(|_, pair, step| scene(trial, pair, &self.ignore, step))?;
        let report = self.report(scenes);
        if json {
            return print_json(&report);
        }
        report.print();
        Ok(())
    }

    fn report(self, scenes: Vec<SceneReport>) -> ScoreReport {
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
        ScoreReport {
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
    let AnnotatedImage { image, classes } = pair.read()?;
    let (width_px, height_px) = image.dimensions();
    let scene = AnnotatedScene::new(trial, &image, &classes, ignore).map_err(|e| pair.refused(e))?;
    let mut methods = BTreeMap::new();
    for method in Method::ALL {
        methods.insert(method.name(), scene.mean_score(method).map_err(|e| pair.refused(e))?);
        step();
    }
    let (columns, rows) = scene.annotations().size();
    let (annotated_cells, classes) = scene.annotations().cells().unwrap_or_default();
    Ok(SceneReport {
        scene: pair.name(),
        width_px,
        height_px,
        cell_px: scene.cell_px(),
        cells: columns * rows,
        annotated_cells,
        classes,
        methods,
    })
}

fn print_json(report: &impl Serialize) -> Result<(), UserError> {
    outln!("{}", serde_json::to_string_pretty(report).map_err(UserError::failed)?);
    Ok(())
}

impl ScoreReport {
    fn print(&self) {
        outln!("K {}, {} sweeps, mean of {} seeds, nats", self.max_labels, self.sweeps, self.seeds);
        outln!(
            "{:<20} {:<20} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7}",
            "scene",
            "method",
            "MI",
            "NMI",
            "V",
            "V at 8",
            "null",
            "excess"
        );
        for scene in &self.scenes {
            print_methods(&scene.scene, &scene.methods);
        }
        print_methods("median", &self.median);
        for (baseline, gain) in &self.mean_gain {
            let Gain { mutual_information_nats, excess_nats } = gain;
            outln!(
                "mean gain of scene_model over {baseline}: MI {mutual_information_nats:+.3}, excess {excess_nats:+.3}"
            );
        }
    }
}

fn print_methods(scene: &str, methods: &BTreeMap<&'static str, MeanScore>) {
    for (row, (method, score)) in methods.iter().enumerate() {
        outln!(
            "{:<20} {method:<20} {:>6.3} {:>6.3} {:>6.3} {:>6} {:>6.3} {:>7.3}",
            if row == 0 { scene } else { "" },
            score.mutual_information_nats,
            score.normalised_mutual_information,
            score.v_measure,
            score.v_measure_at_8.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}")),
            score.null_mutual_information_nats,
            score.excess_nats
        );
    }
}
