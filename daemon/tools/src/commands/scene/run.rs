//! `scenecast scene run`

use super::run_options::{Edges, Input, Labels, Parameters, Which, edges};
use crate::print_figures;
use crate::progress::Progress;
use crate::scene::{
    Annotated, CELL_PX, FLAT_M, Frames, LabelledMap, LearningEffort, Look, Mosaic, RunReport, Schedule, Tum,
    WordSource, WordsFile, learn, learn_habitats, quality, read_vocabulary, write,
};
use clap::Args;
use scene_model::habitats::Habitats;
use scene_model::topics::{Birth, SceneConfig, SceneModel};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_core::{UserError, errln};
use scenecast_files::{BagTiming, open_bag};
use scenecast_sensors::{BitDepth, CameraMounting};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A camera at the point whose pose is measured, with poses that are interpolated within a second. Its height is not known, so
/// that tilt moves nothing.
fn level_camera() -> BagTiming {
    let max_gap = Duration::from_secs(1);
    BagTiming {
        max_gap,
        clock_offset_s: 0.0,
        mounting: CameraMounting::default(),
        altitude_m: 0.0,
        calibration: None,
        reads_info: false,
        bits: BitDepth::default(),
    }
}

/// Label words, a mosaic or a sequence of images, and print the measurements: in a pipe or a file as one line of JSON.
///
/// Writes labels.png (indexed; pixel = label, 0 = unexplored; x to the right, y up; for stacked cells the label with
/// most words in the column) and labels.csv (for each cell: its centre in metres, label, confidence and perplexity; of
/// stacked cells, the one in the image comes last). Labels are numbered from 1 by age. Habitats depend on the images
/// alone; the same seed gives the same topics with any number of threads.
///
/// "seconds" and "cpu_seconds" are wall and CPU time of resampling, or of clustering, "words_per_cpu_second" is
/// resampled / cpu_seconds. What only topics have is null for habitats. "labels" counts the labels in use,
/// "labels_used" those in labels.csv. The mutual information of labels and annotated classes is taken cell by cell, and
/// its null value is that of the displaced labels. Without annotations both are null.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast scene run --mosaic reef.jpg --annotations classes.png --out run1
Example: scenecast scene run --source frames:dive7 --labels topics --sweeps 60 --out run4
Example: scenecast scene run --words words.csv --cell-size 0.5 --refine-rate 100000 --out run2
Example: scenecast scene run --source tum:rgbd_dataset_freiburg1_desk --cell-size 0.1 --out run3")]
pub struct Run {
    #[command(flatten)]
    input: Input,
    /// Classes: for a mosaic a grey or indexed image of its size, pixel = class; otherwise
    /// lines x,y,z,class; 255 is ignored
    #[arg(long, value_name = "LABELS")]
    annotations: Option<PathBuf>,
    /// Further classes that are ignored
    #[arg(long, value_name = "CLASS,..", value_delimiter = ',', requires = "annotations")]
    ignore: Vec<u8>,
    /// Edge of a cell in metres, or three edges: x,y,z [default: 1 for words, 0.25 for tum, and otherwise 25 pixels]
    #[arg(long, value_name = "M", value_parser = edges, allow_negative_numbers = true)]
    cell_size: Option<Edges>,
    /// The labels [default: habitats for a mosaic, frames and bags, otherwise topics]
    #[arg(long, value_name = "KIND")]
    labels: Option<Labels>,
    #[command(flatten)]
    parameters: Parameters,
    /// Topics: number of times that each word is resampled after all input has been read [default: 30]
    #[arg(long, value_name = "N", conflicts_with = "refine_rate")]
    sweeps: Option<u32>,
    /// Topics: number of words that are resampled per second of the input's time, while the input is read in order of time
    #[arg(long, value_name = "WORDS_PER_S", allow_negative_numbers = true)]
    refine_rate: Option<f64>,
    /// Number of threads that sample in parallel
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: u16,
    /// Folder for labels.png and labels.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print JSON at a terminal too
    #[arg(long)]
    json: bool,
}

