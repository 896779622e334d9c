//! `scenecast bench planning`

use clap::Args;
use scenecast_core::{UserError, errln, outln};
use scenecast_files::write_whole;
use scenecast_rehearsal::planning_bench::{
    Estimate, PlanningFiles, PlanningTable, SourceTable, Trial, annotated_images, plot, run_all,
};
use scenecast_tools::Progress;
use scenecast_tools::commands::SeedArguments;
use std::path::PathBuf;

/// Utility that each planner collects per metre, with a fence, keep-outs and 40 % of the
/// distance that full coverage takes.
///
/// The label maps are made by the scene model from drawn patches, from drawn reefs and from annotated images, or are read
/// from files with --labels. The operator favours one class through the labels that cover it; in a label map from a file,
/// the rarest label that covers at least 5 %. The planner learns the map cell by cell. The unit is the scene's mean utility
/// of a metre on which every cell in view is new. `known map` is the result of `horizon` if it knows the whole map before
/// it starts, close to the maximum that the limit allows. The last lines are means with their standard errors. It takes a
/// few minutes; the same seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench planning --seed 3 --out tracks")]
pub(crate) struct PlanningBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    seeds: SeedArguments,
    /// Folder of images NAME.jpg with classes in NAME_label.png; skipped if it does not exist
    #[arg(long, value_name = "DIR", default_value = "../shared/data/eilatmixx")]
    scenes: PathBuf,
    /// Label maps instead of all other scenes: indexed PNG files, pixel value = label, 0 = no label; made coarser to at
    /// most 125 cells of 0.25 m
    #[arg(long, value_name = "PNG", num_args = 1..)]
    labels: Vec<PathBuf>,
    /// Folder for an image of the tracks of each trial
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl PlanningBench {
    pub(super) fn run(self) -> Result<(), UserError> {
        let images = annotated_images(&self.scenes);
        if images.is_empty() && self.labels.is_empty() {
            errln!("skipped: no annotated images in {}; drawn scenes only", self.scenes.display());
        }
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        }
        if !self.json {
            outln!("{:<22} {HEAD}", "scene");
        }
        let mut progress = Progress::new("planning");
        let files = PlanningFiles { images, labels: self.labels.clone() };
        let table = run_all((self.seeds.first, self.seeds.count), &files, &mut |share, trial| {
            progress.show(share);
            if !self.json {
                print_trial(trial);
            }
            self.paint(trial)
        })?;
        drop(progress);
        if self.json {
            outln!("{}", serde_json::to_string(&table).map_err(UserError::failed)?);
            return Ok(());
        }
        print_means(&table);
        Ok(())
    }

    fn paint(&self, trial: &Trial) -> Result<(), UserError> {
        let Some(dir) = &self.out else { return Ok(()) };
        let png = plot(trial).map_err(UserError::failed)?;
        write_whole(&dir.join(format!("{}.png", trial.name)), &png)
    }
}

const HEAD: &str =
    "   lawnmower        greedy       horizon     known map  horizon/lawnmower  horizon/greedy  violations";

fn print_trial(t: &Trial) {
    let [lawnmower, greedy, horizon] = t.utility_per_m;
    outln!(
        "{:<22} {lawnmower:>12.3} {greedy:>13.3} {horizon:>13.3} {:>13.3} {:>18.2} {:>15.2} {:>11}",
        t.name,
        t.map_known_per_m,
        horizon / lawnmower.max(1e-9),
        horizon / greedy.max(1e-9),
        t.violations
    );
}

fn print_means(table: &PlanningTable) {
    let text = |e: Estimate| format!("{:.3}±{:.3}", e.value, e.standard_error);
    for SourceTable {
        source,
        trials,
        lawnmower,
        greedy,
        horizon,
        map_known,
        horizon_by_lawnmower,
        horizon_by_greedy,
    } in &table.sources
    {
        outln!(
            "{:<22} {:>12} {:>13} {:>13} {:>13} {:>18} {:>15}",
            format!("mean of {trials}, {}", source.name()),
            text(*lawnmower),
            text(*greedy),
            text(*horizon),
            text(*map_known),
            text(*horizon_by_lawnmower),
            text(*horizon_by_greedy)
        );
    }
    outln!("{} violations; {} seeds", table.violations, table.seeds);
}
