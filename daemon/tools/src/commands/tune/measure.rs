//! Measurement of one setting: the quality of its map and the bytes of its stream.

use super::survey::Survey;
use crate::scene::FrameContent;
use scene_model::habitats::Habitats;
use scene_model::online::OnlineInference;
use scene_model::project::Observation;
use scene_model::publish::LabelBook;
use scene_model::topics::{FlatCell, SceneModel};
use scenecast_core::UserError;
use scenecast_core::tuning_table::{Measurement, Setting};
use scenecast_protocol::directive::CellBand;
use scenecast_protocol::map::{self, Cell};
use scenecast_protocol::map_codec::{Stride, encode_all};
use scenecast_worlds::scoring::{LabelGrid, score};
use std::collections::{BTreeMap, BTreeSet};

/// What gives the cells of a survey their labels.
enum Labeller {
    Topics(Box<Topics>),
    Habitats(Box<Habitats>),
}

struct Topics {
    model: SceneModel,
    online: OnlineInference,
    /// Words that were resampled so far.
    refined: u64,
}

impl Labeller {
    fn new(survey: &Survey<'_>, setting: &Setting, seed: u64) -> Result<Self, UserError> {
        if setting.is_of_habitats() {
            return Ok(Self::Habitats(Box::new(Habitats::new(setting.max_labels))));
        }
        let model = SceneModel::new(survey.scene(setting, seed)).map_err(|e| UserError::Input(format!("scene.{e}")))?;
        Ok(Self::Topics(Box::new(Topics { model, online: OnlineInference::default(), refined: 0 })))
    }

    /// Takes the frame `index`, which lies at these places.
    fn see(
        &mut self,
        survey: &Survey<'_>,
        setting: &Setting,
        index: usize,
        content: &FrameContent,
        places: &[Observation],
    ) {
        match (self, content) {
            (Self::Topics(topics), FrameContent::Words(_)) => {
                let Topics { model, online, refined } = &mut **topics;
                online.expect(places.len(), model);
                model.insert(index as f64 * survey.step_s, places);
                let words = (setting.refine_words_per_s * survey.step_s * (index + 1) as f64) as u64;
                model.refine(words - std::mem::replace(refined, words));
            }
            (Self::Habitats(habitats), FrameContent::Points(points)) => {
                habitats.add(survey.size, points, places, setting.cell_m);
                habitats.update();
            }
            // A survey has the content that its labels are made of.
            _ => {}
        }
    }

    /// The map at mission time `t_s`, seconds.
    fn map(&mut self, t_s: f64) -> Vec<FlatCell> {
        match self {
            Self::Topics(topics) => topics.online.learn(t_s, &topics.model),
            Self::Habitats(habitats) => habitats.map(),
        }
    }

    /// The map after the survey: of topics after sweeps over all words.
    fn final_map(&mut self, sweeps: u32) -> Vec<FlatCell> {
        match self {
            Self::Topics(topics) => {
                topics.model.limit_labels(usize::MAX);
                topics.model.sweep(sweeps);
                topics.model.label_map()
            }
            Self::Habitats(habitats) => habitats.map(),
        }
    }
}