/// A source with its vocabulary, cells and annotations.
struct Opened {
    source: Box<dyn WordSource>,
    vocabulary: u32,
    cell_m: [f64; 3],
    /// Edge of a cell in pixels; only a mosaic uses it.
    cell_px: f32,
    annotated: Option<Annotated>,
}

impl Run {
    pub fn run(self) -> Result<(), UserError> {
        if self.out.exists() && !self.out.is_dir() {
            return Err(UserError::file(&self.out, "--out takes a folder, and this is a file"));
        }
        let kind = self.kind()?;
        let schedule = self.schedule()?;
        let mut opened = self.open(kind, schedule)?;
        let mut model = None;
        let (map, effort) = match kind {
            Labels::Topics => {
                let model = model.insert(self.model(opened.vocabulary, opened.cell_m)?);
                topics(model, opened.source.as_mut(), schedule)?
            }
            Labels::Habitats => self.habitats(&mut opened)?,
        };
        let notes = opened.source.notes();
        if map.flat.is_empty() {
            let cause = notes.unwrap_or_else(|| "the source gave none".to_owned());
            let what = if kind == Labels::Topics { "words" } else { "cells with enough pixels" };
            return Err(UserError::Input(format!("there are no {what} to label: {cause}")));
        }
        if let Some(notes) = notes {
            errln!("scenecast: {notes}");
        }
        if effort.skipped.skipped_full > 0 {
            errln!("scenecast: {} words of full cells skipped", effort.skipped.skipped_full);
        }
        let (annotated, cell_px) = (opened.annotated, opened.cell_px);
        let mut quality = annotated.map(|annotated| quality(&map, &annotated, cell_px)).transpose()?;
        if quality.take_if(|quality| quality.mutual_information.n == 0).is_some() {
            errln!("scenecast: no cell of the map is annotated, so the labels are not scored");
        }
        let report = RunReport::new(&map, model.as_ref(), &effort, quality.as_ref());
        write(map, &self.out)?;
        print_figures(&report, self.json)
    }

    /// The labels that are wanted. Options that have no effect on them are refused.
    fn kind(&self) -> Result<Labels, UserError> {
        let Which { mosaic, source, .. } = &self.input.which;
        let is_from_above = mosaic.is_some() || source.as_ref().is_some_and(|source| !source.starts_with("tum:"));
        let usual = if is_from_above { Labels::Habitats } else { Labels::Topics };
        let kind = self.labels.unwrap_or(usual);
        let Parameters { alpha, beta, gamma, birth, .. } = &self.parameters;
        let of_topics = [
            ("--sweeps", self.sweeps.is_some()),
            ("--refine-rate", self.refine_rate.is_some()),
            ("--vocabulary", self.input.vocabulary.is_some()),
            ("--alpha", alpha.is_some()),
            ("--beta", beta.is_some()),
            ("--gamma", gamma.is_some()),
            ("--birth", birth.is_some()),
        ];
        match kind {
            Labels::Habitats if !is_from_above => {
                Err(UserError::Input("--labels habitats: they are learnt from a mosaic, frames: or bag:".to_owned()))
            }
            Labels::Habitats => match of_topics.iter().find(|(_, is_given)| *is_given) {
                Some((name, _)) => {
                    let cause = "it has no effect on habitats; add --labels topics";
                    Err(UserError::Input(format!("{name}: {cause}")))
                }
                None => Ok(kind),
            },
            Labels::Topics => Ok(kind),
        }
    }

    fn habitats(&self, opened: &mut Opened) -> Result<(LabelledMap, LearningEffort), UserError> {
        let [x, y, _] = opened.cell_m;
        if x != y {
            return Err(UserError::Input("--cell-size: cells of habitats are square".to_owned()));
        }
        let mut habitats = Habitats::new(self.parameters.max_labels);
        let mut progress = Progress::new("labels");
        let source = opened.source.as_mut();
        let effort = learn_habitats(&mut habitats, source, x, &mut |share| progress.show(share))?;
        Ok((LabelledMap::of_habitats(&habitats, opened.cell_m), effort))
    }

