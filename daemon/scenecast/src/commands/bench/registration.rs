//! `scenecast bench registration`

use super::SeedArguments;
use clap::Args;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_rehearsal::World;
use scenecast_rehearsal::registration_bench::{
    Navigation, RegistrationRow, RegistrationSummary, measure_registration, summarise,
};
use scenecast_tools::Progress;
use std::path::{Path, PathBuf};

/// The registration of camera frames: errors of their places, and how much of the sea floor the operator's map shows.
///
/// Each survey is flown with perfect navigation, with drifting odometry and fixes, and with registration besides. Errors
/// are root mean squares in cells over all frames: `rigid` after the best turn and shift of the whole map, `placed` with
/// the vehicle's own placement. `information` is the mutual information of the operator's map with the true classes over
/// the survey's area, in nats; the last lines have its share of that with perfect navigation. A mosaic NAME.jpg or
/// NAME.png has its classes in NAME_label.png, where 255 is not annotated; without this file, no information is printed.
/// The same seed gives the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench registration --seeds 2 --duration 300")]
pub(crate) struct RegistrationBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    seeds: SeedArguments,
    /// Images of sea floors [default: a drawn reef for each seed]
    #[arg(long, value_name = "IMG", num_args = 1..)]
    mosaics: Vec<PathBuf>,
    /// Duration of each survey in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, allow_negative_numbers = true)]
    duration: f64,
    /// Set a configuration value, as in navigation.drift_percent=3; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl RegistrationBench {
    pub(super) fn run(self) -> Result<(), UserError> {
        if !self.duration.is_finite() || self.duration <= 0.0 {
            return Err(UserError::Input(format!(
                "--duration {} is not allowed; allowed: more than 0 s",
                self.duration
            )));
        }
        let ours = ["operator.script=none".to_owned(), format!("survey.duration_s={:?}", self.duration)];
        let sets: Vec<String> = ours.into_iter().chain(self.sets.iter().cloned()).collect();
        let config = scenecast_config::load(None, &sets)?;
        let surveys = self.surveys(&config)?;
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
        let total: u64 = surveys.iter().map(|survey| 3 * survey.seeds.1 * survey.scenes.len() as u64).sum();
        let mut progress = Progress::new("surveys");
        let mut rows = Vec::new();
        let mut done = 0.0;
        for Surveys { scenes, seeds } in &surveys {
            rows.extend(measure_registration(&config, scenes, *seeds, &mut |row| {
                done += 1.0;
                progress.show(done / total as f64);
                if !self.json {
                    print(row);
                }
            })?);
        }
        drop(progress);
        let means = summarise(&rows);
        if self.json {
            let all = serde_json::json!({ "surveys": rows, "means": means });
            println!("{}", serde_json::to_string_pretty(&all).map_err(|e| UserError::Failed(e.to_string()))?);
        } else {
            means.iter().for_each(print_mean);
        }
        Ok(())
    }

    /// A reef for each seed, or each seed over every mosaic.
    fn surveys(&self, config: &Config) -> Result<Vec<Surveys>, UserError> {
        if self.mosaics.is_empty() {
            let reef = |seed| {
                let scenes = vec![(format!("reef {seed}"), World::procedural(config, seed))];
                Surveys { scenes, seeds: (seed, 1) }
            };
            return Ok((self.seeds.first..self.seeds.first + self.seeds.count).map(reef).collect());
        }
        let mpp = config.camera.metres_per_pixel;
        let scenes = self.mosaics.iter().map(|path| scene(path, mpp)).collect::<Result<_, _>>()?;
        Ok(vec![Surveys { scenes, seeds: (self.seeds.first, self.seeds.count) }])
    }
}

/// Sea floors by their names, and the first seed and the number of seeds of each.
struct Surveys {
    scenes: Vec<(String, World)>,
    seeds: (u64, u64),
}

pub(super) fn scene(path: &Path, metres_per_pixel: f64) -> Result<(String, World), UserError> {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let classes = path.with_file_name(format!("{stem}_label.png"));
    let world = World::from_files(path, Some(classes.as_path()).filter(|path| path.is_file()), metres_per_pixel)?;
    Ok((stem, world))
}

fn name(navigation: Navigation) -> &'static str {
    match navigation {
        Navigation::Perfect => "perfect",
        Navigation::DeadReckoned => "dead-reckoned",
        Navigation::Registered => "registered",
    }
}

fn print(row: &RegistrationRow) {
    let nats = |value: Option<f64>| value.map_or("-".to_owned(), |nats| format!("{nats:.3}"));
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
    let share = |value: Option<f64>| value.map_or("-".to_owned(), |share| format!("{share:.3}"));
    println!(
        "mean {:<13}: error {:.3} rigid, {:.3} placed, {:.3} solved; share of the information {} rigid, {} placed",
        name(mean.navigation),
        mean.error_rigid_cells,
        mean.error_placed_cells,
        mean.error_solved_cells,
        share(mean.information_rigid),
        share(mean.information_placed)
    );
}
