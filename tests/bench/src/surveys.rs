//! Surveys over several sea floors with several seeds, for benches that print a row for each and their means.

use clap::Args;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_rehearsal::World;
use scenecast_tools::Progress;
use scenecast_tools::commands::SeedArguments;
use std::path::{Path, PathBuf};

/// The seeds, the sea floors and the duration of surveys.
#[derive(Debug, Args)]
pub(crate) struct SurveyArguments {
    #[command(flatten)]
    seeds: SeedArguments,
    /// Images of sea floors [default: a drawn reef for each seed]
    #[arg(long, value_name = "IMG", num_args = 1..)]
    mosaics: Vec<PathBuf>,
    /// Duration of each survey in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, allow_negative_numbers = true)]
    duration: f64,
}

/// Sea floors by their names, and the first seed and the number of seeds of each.
pub(crate) struct Surveys {
    pub(crate) scenes: Vec<(String, World)>,
    pub(crate) seeds: (u64, u64),
}

impl SurveyArguments {
    /// The configuration of surveys without orders; later ones of `sets` prevail.
    pub(crate) fn config<'a>(&self, sets: impl IntoIterator<Item = &'a String>) -> Result<Config, UserError> {
        if !self.duration.is_finite() || self.duration <= 0.0 {
            return Err(UserError::Input(format!(
                "--duration {} is not allowed; allowed: more than 0 s",
                self.duration
            )));
        }
        let ours = ["operator.script=none".to_owned(), format!("survey.duration_s={:?}", self.duration)];
        let sets: Vec<String> = ours.into_iter().chain(sets.into_iter().cloned()).collect();
        scenecast_config::load(None, &sets)
    }

    /// A reef for each seed, or each seed over every mosaic.
    pub(crate) fn surveys(&self, config: &Config) -> Result<Vec<Surveys>, UserError> {
        let SeedArguments { first, count } = self.seeds;
        if self.mosaics.is_empty() {
            let reef = |seed| {
                let scenes = vec![(format!("reef {seed}"), World::procedural(config, seed))];
                Surveys { scenes, seeds: (seed, 1) }
            };
            return Ok((first..first + count).map(reef).collect());
        }
        let mpp = config.camera.metres_per_pixel;
        let scenes = self.mosaics.iter().map(|path| scene(path, mpp)).collect::<Result<_, _>>()?;
        Ok(vec![Surveys { scenes, seeds: (first, count) }])
    }
}

/// A mosaic by its name, with the classes of NAME_label.png if there is that file.
fn scene(path: &Path, metres_per_pixel: f64) -> Result<(String, World), UserError> {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let classes = path.with_file_name(format!("{stem}_label.png"));
    let world = World::from_files(path, Some(classes.as_path()).filter(|path| path.is_file()), metres_per_pixel)?;
    Ok((stem, world))
}

/// Flies all surveys with progress; `fly` gives each row to its last argument, and each sea floor and seed has
/// `rows_each` of them. `print` prints a row at once.
pub(crate) fn fly_all<R>(
    surveys: &[Surveys],
    rows_each: u64,
    print: Option<fn(&R)>,
    mut fly: impl FnMut(&Surveys, &mut dyn FnMut(&R)) -> Result<Vec<R>, UserError>,
) -> Result<Vec<R>, UserError> {
    let total: u64 = surveys.iter().map(|survey| rows_each * survey.seeds.1 * survey.scenes.len() as u64).sum();
    let mut progress = Progress::new("surveys");
    let (mut rows, mut done) = (Vec::new(), 0.0);
    for survey in surveys {
        rows.extend(fly(survey, &mut |row| {
            done += 1.0;
            progress.show(done / total as f64);
            if let Some(print) = print {
                print(row);
            }
        })?);
    }
    Ok(rows)
}

pub(crate) fn print_json(all: &serde_json::Value) -> Result<(), UserError> {
    println!("{}", serde_json::to_string_pretty(all).map_err(UserError::failed)?);
    Ok(())
}

/// Nats, or a share of them, with three digits; a dash without annotation.
pub(crate) fn nats(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |nats| format!("{nats:.3}"))
}
