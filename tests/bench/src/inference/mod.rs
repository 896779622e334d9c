//! Inference under way against a batch over the same frames: information of the map, its bytes, its changes.

mod command;

pub(crate) use command::InferenceBench;

use crate::cpu_meter::CpuMeter;
use crate::registration::navigate_perfectly;
use scene_model::topics::{ConfigError, FlatCell, SceneConfig, SceneModel, TopicId};
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::schedule::Class;
use scenecast_rehearsal::{Mission, MissionOptions, World};
use serde::Serialize;
use std::time::Duration;

/// Sweeps between two looks at the convergence of a batch.
const ROUND: u32 = 10;
const MAX_SWEEPS: u32 = 300;
/// A batch has converged when a round lowers its perplexity by less than this part of it.
const CONVERGED: f64 = 1e-3;

/// One mission of the comparison. Information is over the survey's area, unexplored being a label of its own, nats;
/// `None` without annotation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InferenceRow {
    pub scene: String,
    pub seed: u64,
    /// The name of the configuration.
    pub setting: String,
    /// Information of the vehicle's published map at the end of the survey.
    pub online_nats: Option<f64>,
    /// Information of the operator's map at that moment.
    pub operator_nats: Option<f64>,
    /// Information of a fresh model with the same seed and the same words, swept until it has converged.
    pub batch_nats: Option<f64>,
    /// Sweeps until the batch had converged.
    pub sweeps: u32,
    /// Bytes of the map that the vehicle put on air.
    pub map_bytes: u64,
    /// Explored cells of the vehicle's map.
    pub cells: usize,
    /// Changes of the label of a cell that had one on the vehicle's published map.
    pub flips: u64,
    /// The part of one core that refinement takes, 0..=1, measured with the model as it is at the end.
    pub refinement_cpu: f64,
}

/// Means over all scenes and seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InferenceSummary {
    pub setting: String,
    pub online_nats: Option<f64>,
    pub batch_nats: Option<f64>,
    /// The mean information of the vehicle's and of the operator's map, divided by that of the batch.
    pub online_share: Option<f64>,
    pub operator_share: Option<f64>,
    pub map_bytes: f64,
    pub flips: f64,
    pub refinement_cpu: f64,
}

