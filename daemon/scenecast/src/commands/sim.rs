//! `scenecast sim`

use crate::mission_record::{MissionRecord, UnseenPage};
use clap::Args;
use scenecast_config::Config;
use scenecast_core::{UserError, errln, outln};
use scenecast_files::Recorder;
use scenecast_rehearsal::{Mission, MissionOptions, World, report, write_outputs};
use scenecast_tools::Progress;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Mission time after which the records are made durable. A simulated mission can be run again.
const SYNC_INTERVAL: Duration = Duration::from_secs(10);

/// The sea floor and the configuration of a rehearsal.
#[derive(Debug, Args)]
pub(super) struct WorldArguments {
    /// Scenario: a configuration file [default: every key at its default]
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
    /// Image of a sea floor [default: the one of world.kind]
    #[arg(long, value_name = "IMG")]
    pub mosaic: Option<PathBuf>,
    /// Classes of the image's pixels: a grey or indexed image of the same size; 255 is not annotated
    #[arg(long, value_name = "LABELS", requires = "mosaic")]
    pub annotations: Option<PathBuf>,
    /// Size of the image's pixels on the sea floor [default: camera.metres_per_pixel]
    #[arg(long, value_name = "M", requires = "mosaic", allow_negative_numbers = true)]
    pub metres_per_pixel: Option<f64>,
    /// Duration of the survey in seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Set a key of the configuration, as in link.budget_bps=2000 (scenecast config lists them)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
}

impl WorldArguments {
    /// The configuration with all arguments applied.
    pub fn config(&self) -> Result<Config, UserError> {
        let mut sets = self.sets.clone();
        sets.extend(self.metres_per_pixel.map(|m| format!("camera.metres_per_pixel={m:?}")));
        sets.extend(self.duration.map(|d| format!("survey.duration_s={d:?}")));
        let config = scenecast_config::load(self.scenario.as_deref(), &sets)?;
        if config.survey.duration_s <= 0.0 {
            return Err(UserError::Input(
                "survey.duration_s = 0 is not allowed in a rehearsal; allowed: more than 0 s".to_owned(),
            ));
        }
        Ok(config)
    }

    /// The sea floor: the given image or a procedural reef.
    pub fn world(&self, config: &Config) -> Result<World, UserError> {
        match &self.mosaic {
            Some(mosaic) => {
                let metres_per_pixel = config.camera.metres_per_pixel;
                let world = World::from_files(mosaic, self.annotations.as_deref(), metres_per_pixel)?;
                let ((width_m, height_m), area) = (world.area().size_m(), config.survey.area_m);
                let beyond = match area.is_some_and(|area| world.area().common(&area) != Some(area)) {
                    true => "; survey.area_m reaches beyond it, where the sea floor is its mirror image",
                    false => "",
                };
                errln!(
                    "{}: {width_m:.1} x {height_m:.1} m of sea floor, with pixels of {metres_per_pixel} m (--metres-per-pixel){beyond}",
                    mosaic.display()
                );
                Ok(world)
            }
            None => Ok(World::procedural(config, self.seed)),
        }
    }

    /// Name of the scenario for the report.
    pub fn scenario_name(&self) -> String {
        let stem = self.scenario.as_ref().and_then(|p| p.file_stem()).map(|s| s.to_string_lossy().into_owned());
        stem.unwrap_or_else(|| "default".to_owned())
    }
}

/// Run a simulated mission in virtual time, and write a report.
///
/// The same arguments and seed give the same report.json, byte for byte, except for the members under "wall".
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast sim --set channel.loss=0.3 --set link.budget_bps=1000 --duration 600 --out run1"
)]
pub(super) struct Sim {
    #[command(flatten)]
    world: WorldArguments,
    /// Record the camera frames and poses into a folder, for camera.source=frames:DIR
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Maximum time in seconds for the link to send the rest after the survey
    #[arg(long, value_name = "SECONDS", default_value_t = 7200.0, allow_negative_numbers = true)]
    drain: f64,
    /// Folder for report.json, maps, images and frames.log
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the results that the folder has, and the recording
    #[arg(long)]
    force: bool,
    /// Print the report as JSON instead of a line of figures
    #[arg(long)]
    json: bool,
}

