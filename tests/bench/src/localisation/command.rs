//! `scenecast-bench localisation`

use super::{Localisation, localisation, localisation_plot, run_with_outliers};
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_tools::Progress;
use scenecast_tools::commands::SeedArguments;
use std::path::PathBuf;

/// The error of the vehicle's position over 3 km, with a drift of 1 % of the distance: by dead reckoning alone, with a
/// fix each 10 s of which 10 % are lost, and with 10 % outliers among the fixes: echoes at the USBL head, a faulty GPS,
/// and errors that the surface cannot detect. It takes some seconds; the same seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench localisation --seed 3 --out tracks")]
pub(crate) struct LocalisationBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    seeds: SeedArguments,
    /// Draw the first track with outliers as DIR/localisation.svg
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl LocalisationBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("localisation");
        let found = localisation(self.seeds.first, self.seeds.count, &mut |share| progress.show(share));
        drop(progress);
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
            let (tracks, _) = run_with_outliers(self.seeds.first, 0.1);
            let title = format!(
                "3 km, drift 1 % of the distance, a fix each 10 s, 10 % lost, 10 % outliers; seed {}",
                self.seeds.first
            );
            let svg = localisation_plot(&tracks, &title).map_err(UserError::failed)?;
            write_whole(&dir.join("localisation.svg"), svg.as_bytes())?;
        }
        if self.json {
            let text = serde_json::to_string_pretty(&found).map_err(UserError::failed)?;
            println!("{text}");
        } else {
            print(&found);
        }
        Ok(())
    }
}

fn print(found: &Localisation) {
    println!("Mean error over 3 km, metres. Sent, used and refused: fixes of the run with outliers.");
    println!();
    println!(" seed  without    with  ratio  with outliers  ratio   sent  used  refused by relay  by vehicle");
    for r in &found.runs {
        let count = |name| r.outliers.get(name).copied().unwrap_or(0);
        let at_relay: u64 =
            ["depth", "outlier", "range_only", "too_uncertain", "malformed", "no_gps"].into_iter().map(count).sum();
        println!(
            "{:>5} {:>8.2} {:>7.2} {:>6.3} {:>14.2} {:>6.3} {:>6} {:>5} {:>17} {:>11}",
            r.seed,
            r.without_m,
            r.with_m,
            r.with_m / r.without_m,
            r.with_outliers_m,
            r.with_outliers_m / r.with_m,
            count("sent"),
            count("used"),
            at_relay,
            count("refused_by_vehicle")
        );
    }
    let mean = |name| found.mean_m.get(name).copied().unwrap_or(0.0);
    println!(
        " mean {:>8.2} {:>7.2} {:>6.3} {:>14.2} {:>6.3}",
        mean("without"),
        mean("with"),
        found.ratio,
        mean("with_outliers"),
        found.outlier_ratio
    );
    let verdict = if found.reached { "reached" } else { "NOT reached" };
    println!("Allowed: a ratio of 1/3 with the relay, of 1.2 with outliers: {verdict}.");
}
