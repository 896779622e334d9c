//! The report of a run of the scene model, and its labels in files and images.

use super::extent::around;
use super::learn::LearningEffort;
use super::usage::peak_rss_bytes;
use super::{LabelledMap, Quality};
use scene_model::topics::{FlatCell, SceneModel, TopicId, centre_of};
use scenecast_core::UserError;
use scenecast_core::label_picture::encode_within;
use scenecast_files::write_whole;
use scenecast_protocol::map::{Cell, LabelGrid};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Measurements of a run, printed as one line of JSON.
#[derive(Debug, Serialize)]
pub(crate) struct RunReport {
    words: Option<u64>,
    cells: usize,
    resampled: Option<u64>,
    seconds: f64,
    cpu_seconds: f64,
    words_per_cpu_second: Option<f64>,
    labels: usize,
    labels_used: usize,
    perplexity: Option<f64>,
    #[serde(flatten)]
    agreement: Agreement,
    peak_rss_bytes: u64,
    kernel: Option<&'static str>,
}

impl RunReport {
    /// `topics` is the model of topics; habitats have none.
    pub(crate) fn new(
        map: &LabelledMap,
        topics: Option<&SceneModel>,
        effort: &LearningEffort,
        quality: Option<&Quality>,
    ) -> Self {
        let used = numbers(&map.volume).len();
        let speed = effort.resampled as f64 / effort.cpu_seconds.max(1e-6);
        Self {
            words: topics.map(SceneModel::words),
            cells: topics.map_or(map.flat.len(), SceneModel::cells),
            resampled: topics.map(|_| effort.resampled),
            seconds: effort.seconds,
            cpu_seconds: effort.cpu_seconds,
            words_per_cpu_second: topics.map(|_| speed),
            labels: topics.map_or(used, SceneModel::labels),
            labels_used: used,
            perplexity: topics.map(SceneModel::perplexity),
            agreement: Agreement::of(quality),
            peak_rss_bytes: peak_rss_bytes(),
            kernel: topics.map(|model| model.kernel().name()),
        }
    }
}

/// The agreement of the labels with the annotations; each `None` where nothing is annotated.
#[derive(Debug, Serialize)]
struct Agreement {
    mutual_information_nats: Option<f64>,
    normalised_mutual_information: Option<f64>,
    homogeneity: Option<f64>,
    completeness: Option<f64>,
    v_measure: Option<f64>,
    /// The mutual information of labels that are as good as chance.
    null_mutual_information_nats: Option<f64>,
}

impl Agreement {
    fn of(quality: Option<&Quality>) -> Self {
        let information = quality.map(|q| &q.mutual_information);
        Self {
            mutual_information_nats: information.map(|i| i.nats),
            normalised_mutual_information: information.map(|i| i.normalised),
            homogeneity: information.map(|i| i.homogeneity()),
            completeness: information.map(|i| i.completeness()),
            v_measure: information.map(|i| i.v_measure()),
            null_mutual_information_nats: quality.map(|q| q.null_nats),
        }
    }
}

/// The topics of a map, oldest first: the first has the label 1.
fn numbers(volume: &[FlatCell]) -> Vec<TopicId> {
    let mut topics: Vec<TopicId> = volume.iter().map(|cell| cell.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    topics
}

/// Writes `labels.png`, the flattened map, and `labels.csv`, every cell in three dimensions sorted by y and x. Of
/// stacked cells, the one in the flattened map comes last.
pub(crate) fn write(labelled: LabelledMap, dir: &Path) -> Result<(), UserError> {
    let LabelledMap { flat: map, mut volume, cell_m } = labelled;
    // Rows painted in this order give the flattened map.
    let shows =
        |cell: &FlatCell| map.binary_search_by_key(&(cell.y, cell.x), |c| (c.y, c.x)).is_ok_and(|i| map[i].z == cell.z);
    volume.sort_by_cached_key(|cell| (cell.y, cell.x, shows(cell)));
    let topics = numbers(&volume);
    let label = |topic| topics.binary_search(&topic).map_or(0, |index| (index + 1).min(254)) as u8;
    let bounds = around(&map)?;
    let grid: LabelGrid = map.iter().map(|cell| (Cell::new(cell.x, cell.y), label(cell.topic))).collect();
    let png = encode_within(&grid, bounds).map_err(UserError::failed)?;
    let mut table = "x,y,z,label,confidence,perplexity\n".to_owned();
    for cell in &volume {
        let [x, y, z] = centre_of([cell.x, cell.y, cell.z], cell_m);
        let (label, FlatCell { confidence, perplexity, .. }) = (label(cell.topic), cell);
        let _ = writeln!(table, "{x:.6},{y:.6},{z:.6},{label},{confidence:.4},{perplexity:.4}");
    }
    std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
    write_whole(&dir.join("labels.csv"), table.as_bytes())?;
    write_whole(&dir.join("labels.png"), &png)
}
