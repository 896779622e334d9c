//! A comparison of the planners: utility per metre on label maps that the vehicle sees cell by cell.

mod planner_run;
mod scene;
mod table;

use planner_run::{MapKnowledge, PlannerRun, Task};
use scene::Scene;
use scenecast_core::UserError;
use scenecast_protocol::directive::PlannerKind;
use serde::Serialize;
use std::path::{Path, PathBuf};
use table::Row;
pub use table::{Estimate, PlanningTable, SourceTable, plot};

/// Where the label maps of a comparison come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Drawn patches, labelled by the scene model.
    Patches,
    /// A drawn reef, labelled by the scene model.
    Reef,
    /// Annotated images, labelled by the scene model.
    Images,
    /// Label maps from indexed PNG files.
    Files,
}

impl Source {
    /// The name for people, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Reef => "reef",
            Self::Images => "images",
            Self::Files => "files",
        }
    }
}

/// The scenes of a comparison that are read from files.
#[derive(Debug, Default)]
pub struct PlanningFiles {
    /// Paths of images, each with the path of its annotation.
    pub images: Vec<(PathBuf, PathBuf)>,
    /// Indexed PNG files: pixel value = label. If there are any, no other scene is used.
    pub labels: Vec<PathBuf>,
}

/// One scene with one start, run with every planner.
#[derive(Debug)]
pub struct Trial {
    pub source: Source,
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

/// Runs `seeds` trials of each source from `seed` on; files are used in turn, each with all seeds if they are label maps.
/// `each` is called after each trial with the share of the work that is done.
///
/// # Errors
///
/// A file that cannot be read, and the errors of `each`.
pub fn run_all(
    (seed, seeds): (u64, u64),
    files: &PlanningFiles,
    each: &mut dyn FnMut(f64, &Trial) -> Result<(), UserError>,
) -> Result<PlanningTable, UserError> {
    let scenes = Scenes::read(files, seed)?;
    let all: Vec<(Source, usize, u64)> = scenes.plan(seeds);
    let mut rows = Vec::new();
    for (done, &(source, file, nth)) in (1..).zip(&all) {
        let seed = seed.wrapping_add(nth);
        let trial = trial((source, scenes.scene(source, file, seed)), seed);
        rows.push(Row::of(&trial));
        each(f64::from(done) / all.len() as f64, &trial)?;
    }
    Ok(PlanningTable::new(&rows, seeds))
}

/// The scenes that are read once, and used with several seeds.
struct Scenes {
    images: Vec<Scene>,
    labels: Vec<Scene>,
}

impl Scenes {
    fn read(files: &PlanningFiles, seed: u64) -> Result<Self, UserError> {
        let labels = files.labels.iter().map(|path| Scene::from_label_map(path)).collect::<Result<Vec<_>, _>>()?;
        let used = if labels.is_empty() { files.images.as_slice() } else { &[] };
        let images = used.iter().map(|(i, l)| Scene::from_files(i, l, seed)).collect::<Result<_, _>>()?;
        Ok(Self { images, labels })
    }

    /// The source, the number of its file and the number of the seed of each trial.
    fn plan(&self, seeds: u64) -> Vec<(Source, usize, u64)> {
        if !self.labels.is_empty() {
            return (0..self.labels.len()).flat_map(|f| (0..seeds).map(move |n| (Source::Files, f, n))).collect();
        }
        let drawn = [Source::Patches, Source::Reef];
        let mut all: Vec<_> = drawn.into_iter().flat_map(|s| (0..seeds).map(move |n| (s, 0, n))).collect();
        if !self.images.is_empty() {
            all.extend((0..seeds).map(|n| (Source::Images, n as usize % self.images.len(), n)));
        }
        all
    }

    fn scene(&self, source: Source, file: usize, seed: u64) -> Scene {
        match source {
            Source::Patches => Scene::patches(seed),
            Source::Reef => Scene::reef(seed),
            Source::Images => self.images[file].clone(),
            Source::Files => self.labels[file].clone(),
        }
    }
}

fn trial((source, scene): (Source, Scene), seed: u64) -> Trial {
    let task = Task::draw(&scene, seed);
    let runs = PlannerKind::ALL.map(|kind| planner_run::run_planner(&scene, &task, kind, MapKnowledge::Seen));
    let all = planner_run::run_planner(&scene, &task, PlannerKind::Horizon, MapKnowledge::All);
    let rate = |d: &PlannerRun| d.utility / d.metres().max(1e-9) / task.mean_per_m.max(1e-9);
    let utility_per_m = runs.each_ref().map(rate);
    let map_known_per_m = rate(&all);
    let violations = runs.iter().chain([&all]).map(|d| d.violations(&task)).sum();
    let name = format!("{}-{seed}", scene.name);
    Trial { source, name, utility_per_m, map_known_per_m, violations, scene, task, runs: runs.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_repeatable_and_violates_no_constraint() {
        let scene = Scene::small(3);
        let (a, b) = (trial((Source::Patches, scene.clone()), 3), trial((Source::Patches, scene), 3));
        assert_eq!(a.utility_per_m, b.utility_per_m);
        assert_eq!(a.violations, 0);
        assert!(a.utility_per_m.iter().all(|&u| u > 0.0), "{:?}", a.utility_per_m);
        let lawnmower = a.utility_per_m[0];
        assert!(a.map_known_per_m > lawnmower, "{} against {lawnmower}", a.map_known_per_m);
        assert!(a.runs.iter().all(|d| d.metres() > 0.5 * a.task.limit_m), "the limit is used");
    }
}
