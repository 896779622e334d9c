//! `scenecast bench planning`

use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_rehearsal::planning_bench::{Trial, annotated_images, plot, run_all};
use scenecast_tools::Progress;
use std::path::PathBuf;

/// Utility that each planner collects per metre, with a fence, keep-outs and 40 % of the
/// distance that full coverage takes.
///
/// The label maps are made by the scene model from procedural reefs and annotated images; the operator favours
/// one class through the labels that cover it. The planner learns the map cell by cell. The unit is the scene's
/// mean utility of a metre on which every cell in view is new. `known map` is the result of `horizon` if it knows
/// the whole map before it starts, close to the maximum that the limit allows. It takes a few minutes; the same
/// seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench planning --seed 3 --out tracks")]
pub(super) struct PlanningBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder of images NAME.jpg with classes in NAME_label.png; skipped if it does not exist
    #[arg(long, value_name = "DIR", default_value = "../shared/data/eilatmixx")]
    scenes: PathBuf,
    /// Folder for an image of the tracks of each trial
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl PlanningBench {
    pub(super) fn run(self) -> Result<(), UserError> {
        let images = annotated_images(&self.scenes);
        if images.is_empty() {
            eprintln!("skipped: no annotated images in {}; procedural reefs only", self.scenes.display());
        }
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        }
        if !self.json {
            println!(
                "scene             lawnmower   greedy  horizon known map  horizon/lawnmower  horizon/greedy  violations"
            );
        }
        let mut progress = Progress::new("planning");
        let table = run_all(self.seed, &images, &mut |share, trial| {
            progress.show(share);
            if !self.json {
                print_trial(trial);
            }
            self.paint(trial)
        })?;
        drop(progress);
        if self.json {
            println!("{}", serde_json::to_string(&table).map_err(|e| UserError::Failed(e.to_string()))?);
            return Ok(());
        }
        let m = table.median;
        println!("{:<17} {:>9.3} {:>8.3} {:>8.3} {:>9.3}", "median", m.lawnmower, m.greedy, m.horizon, table.map_known);
        println!(
            "horizon: {:.2} x lawnmower, {:.2} x greedy; {} violations; {} seeds",
            m.horizon / m.lawnmower.max(1e-9),
            m.horizon / m.greedy.max(1e-9),
            table.violations,
            table.seeds
        );
        Ok(())
    }

    fn paint(&self, trial: &Trial) -> Result<(), UserError> {
        let Some(dir) = &self.out else { return Ok(()) };
        let png = plot(trial).map_err(|e| UserError::Failed(e.to_string()))?;
        write_whole(&dir.join(format!("{}.png", trial.name)), &png)
    }
}

fn print_trial(t: &Trial) {
    let [lawnmower, greedy, horizon] = t.utility_per_m;
    println!(
        "{:<17} {lawnmower:>9.3} {greedy:>8.3} {horizon:>8.3} {:>9.3} {:>18.2} {:>15.2} {:>11}",
        t.name,
        t.map_known_per_m,
        horizon / lawnmower.max(1e-9),
        horizon / greedy.max(1e-9),
        t.violations
    );
}