/// Flies the same survey over each scene with each configuration, with perfect navigation and without registration.
pub fn measure_inference(
    settings: &[(String, Config)],
    scenes: &[(String, World)],
    (first, count): (u64, u64),
    progress: &mut dyn FnMut(&InferenceRow),
) -> Result<Vec<InferenceRow>, UserError> {
    let mut rows = Vec::new();
    for (scene, world) in scenes {
        for seed in first..first + count {
            let mut batch = None;
            for (setting, config) in settings {
                let mission = fly(config, world, seed)?;
                let row = measure((scene, seed, setting), &mission, &mut batch)?;
                progress(&row);
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

fn fly(config: &Config, world: &World, seed: u64) -> Result<Mission, UserError> {
    let mut config = config.clone();
    navigate_perfectly(&mut config);
    let mut mission = Mission::new(config, MissionOptions { world: world.clone(), seed, record: None })?;
    mission.run(Duration::ZERO, &mut |_| Ok(()))?;
    Ok(mission)
}

fn measure(
    (scene, seed, setting): (&str, u64, &str),
    mission: &Mission,
    batch: &mut Option<Batch>,
) -> Result<InferenceRow, UserError> {
    let model = mission.mapper().model();
    if batch.as_ref().is_none_or(|last| !last.is_of(model)) {
        *batch = Some(Batch::new(model).map_err(UserError::failed)?);
    }
    let nats = |map: &LabelGrid| mission.map_information(map).map(|information| information.rigid_nats);
    Ok(InferenceRow {
        scene: scene.to_owned(),
        seed,
        setting: setting.to_owned(),
        online_nats: nats(mission.vehicle().map()),
        operator_nats: nats(&mission.operator_map()),
        batch_nats: batch.as_ref().and_then(|batch| nats(&batch.map)),
        sweeps: batch.as_ref().map_or(0, |batch| batch.sweeps),
        map_bytes: mission.vehicle().stats().bytes_by_class.get(&Class::Map).copied().unwrap_or(0),
        cells: mission.vehicle().map().explored(),
        flips: mission.flips(),
        refinement_cpu: refinement_cpu(mission)?,
    })
}

/// Seconds of CPU time for a second of mission.
fn refinement_cpu(mission: &Mission) -> Result<f64, UserError> {
    let words = u64::from(mission.config().scene.refine_words_per_s);
    let copy = SceneModel::load(&mission.mapper().model().save());
    let mut model = copy.map_err(|e| UserError::Failed(format!("a copy of the scene model: {e}")))?;
    let start = CpuMeter::start();
    model.refine(words);
    Ok(start.ms() / 1000.0)
}

/// A fresh model with the words of another one, swept until it has converged.
struct Batch {
    config: SceneConfig,
    words: u64,
    map: LabelGrid,
    sweeps: u32,
}

impl Batch {
    fn new(of: &SceneModel) -> Result<Self, ConfigError> {
        let config = of.config().clone();
        let mut model = SceneModel::new(config.clone())?;
        model.insert(0.0, &of.observations().collect::<Vec<_>>());
        let mut sweeps = 0;
        let mut perplexity = f64::INFINITY;
        while sweeps < MAX_SWEEPS {
            model.sweep(ROUND);
            sweeps += ROUND;
            let before = std::mem::replace(&mut perplexity, model.perplexity());
            if perplexity > before * (1.0 - CONVERGED) {
                break;
            }
        }
        Ok(Self { config, words: of.words(), map: grid(&model.label_map()), sweeps })
    }

    /// Whether a batch over the words of `model` would be this one: navigation is perfect, so the survey's frames are
    /// the same with every setting.
    fn is_of(&self, model: &SceneModel) -> bool {
        self.config == *model.config() && self.words == model.words()
    }
}

/// A map with its topics numbered from 1 in the order of their births.
fn grid(cells: &[FlatCell]) -> LabelGrid {
    let mut topics: Vec<TopicId> = cells.iter().map(|cell| cell.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    let label = |topic| topics.binary_search(&topic).map_or(0, |index| (index + 1).min(254) as u8);
    cells.iter().map(|cell| (Cell::new(cell.x, cell.y), label(cell.topic))).collect()
}

/// The means of each setting, in the order of the rows.
pub fn summarise(rows: &[InferenceRow]) -> Vec<InferenceSummary> {
    let mut settings: Vec<&str> = Vec::new();
    for row in rows {
        if !settings.contains(&row.setting.as_str()) {
            settings.push(&row.setting);
        }
    }
    let of_setting = |setting: &str| {
        let rows: Vec<&InferenceRow> = rows.iter().filter(|row| row.setting == setting).collect();
        let mean = |value: fn(&InferenceRow) -> Option<f64>| {
            let values: Option<Vec<f64>> = rows.iter().map(|row| value(row)).collect();
            values.map(|values| values.iter().sum::<f64>() / values.len() as f64)
        };
        let batch_nats = mean(|row| row.batch_nats);
        let share = |nats: Option<f64>| Some(nats? / batch_nats.filter(|nats| *nats > 0.0)?);
        let online_nats = mean(|row| row.online_nats);
        InferenceSummary {
            setting: setting.to_owned(),
            online_nats,
            batch_nats,
            online_share: share(online_nats),
            operator_share: share(mean(|row| row.operator_nats)),
            map_bytes: mean(|row| Some(row.map_bytes as f64)).unwrap_or(0.0),
            flips: mean(|row| Some(row.flips as f64)).unwrap_or(0.0),
            refinement_cpu: mean(|row| Some(row.refinement_cpu)).unwrap_or(0.0),
        }
    };
    settings.into_iter().map(of_setting).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_refinement_brings_the_online_map_to_the_batch() {
        let setting = |words_per_s: u32| {
            let sets = [
                "survey.duration_s=120",
                "camera.width_px=320",
                "camera.height_px=240",
                "operator.script=none",
                "scene.labels=topics",
            ];
            let words = format!("scene.refine_words_per_s={words_per_s}");
            let sets: Vec<String> = sets.into_iter().map(str::to_owned).chain([words.clone()]).collect();
            (words, scenecast_config::load(None, &sets).unwrap())
        };
        let scenes = [("patches".to_owned(), World::patches(5, 0.01))];
        let settings = [setting(200), setting(100_000)];
        let rows = measure_inference(&settings, &scenes, (1, 1), &mut |_| {}).unwrap();
        let means = summarise(&rows);
        assert!(means[1].online_share.unwrap() > means[0].online_share.unwrap(), "{means:?}");
        // Labels grow with the words, of which so small a camera sees few.
        assert!(means[1].online_share.unwrap() > 0.5, "{means:?}");
        assert!(rows.iter().all(|row| row.sweeps >= 20 && row.map_bytes > 100 && row.cells > 500), "{rows:?}");
        assert_eq!(rows[0].batch_nats, rows[1].batch_nats, "the frames are the same");
    }
}
