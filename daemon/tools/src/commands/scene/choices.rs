//! The choices of an operator, compared on annotated images: the defaults, more labels, and an annotated vocabulary.

use super::scenes::Scenes;
use crate::annotated_images::{AnnotatedCells, AnnotatedImage, Pair};
use scene_model::words::{Discriminant, WordConfig, WordExtractor};
use scenecast_config::Config;
use scenecast_core::{UserError, outln};
use scenecast_protocol::map::{Cell, LabelGrid as CodedGrid};
use scenecast_protocol::map_codec::encode_all;
use scenecast_worlds::scoring::{AnnotatedScene, ClassStatistics, LabelGrid, Method, Trial, median, score};
use serde::Serialize;

/// A choice: the number of labels, and whether the words include those learnt from the other images' annotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Choice {
    labels: u32,
    annotated: bool,
}

/// The scores of all choices on all scenes, with the settings.
#[derive(Debug, Serialize)]
pub struct ChoicesReport {
    cells_across: u32,
    sweeps: u32,
    seeds: u64,
    ignored_classes: Vec<u8>,
    scenes: Vec<String>,
    choices: Vec<ChoiceReport>,
}

/// Values of a choice; each value of a scene is the mean over the seeds.
#[derive(Debug, Serialize)]
struct ChoiceReport {
    max_labels: u32,
    /// `built-in`, or `annotated`: with words learnt from the annotations of all other images.
    vocabulary: &'static str,
    mutual_information_median_nats: f64,
    mutual_information_mean_nats: f64,
    excess_median_nats: f64,
    excess_mean_nats: f64,
    /// Standard deviation over the seeds of the mean over the scenes; 0 with one seed.
    excess_seed_deviation_nats: f64,
    /// Of a whole map, mean over the scenes.
    map_bits: f64,
    excess_nats: Vec<f64>,
}

/// The values of a scene under a choice, for each seed.
struct Row {
    mutual_information_nats: f64,
    excess_nats: f64,
    map_bits: f64,
}

/// Compares the choices on all images of a folder.
pub fn compare(trial: Trial, pairs: &[Pair], ignore: &[u8]) -> Result<ChoicesReport, UserError> {
    let choices = choices(trial.labels);
    let scenes = Scenes::new("scenes", pairs, 1 + choices.len());
    let statistics = scenes.each(|_, pair, step| {
        let statistics = of_scene(trial, pair, ignore);
        step();
        statistics
    })?;
    let rows = scenes.each(|index, pair, step| {
        let discriminant = of_others(&statistics, index, pairs)?;
        let of = |choice: &Choice| {
            let extra = choice.annotated.then(|| discriminant.clone());
            let rows = rows(Trial { labels: choice.labels, ..trial }, pair, ignore, extra);
            step();
            rows
        };
        choices.iter().map(of).collect::<Result<Vec<_>, _>>()
    })?;
    let table = |(index, choice): (usize, &Choice)| {
        let of_scenes: Vec<&[Row]> = rows.iter().map(|of_choices| of_choices[index].as_slice()).collect();
        ChoiceReport::new(*choice, &of_scenes)
    };
    Ok(ChoicesReport {
        cells_across: trial.cells_across,
        sweeps: trial.sweeps,
        seeds: trial.seeds,
        ignored_classes: ignore.to_vec(),
        scenes: pairs.iter().map(Pair::name).collect(),
        choices: choices.iter().enumerate().map(table).collect(),
    })
}

/// The given number of labels and twice as many, each with the built-in and with an annotated vocabulary.
fn choices(labels: u32) -> [Choice; 4] {
    let more = (2 * labels).min(254);
    [(labels, false), (more, false), (labels, true), (more, true)]
        .map(|(labels, annotated)| Choice { labels, annotated })
}

