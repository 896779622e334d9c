//! `scenecast-bench registration`

use super::{Navigation, RegistrationRow, RegistrationSummary, measure_registration, summarise};
use crate::surveys::{SurveyArguments, fly_all, nats, print_json};
use clap::Args;
use scenecast_core::UserError;

/// The registration of camera frames: errors of their places, and how much of the sea floor the operator's map shows.
///
/// Each survey is flown with perfect navigation, with drifting odometry and fixes, and with registration besides. Errors
/// are root mean squares in cells over all frames: `rigid` after the best turn and shift of the whole map, `placed` with
/// the vehicle's own placement. `information` is the mutual information of the operator's map with the true classes over
/// the survey's area, in nats; the last lines have its share of that with perfect navigation. A mosaic NAME.jpg or
/// NAME.png has its classes in NAME_label.png, where 255 is not annotated; without this file, no information is printed.
/// The same seed gives the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench registration --seeds 2 --duration 300")]
pub(crate) struct RegistrationBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    surveys: SurveyArguments,
    /// Set a configuration value, as in navigation.drift_percent=3; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl RegistrationBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let config = self.surveys.config(&self.sets)?;
        let surveys = self.surveys.surveys(&config)?;
        if !self.json {
            println!(
                "{:<20} {:>4} {:<13} {:>6} {:>7} {:>6} {:>6} {:>7} {:>6} {:>7} {:>5} {:>12}",
                "scene",
                "seed",
                "navigation",
                "rigid",
                "placed",
                "solved",
                "nats",
                "placed",
                "frames",
                "chained",
                "loops",
                "contradicted"
            );
        }
        let print_row = (!self.json).then_some(print as fn(&RegistrationRow));
        let rows = fly_all(&surveys, 3, print_row, |survey, progress| {
            measure_registration(&config, &survey.scenes, survey.seeds, progress)
        })?;
        let means = summarise(&rows);
        if self.json {
            return print_json(&serde_json::json!({ "surveys": rows, "means": means }));
        }
        means.iter().for_each(print_mean);
        Ok(())
    }
}

fn name(navigation: Navigation) -> &'static str {
    match navigation {
        Navigation::Perfect => "perfect",
        Navigation::DeadReckoned => "dead-reckoned",
        Navigation::Registered => "registered",
    }
}

fn print(row: &RegistrationRow) {
    println!(
        "{:<20} {:>4} {:<13} {:>6.3} {:>7.3} {:>6.3} {:>6} {:>7} {:>6} {:>7} {:>5} {:>12}",
        row.scene,
        row.seed,
        name(row.navigation),
        row.error_rigid_cells,
        row.error_placed_cells,
        row.error_solved_cells,
        nats(row.information_rigid_nats),
        nats(row.information_placed_nats),
        row.frames,
        row.chained,
        row.loops,
        row.contradicted
    );
}

fn print_mean(mean: &RegistrationSummary) {
    println!(
        "mean {:<13}: error {:.3} rigid, {:.3} placed, {:.3} solved; share of the information {} rigid, {} placed",
        name(mean.navigation),
        mean.error_rigid_cells,
        mean.error_placed_cells,
        mean.error_solved_cells,
        nats(mean.information_rigid),
        nats(mean.information_placed)
    );
}
