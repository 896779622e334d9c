//! A comparison of the planners: utility per metre on label maps that the vehicle sees cell by cell.

mod planner_run;
mod plot;
mod scene;

use planner_run::{MapKnowledge, PlannerRun, Task};
pub use plot::plot;
use scene::Scene;
use scenecast_core::UserError;
use scenecast_protocol::directive::PlannerKind;
use serde::Serialize;
use std::path::{Path, PathBuf};

pub const SEEDS: u64 = 32;

/// One scene with one start, run with every planner.
#[derive(Debug)]
pub struct Trial {
    pub name: String,
    /// Utility per metre in units of the scene's mean, by planner in the order of [`PlannerKind::ALL`].
    pub utility_per_m: [f64; 3],
    /// The same value for `horizon` if it knows the whole map from the start.
    pub map_known_per_m: f64,
    /// Breaches of fence, keep-outs and limit, by the track audit.
    pub violations: usize,
    pub(crate) scene: Scene,
    pub(crate) task: Task,
    pub(crate) runs: Vec<PlannerRun>,
}

/// Medians over all trials, by planner.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Medians {
    pub lawnmower: f64,
    pub greedy: f64,
    /// The planner of the best path over a horizon.
    pub horizon: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlanningTable {
    /// Utility per metre in units of the scene's mean utility of a metre on which all is new, so that rare and
    /// common classes have equal weight.
    pub median: Medians,
    /// Median of `horizon` if it knows the whole map from the start: the difference is the cost of not knowing it.
    pub map_known: f64,
    pub violations: usize,
    pub seeds: u64,
}

/// The images with annotations in a folder, in the order of their names.
pub fn annotated_images(dir: &Path) -> Vec<(PathBuf, PathBuf)> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten().map(|e| e.path());
    let labelled = entries.filter(|p| p.extension().is_some_and(|e| e == "jpg")).filter_map(|image| {
        let stem = image.file_stem()?.to_string_lossy().into_owned();
        let labels = image.with_file_name(format!("{stem}_label.png"));
        labels.is_file().then_some((image, labels))
    });
    let mut found: Vec<_> = labelled.collect();
    found.sort();
    found
}

/// Runs every trial: each seed has a procedural reef and, if there are any, one of the annotated images.
pub fn run_all(
    seed: u64,
    images: &[(PathBuf, PathBuf)],
    each: &mut dyn FnMut(f64, &Trial) -> Result<(), UserError>,
) -> Result<PlanningTable, UserError> {
    let real = images.iter().map(|(i, l)| Scene::from_files(i, l, seed)).collect::<Result<Vec<_>, _>>()?;
    let (mut found, mut map_known) = (Vec::new(), Vec::new());
    let mut violations = 0;
    for n in 0..SEEDS {
        let reef = Scene::procedural(seed.wrapping_add(n));
        let here = (!real.is_empty()).then(|| real[n as usize % real.len()].clone());
        for scene in here.into_iter().chain([reef]) {
            let trial = trial(scene, seed.wrapping_add(n));
            violations += trial.violations;
            found.push(trial.utility_per_m);
            map_known.push(trial.map_known_per_m);
            each((n + 1) as f64 / SEEDS as f64, &trial)?;
        }
    }
    let [lawnmower, greedy, horizon] = [0, 1, 2].map(|i| median(found.iter().map(|f| f[i]).collect()));
    let median_of = Medians { lawnmower, greedy, horizon };
    Ok(PlanningTable { median: median_of, map_known: median(map_known), violations, seeds: SEEDS })
}

fn trial(scene: Scene, seed: u64) -> Trial {
    let task = Task::draw(&scene, seed);
    let runs = PlannerKind::ALL.map(|kind| planner_run::run_planner(&scene, &task, kind, MapKnowledge::Seen));
    let all = planner_run::run_planner(&scene, &task, PlannerKind::Horizon, MapKnowledge::All);
    let rate = |d: &PlannerRun| d.utility / d.metres().max(1e-9) / task.mean_per_m.max(1e-9);
    let utility_per_m = runs.each_ref().map(rate);
    let map_known_per_m = rate(&all);
    let violations = runs.iter().chain([&all]).map(|d| d.violations(&task)).sum();
    Trial { name: scene.name.clone(), utility_per_m, map_known_per_m, violations, scene, task, runs: runs.into() }
}

/// Median of the values, rounded to a thousandth.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let value = match values.len() % 2 {
        0 if middle > 0 => (values[middle - 1] + values[middle]) / 2.0,
        _ => values.get(middle).copied().unwrap_or(0.0),
    };
    (value * 1e3).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_repeatable_and_violates_no_constraint() {
        let scene = Scene::small(3);
        let (a, b) = (trial(scene.clone(), 3), trial(scene, 3));
        assert_eq!(a.utility_per_m, b.utility_per_m);
        assert_eq!(a.violations, 0);
        assert!(a.utility_per_m.iter().all(|&u| u > 0.0), "{:?}", a.utility_per_m);
        let lawnmower = a.utility_per_m[0];
        assert!(a.map_known_per_m > lawnmower, "{} against {lawnmower}", a.map_known_per_m);
        assert!(a.runs.iter().all(|d| d.metres() > 0.5 * a.task.limit_m), "the limit is used");
    }
}