    fn schedule(&self) -> Result<Schedule, UserError> {
        match self.refine_rate {
            None => Ok(Schedule::Sweeps(self.sweeps.unwrap_or(30))),
            Some(_) if self.input.which.mosaic.is_some() => {
                Err(UserError::Input("--refine-rate: a mosaic is seen at one time; use --sweeps".to_owned()))
            }
            Some(rate) if (0.0..=1e9).contains(&rate) => Ok(Schedule::Online(rate)),
            Some(rate) => Err(UserError::Input(format!("--refine-rate {rate}: it takes 0 to 1e9 words a second"))),
        }
    }

    fn open(&self, labels: Labels, schedule: Schedule) -> Result<Opened, UserError> {
        let Which { words, mosaic, source } = &self.input.which;
        if let Some(path) = words {
            return self.open_words(path, schedule);
        }
        if let Some(path) = mosaic {
            return self.open_mosaic(path, labels);
        }
        let (kind, dir) = source.as_deref().and_then(|text| text.split_once(':')).unwrap_or_default();
        let (look, vocabulary) = self.look(labels)?;
        let dir = Path::new(dir);
        let annotated = self.places()?;
        let (source, cell_m): (Box<dyn WordSource>, _) = match (kind, look) {
            ("tum", Look::Words(extractor)) => {
                let scale = self.input.depth_scale;
                if !(1.0..=1e6).contains(&scale) {
                    return Err(UserError::Input(format!(
                        "--depth-scale {scale}: it takes 1 to 1000000 units a metre"
                    )));
                }
                let cell_m = self.cubes(0.25);
                (Box::new(Tum::open(dir, *extractor, self.input.intrinsics, scale, cell_m[0])?), cell_m)
            }
            ("frames", look) => {
                let metres_per_pixel = self.metres_per_pixel()?;
                let cell_m = self.columns(CELL_PX * metres_per_pixel);
                (Box::new(Frames::open((dir, self.input.poses.as_deref()), look, metres_per_pixel, cell_m[0])?), cell_m)
            }
            ("bag", look) => {
                let metres_per_pixel = self.metres_per_pixel()?;
                let cell_m = self.columns(CELL_PX * metres_per_pixel);
                let recording = open_bag(&dir.to_string_lossy(), None, &level_camera())?;
                (Box::new(Frames::of(recording, look, metres_per_pixel, cell_m[0])), cell_m)
            }
            _ => return Err(UserError::Input("--source: it takes tum:DIR, frames:DIR or bag:FILE".to_owned())),
        };
        Ok(Opened { source, vocabulary, cell_m, cell_px: 1.0, annotated })
    }

    fn open_words(&self, path: &Path, schedule: Schedule) -> Result<Opened, UserError> {
        let cell_m = self.cubes(1.0);
        let annotated = self.places()?;
        let in_time = matches!(schedule, Schedule::Online(_));
        let file = WordsFile::open(path, self.input.vocabulary_size, cell_m, in_time)?;
        Ok(Opened { vocabulary: file.vocabulary, source: Box::new(file), cell_m, cell_px: 1.0, annotated })
    }

    fn open_mosaic(&self, path: &Path, labels: Labels) -> Result<Opened, UserError> {
        let metres_per_pixel = self.metres_per_pixel()?;
        let cell_m = self.columns(CELL_PX * metres_per_pixel);
        if cell_m[0] != cell_m[1] {
            return Err(UserError::Input("--cell-size: cells of a mosaic are square".to_owned()));
        }
        let (mut look, vocabulary) = self.look(labels)?;
        let mosaic = Mosaic::open(path, &mut look, metres_per_pixel, cell_m[0])?;
        let read = |labels: &PathBuf| Annotated::of_mosaic(labels, mosaic.size, &self.ignore);
        let annotated = self.annotations.as_ref().map(read).transpose()?;
        let cell_px = mosaic.cell_px;
        Ok(Opened { source: Box::new(mosaic), vocabulary, cell_m, cell_px, annotated })
    }

