//! What a setting reaches and what its map takes.

use super::grid::Setting;
use super::survey::Survey;
use crate::problem::Problem;
use scene_model::publish::LabelBook;
use scene_model::score::{LabelGrid, score};
use scene_model::topics::{FlatCell, SceneModel};
use scenecast_protocol::map::{self, Cell};
use scenecast_protocol::map_codec::{Codec, encode_all};
use std::collections::BTreeSet;

/// The figures of one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Measurement {
    /// Of map labels and annotated classes, nats.
    pub(super) mutual_information_nats: f64,
    /// Divided by the geometric mean of both entropies.
    pub(super) normalised_mutual_information: f64,
    /// Mean of the map flipped and shifted, nats.
    pub(super) null_mutual_information_nats: f64,
    /// Of map labels and the mosaic's colours, nats.
    pub(super) mosaic_mutual_information_nats: f64,
    /// Different labels in the final map.
    pub(super) labels: usize,
    /// Bytes of all chunks that say the final map from nothing.
    pub(super) map_bytes: usize,
    /// Bits of all chunks of the survey over its time.
    pub(super) stream_bps: f64,
}

/// Flies the survey with a setting, then sweeps over all words.
pub(super) fn measure(survey: &Survey<'_>, setting: &Setting, sweeps: u32, seed: u64) -> Result<Measurement, Problem> {
    let config = survey.config;
    let codec: Codec = config.map.codec.parse().map_err(|_| Problem::Input("map.codec is unknown".to_owned()))?;
    let room = config.link.frame_bytes as usize;
    let bytes = |base: &map::LabelGrid, target: &map::LabelGrid| {
        let chunks = encode_all(codec, base, target, room);
        let chunks = chunks.ok_or_else(|| Problem::Input(format!("link.frame_bytes = {room} holds no cell")))?;
        Ok::<usize, Problem>(chunks.iter().map(|chunk| chunk.bytes.len()).sum())
    };
    let mut model = SceneModel::new(survey.scene(setting, seed)).map_err(|e| Problem::Input(format!("scene.{e}")))?;
    let (mut book, mut sent, mut streamed) = (LabelBook::new(0), map::LabelGrid::default(), 0);
    let words = (f64::from(config.scene.refine_words_per_s) * survey.step_s) as u64;
    // A label has its id when it has lasted for two maps, so the last map is told once more after the last frame.
    for (index, seen) in survey.frames().map(Some).chain([None]).enumerate() {
        if let Some(seen) = seen {
            model.insert(index as f64 * survey.step_s, &seen);
            model.refine(words);
        }
        let epoch = book.epoch();
        let published = book.publish(&model.label_map());
        if book.epoch() != epoch {
            sent = map::LabelGrid::default();
        }
        let target = published.iter().map(|cell| (Cell::new(cell.x, cell.y), cell.label)).collect();
        streamed += bytes(&sent, &target)?;
        sent = target;
    }
    model.sweep(sweeps);
    let cells = model.label_map();
    let (columns, rows) = survey.annotations.size();
    let labels = LabelGrid::from_map(&cells, 0, -1, columns, rows);
    let told = score(&labels, &survey.annotations);
    Ok(Measurement {
        mutual_information_nats: told.mutual_information.nats,
        normalised_mutual_information: told.mutual_information.normalised,
        null_mutual_information_nats: told.null_nats,
        mosaic_mutual_information_nats: score(&labels, &survey.colours).mutual_information.nats,
        labels: told.labels,
        map_bytes: bytes(&map::LabelGrid::default(), &numbered(&cells))?,
        stream_bps: streamed as f64 * 8.0 / survey.duration_s(),
    })
}

/// The map with labels from 1 on, oldest topic first.
fn numbered(cells: &[FlatCell]) -> map::LabelGrid {
    let topics: Vec<_> = cells.iter().map(|cell| cell.topic).collect::<BTreeSet<_>>().into_iter().collect();
    let label = |cell: &FlatCell| topics.binary_search(&cell.topic).map_or(0, |index| (index + 1).min(254) as u8);
    cells.iter().map(|cell| (Cell::new(cell.x, cell.y), label(cell))).collect()
}
