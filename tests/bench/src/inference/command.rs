//! `scenecast-bench inference`

use super::{InferenceRow, InferenceSummary, measure_inference, summarise};
use crate::surveys::{SurveyArguments, fly_all, nats, print_json};
use clap::Args;
use scenecast_config::Config;
use scenecast_core::UserError;

const DEFAULT_CURVE: &str = "scene.refine_words_per_s=10000,50000,250000,1000000";

/// Inference while the vehicle is under way, against a batch over the same frames.
///
/// Each survey is flown with perfect navigation, without registration, at a budget that carries the whole map. `online` is
/// the mutual information of the vehicle's published map with the true classes over the survey's area at its end,
/// unexplored being a label of its own, in nats; `operator` is that of the operator's map at the same moment. `batch` is
/// that of a fresh model with the same seed and the same words, swept in rounds of 10 sweeps until a round lowers the
/// perplexity by less than 0.1 %. `bytes` are those of the map on air, `flips` the changes of labels on the published map,
/// and `cpu` is the part of one core that refinement takes at the end. The last lines have the means and the share of the
/// batch. A mosaic NAME.jpg or NAME.png has its classes in NAME_label.png, where 255 is not annotated; without this file,
/// no information is printed. The same seed gives the same figures, apart from the CPU time.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench inference --seeds 2 --duration 300 --curve")]
pub(crate) struct InferenceBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    surveys: SurveyArguments,
    /// Fly each survey with each of several values of a configuration key, for a curve of information against bytes
    #[arg(long, value_name = "KEY=VALUE,VALUE", num_args = 0..=1, default_missing_value = DEFAULT_CURVE)]
    curve: Option<String>,
    /// Set a configuration value, as in scene.max_labels=32; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl InferenceBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let settings = self.settings()?;
        let surveys = self.surveys.surveys(&settings[0].1)?;
        if !self.json {
            println!(
                "{:<20} {:>4} {:<36} {:>6} {:>8} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}",
                "scene", "seed", "setting", "online", "operator", "batch", "sweeps", "bytes", "cells", "flips", "cpu"
            );
        }
        let print_row = (!self.json).then_some(print as fn(&InferenceRow));
        let rows = fly_all(&surveys, settings.len() as u64, print_row, |survey, progress| {
            measure_inference(&settings, &survey.scenes, survey.seeds, progress)
        })?;
        let means = summarise(&rows);
        if self.json {
            return print_json(&serde_json::json!({ "surveys": rows, "means": means }));
        }
        println!();
        means.iter().for_each(print_mean);
        Ok(())
    }

    /// The configurations to compare, each with its name.
    fn settings(&self) -> Result<Vec<(String, Config)>, UserError> {
        let load = |varied: Option<String>| {
            // Refinement and batch are those of topics.
            let topics = "scene.labels=topics".to_owned();
            let config = self.surveys.config(std::iter::once(&topics).chain(&self.sets).chain(&varied))?;
            Ok((varied.unwrap_or_else(|| "as set".to_owned()), config))
        };
        let Some(curve) = &self.curve else { return Ok(vec![load(None)?]) };
        let Some((key, values)) = curve.split_once('=') else {
            return Err(UserError::Input(format!("--curve {curve} is not allowed; allowed: KEY=VALUE,VALUE")));
        };
        values.split(',').map(|value| load(Some(format!("{key}={value}")))).collect()
    }
}

fn print(row: &InferenceRow) {
    println!(
        "{:<20} {:>4} {:<36} {:>6} {:>8} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6.4}",
        row.scene,
        row.seed,
        row.setting,
        nats(row.online_nats),
        nats(row.operator_nats),
        nats(row.batch_nats),
        row.sweeps,
        row.map_bytes,
        row.cells,
        row.flips,
        row.refinement_cpu
    );
}

fn print_mean(mean: &InferenceSummary) {
    println!(
        "mean {}: online {}, batch {}, share {}, operator's share {}, {:.0} bytes, {:.0} flips, cpu {:.4}",
        mean.setting,
        nats(mean.online_nats),
        nats(mean.batch_nats),
        nats(mean.online_share),
        nats(mean.operator_share),
        mean.map_bytes,
        mean.flips,
        mean.refinement_cpu
    );
}
