//! `scenecast-bench restart`

use super::{RECORDED_S, RestartRun, RestartSetting, forget, record, restarts};
use crate::program::ProgramArgument;
use clap::Args;
use scenecast_core::UserError;

/// Restarts of both ends as processes of this machine, at random instants of a mission: SIGKILL and SIGTERM, disks that
/// are full, and folders that are removed.
///
/// After each restart of the surface everything that its page showed must be there soon; at the end no order was
/// applied twice, and a surface without a past receives the same map. Exit code 1 if a promise was broken; the files of
/// such a run are kept.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench restart --runs 5")]
pub(crate) struct RestartBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers; the times at which processes run are the machine's
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of missions, with three restarts each
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    runs: u32,
    /// Time within which the page of a restarted surface must show everything, seconds
    #[arg(long = "page-limit", value_name = "SECONDS", default_value_t = 2.0)]
    page_limit_s: f64,
    #[command(flatten)]
    program: ProgramArgument,
}

impl RestartBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let program = self.program.path()?;
        let dir = std::env::temp_dir().join(format!("scenecast-restart-{}", std::process::id()));
        let setting = RestartSetting {
            program,
            dir: dir.clone(),
            runs: self.runs,
            seed: self.seed,
            page_limit_s: self.page_limit_s,
        };
        if !self.json {
            println!("run  cells applied  full page s  restarts");
        }
        let figures = restarts(&setting, &mut |number, run| {
            if !self.json {
                print_run(number, run);
            }
        })?;
        if self.json {
            let text = serde_json::to_string_pretty(&figures).map_err(UserError::failed)?;
            println!("{text}");
        } else {
            let (median, worst) = figures.page_s;
            println!("{} restarts in {} runs", figures.restarts, figures.runs);
            println!("full page: median {median:.2} s, worst {worst:.2} s (limit {} s)", self.page_limit_s);
        }
        if figures.faults.is_empty() {
            return std::fs::remove_dir_all(&dir).map_err(|e| UserError::file(&dir, e));
        }
        let count = figures.faults.len();
        Err(UserError::Failed(format!("{count} broken promises; the files of these runs are in {}", dir.display())))
    }
}

fn print_run(number: u32, run: &RestartRun) {
    let slowest = run.page_s.iter().copied().fold(0.0, f64::max);
    println!("{number:>3} {:>6} {:>7} {slowest:>12.2}  {}", run.cells, run.applied, run.steps.join("; "));
    run.faults.iter().for_each(|fault| println!("    BROKEN: {fault}"));
}

/// Vehicles that lose the folder with their orders, as processes of this machine: each holds or keeps to a fence of its own, the page
/// names the loss, and the surface gives fence and limits again, after a confirmation or by itself.
///
/// Exit code 1 if a promise was broken; the files of that run are kept.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench forget --runs 3")]
pub(crate) struct ForgetBench {
    /// Number of missions, a third of them with each setting
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    runs: u32,
    #[command(flatten)]
    program: ProgramArgument,
}

impl ForgetBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let program = self.program.path()?;
        let dir = std::env::temp_dir().join(format!("scenecast-forget-{}", std::process::id()));
        let recording = dir.join("recording");
        record(&recording, RECORDED_S)?;
        println!("run  safe after s  orders again after s");
        for number in 1..=self.runs {
            let run = forget::run(&program, &dir.join(format!("run-{number}")), &recording, number)
                .map_err(|e| UserError::Failed(format!("run {number} in {}: {e}", dir.display())))?;
            println!("{number:>3} {:>13.1} {:>21.1}  {}", run.safe_s, run.restored_s, run.setting);
        }
        println!(
            "{0} of {0} vehicles without their folder were safe, and {0} of {0} surfaces gave their orders again",
            self.runs
        );
        std::fs::remove_dir_all(&dir).map_err(|e| UserError::file(&dir, e))
    }
}
