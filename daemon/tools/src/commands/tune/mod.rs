//! `scenecast tune`

mod grid;
mod measure;
mod plot;
mod survey;

use crate::progress::Progress;
use clap::Args;
use grid::Grid;
use measure::{mean, measure};
use scenecast_config::Config;
use scenecast_core::tuning_table::{Measurement, Row, Setting, TuningTable, least, most};
use scenecast_core::{UserError, errln, label_picture, outln};
use scenecast_files::{read_image, write_whole};
use scenecast_protocol::map::LabelGrid;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use survey::{Site, Survey};

/// Find the settings of the scene model whose maps agree best with annotations of a similar site.
///
/// For each setting, a virtual camera surveys the mosaic line by line, the scene model refines as at sea, and each
/// change of the map is encoded as in the stream (map chunks only, without loss). Then the model sweeps over all words,
/// and the map is compared with the annotations. An interrupted run resumes.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast tune --mosaic reef.jpg --metres-per-pixel 0.002 --annotations labels.png --ignore 0,255 --budget 1000 --out tuning
         scenecast tune --procedural 1,2,3 --grid grid.toml --out tuning"
)]
pub struct Tune {
    /// Image of the sea floor
    #[arg(long, value_name = "IMG", requires = "annotations", required_unless_present = "procedural")]
    mosaic: Option<PathBuf>,
    /// Size of the image's pixels on the sea floor [default: camera.metres_per_pixel]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    metres_per_pixel: Option<f64>,
    /// Classes of the image's pixels: a grey or indexed image of the same size
    #[arg(long, value_name = "LABELS", requires = "mosaic")]
    annotations: Option<PathBuf>,
    /// Seeds of procedural sea floors, instead of an image; the results are means over them
    #[arg(long, value_name = "SEEDS", value_delimiter = ',', conflicts_with_all = ["mosaic", "annotations"])]
    procedural: Vec<u64>,
    /// Classes that are ignored, separated by commas
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', default_value = "255")]
    ignore: Vec<u8>,
    /// TOML file with lists max_labels, cell_m (metres), frames_per_s and cells ("fine", "coarse"), and with
    /// scene.labels=topics also alpha, beta, gamma and refine_words_per_s, each optional [default: max_labels 4, 6, 8, 11, 16;
    /// of topics alpha 1, .1, .01, .001, beta 10, 1, .1, gamma 1e-3, 1e-4, 1e-5; the rest as configured]
    #[arg(long, value_name = "FILE")]
    grid: Option<PathBuf>,
    /// Maximum rate of the stream of the best setting, bit/s [default: link.budget_bps]
    #[arg(long, value_name = "BPS", allow_negative_numbers = true)]
    budget: Option<f64>,
    /// Sweeps over all words after the survey, where labels are topics
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    sweeps: u32,
    /// Seed of the scene model
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Number of settings that are measured in parallel [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Configuration file of the vehicle
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration, as in scene.max_labels=32 (scenecast config lists them)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder for tuning.csv, tuning.svg, tuning.png, best.toml, and a map of each setting in maps/
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Tune {
    pub fn run(self) -> Result<(), UserError> {
        let config = self.config()?;
        let budget_bps = self.budget.unwrap_or(f64::from(config.link.budget_bps));
        if !(budget_bps > 0.0 && budget_bps.is_finite()) {
            return Err(UserError::Input(format!("--budget {budget_bps}: it takes bits a second, above 0")));
        }
        let grid = Grid::load(self.grid.as_deref(), &config)?;
        let sites = self.sites(&config)?;
        let maps = self.out.join("maps");
        std::fs::create_dir_all(&maps).map_err(|e| UserError::file(&maps, e))?;
        let inputs = Site::fingerprint(&sites, &format!("{} sweeps, seed {}", self.sweeps, self.seed));
        let path = self.out.join("tuning.csv");
        let mut table = GrowingTable { table: open(&path, &inputs)?, path, inputs };
        let settings = grid.settings();
        let left: Vec<Setting> = settings.iter().copied().filter(|setting| !table.table.has(setting)).collect();
        if left.len() < settings.len() {
            errln!("tune: {} of {} settings are in tuning.csv already", settings.len() - left.len(), settings.len());
        }
        self.search(&sites, &left, &mut table)?;
        let rows: Vec<Row> = table.table.rows().copied().collect();
        self.conclude(&config, &rows, budget_bps)
    }

    fn config(&self) -> Result<Config, UserError> {
        let mut sets = self.sets.clone();
        sets.extend(self.metres_per_pixel.map(|m| format!("camera.metres_per_pixel={m:?}")));
        scenecast_config::load(self.config.as_deref(), &sets)
    }

    fn sites<'a>(&'a self, config: &'a Config) -> Result<Vec<Site<'a>>, UserError> {
        match (&self.mosaic, &self.annotations) {
            (Some(mosaic), Some(annotations)) => Ok(vec![Site::load(mosaic, annotations, &self.ignore, config)?]),
            _ => Ok(self.procedural.iter().map(|&seed| Site::procedural(seed, config)).collect()),
        }
    }

    /// Measures settings grouped by the size of their cells; each measurement is written to the table at once.
    fn search(&self, sites: &[Site<'_>], settings: &[Setting], table: &mut GrowingTable) -> Result<(), UserError> {
        let progress = Mutex::new((Progress::new("settings"), 0));
        let table = Mutex::new(table);
        for same_cells in settings.chunk_by(|a, b| a.cell_m == b.cell_m) {
            let surveys = sites.iter().map(|site| Survey::new(site, same_cells[0].cell_m));
            let surveys: Vec<Survey<'_>> = surveys.collect::<Result<_, _>>()?;
            let next = AtomicUsize::new(0);
            let work = || -> Result<(), UserError> {
                while let Some(setting) = same_cells.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let measured = surveys.iter().map(|survey| measure(survey, setting, self.sweeps, self.seed));
                    let (measurements, maps): (Vec<_>, Vec<_>) =
                        measured.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
                    self.draw(setting, &maps)?;
                    let measurement = mean(&measurements);
                    table.lock().unwrap_or_else(PoisonError::into_inner).add(*setting, measurement)?;
                    let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
                    progress.1 += 1;
                    let share = f64::from(progress.1) / settings.len() as f64;
                    progress.0.show(share);
                }
                Ok(())
            };
            let threads = self.threads.map(usize::from);
            let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
            let failed = |_| UserError::Failed("a measuring thread ended early".to_owned());
            std::thread::scope(|scope| {
                let threads: Vec<_> = (0..threads.min(same_cells.len())).map(|_| scope.spawn(work)).collect();
                threads.into_iter().try_for_each(|thread| thread.join().map_err(failed)?)
            })?;
        }
        Ok(())
    }

    /// The picture of the map of the first sea floor.
    fn picture(&self, setting: &Setting) -> PathBuf {
        let name = setting.to_string().replace(", ", "_").replace([' ', '/'], "-");
        self.out.join("maps").join(format!("{name}.png"))
    }

    fn draw(&self, setting: &Setting, maps: &[LabelGrid]) -> Result<(), UserError> {
        let path = self.picture(setting);
        let Some(map) = maps.first() else { return Ok(()) };
        let picture = label_picture::encode(map).map_err(|e| UserError::Failed(format!("{}: {e}", path.display())))?;
        write_whole(&path, &picture)
    }

    fn conclude(&self, config: &Config, rows: &[Row], budget_bps: f64) -> Result<(), UserError> {
        let best = most(rows.iter().filter(|row| row.measurement.stream_bps <= budget_bps));
        let examples = plot::Plot::front_examples(rows).into_iter().filter(|row| self.picture(&row.setting).is_file());
        let examples = examples.map(|row| Ok((row, read_image(&self.picture(&row.setting))?.to_rgb8())));
        let plot = plot::Plot::new(rows, best).with_examples(examples.collect::<Result<_, UserError>>()?);
        write_whole(&self.out.join("tuning.svg"), plot.svg()?.as_bytes())?;
        write_whole(&self.out.join("tuning.png"), &plot.png()?)?;
        let path = self.out.join("best.toml");
        let Some(best) = best else {
            // The file of an earlier run would be taken for the result.
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(UserError::file(&path, e)),
                _ => {}
            }
            let least = least(rows.iter()).map_or(f64::INFINITY, |row| row.measurement.stream_bps);
            let cause = format!("no setting's stream fits --budget {budget_bps} bit/s: the lowest has {least:.0}");
            return Err(UserError::Failed(cause));
        };
        write_whole(&path, grid::toml(best, config, budget_bps).as_bytes())?;
        let Measurement { mutual_information_nats, map_bytes, stream_bps, .. } = best.measurement;
        outln!(
            "{}: {}; MI {mutual_information_nats:.3} nats, map {map_bytes} bytes, stream {stream_bps:.0} bit/s",
            path.display(),
            best.setting
        );
        Ok(())
    }
}

/// The table of a run, rewritten after each measurement.
struct GrowingTable {
    table: TuningTable,
    path: PathBuf,
    /// Fingerprint of all inputs of a measurement except the setting.
    inputs: String,
}

impl GrowingTable {
    fn add(&mut self, setting: Setting, measurement: Measurement) -> Result<(), UserError> {
        self.table.insert(self.inputs.clone(), Row { setting, measurement });
        write_whole(&self.path, self.table.text().as_bytes())
    }
}

/// The table of an earlier run with the same inputs, or an empty one.
fn open(path: &Path, inputs: &str) -> Result<TuningTable, UserError> {
    let refused = |cause: String| UserError::Input(format!("{}:{cause}", path.display()));
    let table = match path.exists() {
        true => {
            let text = scenecast_config::read_regular_text(path)?;
            TuningTable::read(&text).map_err(|error| refused(format!("{error}; give another --out")))?
        }
        false => TuningTable::default(),
    };
    let cause = "was measured with another sea floor, annotations or options than this run's";
    match table.line_of_others(inputs) {
        Some(line) => Err(refused(format!("{line}: {cause}; give those again, or another --out"))),
        None => Ok(table),
    }
}