fn of_scene(trial: Trial, pair: &Pair, ignore: &[u8]) -> Result<ClassStatistics, UserError> {
    let AnnotatedCells { image, cell_px, annotations } = pair.read_cells(|width| trial.cell_px(width), ignore)?;
    Ok(ClassStatistics::of(&image, cell_px, &annotations))
}

/// The discriminant of all scenes but one.
fn of_others(statistics: &[ClassStatistics], left_out: usize, pairs: &[Pair]) -> Result<Discriminant, UserError> {
    let mut others = ClassStatistics::default();
    for (_, of_scene) in statistics.iter().enumerate().filter(|(index, _)| *index != left_out) {
        others.add(of_scene);
    }
    others.discriminant().map_err(|e| UserError::Failed(format!("without the image {}: {e}", pairs[left_out].name())))
}

fn rows(trial: Trial, pair: &Pair, ignore: &[u8], extra: Option<Discriminant>) -> Result<Vec<Row>, UserError> {
    let AnnotatedImage { image, classes } = pair.read()?;
    let measures = WordExtractor::new(&WordConfig::default()).measures().with_discriminant(extra);
    let extractor = WordExtractor::from_measures(measures);
    let scene = AnnotatedScene::with_words(trial, &image, &classes, ignore, extractor).map_err(|e| pair.refused(e))?;
    let row = |seed: u64| {
        let labels = scene.labels(Method::SceneModel, seed).map_err(|e| pair.refused(e))?;
        let scored = score(&labels, scene.annotations());
        Ok(Row {
            mutual_information_nats: scored.mutual_information.nats,
            excess_nats: scored.excess_nats,
            map_bits: map_bits(&labels)?,
        })
    };
    (1..=trial.seeds).map(row).collect()
}

/// The bits of all chunks of a map, with the default coder and frame size.
fn map_bits(labels: &LabelGrid) -> Result<f64, UserError> {
    let Config { map, link, .. } = Config::default();
    let mut topics: Vec<u32> = labels.labels.iter().copied().flatten().collect();
    topics.sort_unstable();
    topics.dedup();
    let cell = |(index, topic): (usize, &Option<u32>)| {
        let label = topics.binary_search(&(*topic)?).ok()?;
        let (x, y) = (index % labels.columns, index / labels.columns);
        Some((Cell::new(x as i32, -(y as i32)), (label + 1).min(254) as u8))
    };
    let target: CodedGrid = labels.labels.iter().enumerate().filter_map(cell).collect();
    let chunks = encode_all(map.codec, &CodedGrid::default(), &target, link.frame_bytes as usize);
    let chunks = chunks.ok_or_else(|| UserError::Failed("a frame of the default size holds no cell".to_owned()))?;
    Ok(8.0 * chunks.iter().map(|chunk| chunk.bytes.len() as f64).sum::<f64>())
}

impl ChoiceReport {
    fn new(choice: Choice, scenes: &[&[Row]]) -> Self {
        let of_scenes =
            |value: fn(&Row) -> f64| -> Vec<f64> { scenes.iter().map(|rows| mean(rows.iter().map(value))).collect() };
        let excess = of_scenes(|row| row.excess_nats);
        let information = of_scenes(|row| row.mutual_information_nats);
        let seeds = scenes.first().map_or(0, |rows| rows.len());
        let of_seeds: Vec<f64> =
            (0..seeds).map(|seed| mean(scenes.iter().map(|rows| rows[seed].excess_nats))).collect();
        Self {
            max_labels: choice.labels,
            vocabulary: if choice.annotated { "annotated" } else { "built-in" },
            mutual_information_median_nats: median(&information),
            mutual_information_mean_nats: mean(information.iter().copied()),
            excess_median_nats: median(&excess),
            excess_mean_nats: mean(excess.iter().copied()),
            excess_seed_deviation_nats: deviation(&of_seeds),
            map_bits: mean(of_scenes(|row| row.map_bits).into_iter()),
            excess_nats: excess,
        }
    }
}