impl Sim {
    pub(super) fn run(self) -> Result<(), UserError> {
        scenecast_runtime::keep_private();
        let started = Instant::now();
        if !self.drain.is_finite() || self.drain < 0.0 {
            return Err(UserError::Input(format!("--drain {} is not allowed; allowed: 0 s or more", self.drain)));
        }
        if !self.force && self.out.join("report.json").exists() {
            let what = "it has the results of another run: give a new folder, or replace them by --force";
            return Err(UserError::file(&self.out, what));
        }
        if let Some(record) = self.record.as_ref().filter(|record| !self.force && Recorder::has_recording(record)) {
            let what = "it has another recording: give a new folder, or replace it by --force";
            return Err(UserError::file(record, what));
        }
        let config = self.world.config()?;
        let world = self.world.world(&config)?;
        let options = MissionOptions { world, seed: self.world.seed, record: self.record.clone() };
        let mut mission = Mission::new(config.clone(), options)?;
        // Before the mission flies, which may take long.
        std::fs::create_dir_all(&self.out).map_err(|e| UserError::file(&self.out, e))?;
        let mut progress = Progress::new("survey");
        let mut record = self.record_ends(&mut mission)?;
        let (mut page, end_s) = (UnseenPage::new(&mission, self.world.seed), config.survey.duration_s);
        mission.run(Duration::from_secs_f64(self.drain), &mut |mission| {
            progress.show((mission.now().as_secs_f64() / end_s).min(1.0));
            record.as_mut().map_or(Ok(()), |record| record.observe(mission, &page.snapshot(mission)))
        })?;
        if let Some(mut record) = record {
            // What the end of the survey has brought.
            let last = page.snapshot(&mission);
            record.observe(&mut mission, &last)?;
            record.finish(&mission)?;
        }
        drop(progress);
        for refused in mission.refused_labels() {
            errln!("refused: {refused}");
        }
        mission.notes().for_each(|note| errln!("{note}"));
        let report = report(&mission, &self.world.scenario_name());
        let seconds = started.elapsed().as_secs_f64();
        let speedup = mission.now().as_secs_f64() / seconds;
        write_outputs(&mission, &report, json!({ "seconds": seconds, "speedup": speedup }), &self.out)?;
        if self.json {
            outln!("{}", report.json);
            return Ok(());
        }
        let map = &report.json["map"];
        let link = &report.json["link"];
        let energy = match (link["up"]["energy_j"].as_f64(), link["energy_per_map_bit_j"].as_f64()) {
            (Some(joules), Some(per_bit)) => format!("{joules:.1} J up ({:.2} mJ per map bit), ", per_bit * 1e3),
            (Some(joules), None) => format!("{joules:.1} J up, "),
            _ => String::new(),
        };
        // What the pictures and the records have; the scene model has more cells until they are published.
        let operator_map = mission.operator_map();
        let labels: BTreeSet<u8> = operator_map.iter().map(|(_, label)| label).collect();
        outln!(
            "{}: {} cells, {} labels, agreement {} at the end, {} on the mean, {energy}{seconds:.1} s",
            self.out.join("report.json").display(),
            operator_map.explored(),
            labels.len(),
            map["agreement_final"],
            map["agreement_mean"],
        );
        Ok(())
    }

    /// The records of both ends, in folders beside the report.
    fn record_ends(&self, mission: &mut Mission) -> Result<Option<MissionRecord>, UserError> {
        if !mission.config().record.enabled {
            return Ok(None);
        }
        let dirs = ["record_surface", "record_vehicle"].map(|name| self.out.join(name));
        for dir in dirs.iter().filter(|dir| dir.exists()) {
            std::fs::remove_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        }
        MissionRecord::create(mission, [&dirs[0], &dirs[1]], SYNC_INTERVAL).map(Some)
    }
}