/// Runs the survey with a setting; topics then sweep over all words. Gives the figures, and the map at the end as it is sent.
pub fn measure(
    survey: &Survey<'_>,
    setting: &Setting,
    sweeps: u32,
    seed: u64,
) -> Result<(Measurement, map::LabelGrid), UserError> {
    let config = survey.config;
    let codec = config.map.codec;
    let room = config.link.frame_bytes as usize;
    let bytes = |base: &map::LabelGrid, target: &map::LabelGrid| {
        let chunks = encode_all(codec, base, target, room);
        let chunks = chunks.ok_or_else(|| UserError::Input(format!("link.frame_bytes = {room} holds no cell")))?;
        Ok::<usize, UserError>(chunks.iter().map(|chunk| chunk.bytes.len()).sum())
    };
    let mut labeller = Labeller::new(survey, setting, seed)?;
    let mut book = LabelBook::new(0);
    let (mut sent, mut streamed) = (map::LabelGrid::default(), 0);
    let is_coarse = setting.cells == CellBand::Coarse;
    let interval = |index: usize| (index as f64 * survey.step_s * setting.frames_per_s + 1e-6).floor();
    let mut last = None;
    // A label is given when it has lasted for two maps, so the last map is published again after the last frame.
    for (index, seen) in survey.frames().map(Some).chain([None]).enumerate() {
        if let Some((content, places)) = seen {
            // As on the vehicle: of each interval of the frame rate only the first frame is used; its refinement also
            // covers the skipped ones.
            if last.is_some_and(|last| interval(last) == interval(index)) {
                continue;
            }
            last = Some(index);
            labeller.see(survey, setting, index, content, &places);
        }
        let epoch = book.epoch();
        let published = book.publish(&labeller.map(index as f64 * survey.step_s));
        if book.epoch() != epoch {
            sent = map::LabelGrid::default();
        }
        let target = sent_cells(published.iter().map(|cell| (Cell::new(cell.x, cell.y), cell.label)), is_coarse);
        streamed += bytes(&sent, &target)?;
        sent = target;
    }
    let map = labeller.final_map(sweeps);
    let cells = if is_coarse { blocks(&map) } else { map.clone() };
    let (columns, rows) = survey.annotations.size();
    let labels = LabelGrid::from_map(&cells, 0, -1, columns, rows);
    let scored = score(&labels, &survey.annotations);
    let whole = sent_cells(numbered(&map), is_coarse);
    let measurement = Measurement {
        mutual_information_nats: scored.mutual_information.nats,
        normalised_mutual_information: scored.mutual_information.normalised,
        null_mutual_information_nats: scored.null_nats,
        mosaic_mutual_information_nats: score(&labels, &survey.colours).mutual_information.nats,
        labels: scored.labels,
        map_bytes: bytes(&map::LabelGrid::default(), &whole)?,
        stream_bps: streamed as f64 * 8.0 / survey.duration_s(),
    };
    Ok((measurement, whole))
}

/// The cells that are sent. Coarse cells are sent as a map of their own, so that their chunks have no finer neighbours.
fn sent_cells(cells: impl Iterator<Item = (Cell, u8)>, is_coarse: bool) -> map::LabelGrid {
    let stride = if is_coarse { Stride::Four } else { Stride::One };
    cells.filter_map(|(cell, label)| Some((stride.on_lattice(cell)?, label))).collect()
}

/// The operator's map of coarse cells: each fills the block of which it is the south-west corner.
fn blocks(map: &[FlatCell]) -> Vec<FlatCell> {
    let side = Stride::Four.cells();
    let corners: BTreeMap<(i32, i32), FlatCell> = map.iter().map(|cell| ((cell.x, cell.y), *cell)).collect();
    let corner = |cell: &FlatCell| corners.get(&(cell.x.div_euclid(side) * side, cell.y.div_euclid(side) * side));
    map.iter().filter_map(|cell| Some(FlatCell { topic: corner(cell)?.topic, ..*cell })).collect()
}

/// The mean of the measurements at several sites.
pub fn mean(of: &[Measurement]) -> Measurement {
    let n = of.len().max(1) as f64;
    let mean = |value: fn(&Measurement) -> f64| of.iter().map(value).sum::<f64>() / n;
    Measurement {
        mutual_information_nats: mean(|m| m.mutual_information_nats),
        normalised_mutual_information: mean(|m| m.normalised_mutual_information),
        null_mutual_information_nats: mean(|m| m.null_mutual_information_nats),
        mosaic_mutual_information_nats: mean(|m| m.mosaic_mutual_information_nats),
        labels: mean(|m| m.labels as f64).round() as usize,
        map_bytes: mean(|m| m.map_bytes as f64).round() as usize,
        stream_bps: mean(|m| m.stream_bps),
    }
}

/// The map with labels from 1 on, oldest topic first.
fn numbered(cells: &[FlatCell]) -> impl Iterator<Item = (Cell, u8)> {
    let topics: Vec<_> = cells.iter().map(|cell| cell.topic).collect::<BTreeSet<_>>().into_iter().collect();
    let label = move |cell: &FlatCell| topics.binary_search(&cell.topic).map_or(0, |index| (index + 1).min(254) as u8);
    cells.iter().map(move |cell| (Cell::new(cell.x, cell.y), label(cell)))
}