impl ChoicesReport {
    pub fn print(&self) {
        let Self { sweeps, seeds, scenes, .. } = self;
        outln!("{} scenes, {sweeps} sweeps, {seeds} seeds, nats: median / mean over the scenes", scenes.len());
        let header = ["K", "vocabulary", "MI", "excess", "one seed +-", "bits of a map"];
        let [k, words, information, excess, deviation, bits] = header;
        outln!("{k:>3}  {words:<10}  {information:>13}  {excess:>13}  {deviation:>11}  {bits:>13}");
        for choice in &self.choices {
            let information = pair(choice.mutual_information_median_nats, choice.mutual_information_mean_nats);
            let excess = pair(choice.excess_median_nats, choice.excess_mean_nats);
            let ChoiceReport { max_labels, vocabulary, excess_seed_deviation_nats: deviation, map_bits, .. } = choice;
            outln!(
                "{max_labels:>3}  {vocabulary:<10}  {information:>13}  {excess:>13}  {deviation:>11.3}  {map_bits:>13.0}"
            );
        }
    }
}

fn pair(median: f64, mean: f64) -> String {
    format!("{median:.3} / {mean:.3}")
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// The standard deviation of a sample; 0 for fewer than two values.
fn deviation(values: &[f64]) -> f64 {
    let centre = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    (squares / (values.len().max(2) - 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_median_mean_and_the_spread_of_seeds() {
        let row = |excess_nats| Row { mutual_information_nats: 2.0 * excess_nats, excess_nats, map_bits: 100.0 };
        let scenes = [[row(0.0), row(0.2)], [row(0.3), row(0.5)], [row(0.1), row(0.1)]];
        let scenes: Vec<&[Row]> = scenes.iter().map(<[Row; 2]>::as_slice).collect();
        let report = ChoiceReport::new(Choice { labels: 16, annotated: true }, &scenes);
        assert_eq!((report.max_labels, report.vocabulary), (16, "annotated"));
        assert!((report.excess_median_nats - 0.1).abs() < 1e-9 && (report.excess_mean_nats - 0.2).abs() < 1e-9);
        assert!((report.mutual_information_mean_nats - 0.4).abs() < 1e-9);
        // The means over the scenes are 0.4 / 3 and 0.8 / 3.
        assert!((report.excess_seed_deviation_nats - 0.4 / 3.0 / 2f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn every_choice_is_scored_on_every_image() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-choices", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        for seed in 1..4 {
            let world = scenecast_worlds::patches(seed, 240, 160, 60, 4);
            world.image.save(dir.join(format!("{seed}.png"))).unwrap();
            let classes = image::GrayImage::from_raw(240, 160, world.truth).unwrap();
            classes.save(dir.join(format!("{seed}_label.png"))).unwrap();
        }
        let trial = Trial { labels: 4, cells_across: 20, sweeps: 5, seeds: 2 };
        let report = compare(trial, &crate::annotated_images::pairs(&dir).unwrap(), &[255]).unwrap();
        let rows: Vec<_> = report.choices.iter().map(|choice| (choice.max_labels, choice.vocabulary)).collect();
        assert_eq!(rows, [(4, "built-in"), (8, "built-in"), (4, "annotated"), (8, "annotated")]);
        assert!(report.choices.iter().all(|choice| choice.excess_nats.len() == 3 && choice.excess_mean_nats > 0.1));
        assert!(report.choices[0].excess_nats != report.choices[2].excess_nats);
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn a_uniform_map_takes_fewer_bits_than_a_mixed_one() {
        let map = |label: fn(usize) -> u32| LabelGrid {
            columns: 40,
            rows: 30,
            labels: (0..1200).map(|index| Some(label(index))).collect(),
        };
        let (uniform, mixed) = (map(|_| 70_000), map(|index| (index * index % 7) as u32));
        assert!(map_bits(&uniform).unwrap() > 0.0);
        assert!(map_bits(&uniform).unwrap() < map_bits(&mixed).unwrap());
    }
}