    fn places(&self) -> Result<Option<Annotated>, UserError> {
        self.annotations.as_ref().map(|path| Annotated::of_places(path, &self.ignore)).transpose()
    }

    /// What is taken from an image, with the number of different words.
    fn look(&self, labels: Labels) -> Result<(Look, u32), UserError> {
        if labels == Labels::Habitats {
            return Ok((Look::Points, 0));
        }
        let extractor = self.extractor()?;
        let vocabulary = extractor.vocabulary_size();
        Ok((Look::Words(Box::new(extractor)), vocabulary))
    }

    fn extractor(&self) -> Result<WordExtractor, UserError> {
        match &self.input.vocabulary {
            Some(path) => Ok(WordExtractor::from_measures(read_vocabulary(path)?)),
            None => Ok(WordExtractor::new(&WordConfig::default())),
        }
    }

    fn metres_per_pixel(&self) -> Result<f64, UserError> {
        let metres = self.input.metres_per_pixel.unwrap_or(0.01);
        if (1e-6..=1e3).contains(&metres) {
            return Ok(metres);
        }
        Err(UserError::Input(format!("--metres-per-pixel {metres}: it takes metres from 0.000001 to 1000")))
    }

    /// Edges of cells in three dimensions, metres.
    fn cubes(&self, usual: f64) -> [f64; 3] {
        let edges = self.cell_size.unwrap_or(Edges { x: usual, y: usual, z: None });
        [edges.x, edges.y, edges.z.unwrap_or(edges.x)]
    }

    /// Edges of the cells of a flat world, metres.
    fn columns(&self, usual: f64) -> [f64; 3] {
        let edges = self.cell_size.unwrap_or(Edges { x: usual, y: usual, z: None });
        [edges.x, edges.y, edges.z.unwrap_or(FLAT_M)]
    }

    fn model(&self, vocabulary: u32, cell_m: [f64; 3]) -> Result<SceneModel, UserError> {
        let birth = match self.parameters.birth.as_deref() {
            Some("collapsed") => Birth::Collapsed,
            Some("rost") => Birth::Rost,
            _ => Birth::Literal,
        };
        let Parameters { alpha, beta, gamma, max_labels, seed, .. } = self.parameters;
        let (alpha, beta, gamma) = (alpha.unwrap_or(0.01), beta.unwrap_or(0.1), gamma.unwrap_or(1e-4));
        let max_words_per_cell = u32::from(u16::MAX);
        let usual = if self.input.which.words.is_some() { SceneConfig::default() } else { SceneConfig::for_images() };
        let config = SceneConfig {
            cell_m,
            alpha,
            beta,
            gamma,
            birth,
            max_labels,
            vocabulary,
            max_words_per_cell,
            seed,
            ..usual
        };
        let flag = |key: &str| format!("--{}", key.replace('_', "-"));
        let refused =
            |e: scene_model::topics::ConfigError| format!("{} {}: allowed is {}", flag(e.key), e.value, e.allowed);
        let mut model = SceneModel::new(config).map_err(|e| UserError::Input(refused(e)))?;
        model.use_threads(usize::from(self.threads));
        Ok(model)
    }
}

fn topics(
    model: &mut SceneModel,
    source: &mut dyn WordSource,
    schedule: Schedule,
) -> Result<(LabelledMap, LearningEffort), UserError> {
    let mut progress = Progress::new("labels");
    let effort = learn(model, source, schedule, &mut |share| progress.show(share))?;
    Ok((LabelledMap::of_topics(model), effort))
}
