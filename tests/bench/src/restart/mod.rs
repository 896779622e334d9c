//! Restarts of both ends as real processes: nothing that was shown is gone, the maps agree, and orders are applied once.

mod command;
mod ends;
mod forget;
mod page;
mod run;

pub(crate) use command::{ForgetBench, RestartBench};

use ends::failed;
use scenecast_core::UserError;
use scenecast_rehearsal::{Mission, MissionOptions, World};
use serde::Serialize;
use sim_channel::RandomStream;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc;
use std::time::Duration;

/// Duration of the recorded mission that the vehicle plays, seconds of mission time.
const RECORDED_S: f64 = 100.0;
/// Runs at the same time.
const AT_ONCE: usize = 2;
/// The settings of the bench.
#[derive(Debug, Clone)]
pub struct RestartSetting {
    /// The `scenecast` program that is run.
    pub program: PathBuf,
    /// Folder for the files of the runs.
    pub dir: PathBuf,
    pub runs: u32,
    pub seed: u64,
    /// The limit for the page of a restarted surface, seconds.
    pub page_limit_s: f64,
}

/// The figures of one run.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RestartRun {
    /// What was done, in order.
    pub steps: Vec<String>,
    /// Seconds from each start of the surface to the page with everything on it.
    pub page_s: Vec<f64>,
    /// Cells of the operator's map at the end.
    pub cells: usize,
    /// Orders that the vehicle has applied.
    pub applied: usize,
    /// Broken promises, a line each.
    pub faults: Vec<String>,
}

/// The figures of all runs.
#[derive(Debug, Clone, Serialize)]
pub struct RestartFigures {
    pub runs: usize,
    pub restarts: usize,
    /// Seconds from the start of the surface to the full page: median and maximum.
    pub page_s: (f64, f64),
    /// Runs with a broken promise, by their number.
    pub faults: Vec<(u32, String)>,
}

/// Runs the bench; `show` is called after each run.
pub fn restarts(setting: &RestartSetting, show: &mut dyn FnMut(u32, &RestartRun)) -> Result<RestartFigures, UserError> {
    let recording = setting.dir.join("recording");
    record(&recording, RECORDED_S)?;
    let (next, stop) = (AtomicU32::new(1), AtomicBool::new(false));
    let (sender, done) = mpsc::channel();
    let mut all = Vec::new();
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            let (sender, next, stop, recording) = (sender.clone(), &next, &stop, &recording);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number > setting.runs || sender.send((number, one_run(setting, number, recording))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (number, figures) in done {
            let figures = figures.inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            show(number, &figures);
            all.push((number, figures));
        }
        Ok(())
    })?;
    Ok(summary(&all))
}

fn one_run(setting: &RestartSetting, number: u32, recording: &Path) -> Result<RestartRun, UserError> {
    let dir = setting.dir.join(format!("run-{number}"));
    let rng = RandomStream::new(setting.seed, &[number.into()]);
    let figures = run::run(setting, &dir, recording, rng)?;
    if figures.faults.is_empty() {
        std::fs::remove_dir_all(&dir).map_err(failed("removing the files of a run"))?;
    }
    Ok(figures)
}

fn summary(all: &[(u32, RestartRun)]) -> RestartFigures {
    let mut page_s: Vec<f64> = all.iter().flat_map(|(_, run)| run.page_s.iter().copied()).collect();
    page_s.sort_by(f64::total_cmp);
    let median = page_s.get(page_s.len() / 2).copied().unwrap_or_default();
    RestartFigures {
        runs: all.len(),
        restarts: all.iter().map(|(_, run)| run.steps.len()).sum(),
        page_s: (median, page_s.last().copied().unwrap_or_default()),
        faults: all.iter().flat_map(|(n, run)| run.faults.iter().map(|fault| (*n, fault.clone()))).collect(),
    }
}

/// Records the frames of a mission, which every run plays.
pub(crate) fn record(dir: &Path, duration_s: f64) -> Result<(), UserError> {
    let sets = [
        format!("survey.duration_s={duration_s}"),
        "camera.width_px=320".to_owned(),
        "camera.height_px=240".to_owned(),
        "operator.script=none".to_owned(),
    ];
    let config = scenecast_config::load(None, &sets)?;
    let options = MissionOptions { world: World::patches(2, 0.01), seed: 1, record: Some(dir.to_owned()) };
    Mission::new(config, options)?.run(Duration::ZERO, &mut |_| Ok(()))
}
