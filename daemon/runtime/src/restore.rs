//! The scene model at the start of a run, restored from the last checkpoint.

use super::checkpoint::{CheckpointFile, Keep};
use super::durable::{FirstStart, Keeper, StartedRun};
use super::journal::Folder;
use super::labels;
use scenecast_config::{Config, LabelSource};
use scenecast_core::UserError;
use scenecast_files::configured_vocabulary;
use scenecast_vehicle::{Durable, ForeignMap, MapProducer, Mapper, RestoreError, Restored};
use std::path::Path;

/// The state at the start of a run.
pub(super) struct Start {
    pub(super) run: StartedRun<Folder>,
    pub(super) mapper: Mapper,
    pub(super) keep: Keep,
    /// The labels of another program, in place of the scene model's, or its bands.
    pub(super) labels: Option<(ForeignMap, Keep)>,
}

/// Begins a run in the folder of its state.
///
/// An unusable checkpoint loses the learnt map, but no label changes its meaning, because a new epoch begins. It is
/// logged as an error, and the mission starts.
pub(super) fn start(config: &Config, dir: &Path) -> Result<Start, UserError> {
    let refused = |e: std::io::Error| UserError::file(dir, e);
    let folder = Folder::hold_when_there(dir).map_err(refused)?;
    let file = CheckpointFile::new(folder.clone());
    if config.labels.source != LabelSource::SceneModel {
        return start_labels(config, folder);
    }
    let restored = if config.scene.checkpoint_s > 0.0 { restore(config, &file)? } else { None };
    let claim = restored.as_ref().map(|restored| (restored.lineage, restored.mapper.epoch()));
    let run = Keeper::begin_run(folder.clone(), super::random_bits(), claim, &FirstStart::of(config)?);
    let durable = &run.durable;
    let mapper = match restored {
        Some(Restored { mut mapper, lineage }) if lineage == durable.lineage => {
            mapper.resume(durable.epoch, durable.labels);
            let (cells, at) = (mapper.cells(), mapper.last_s().unwrap_or(0.0));
            tracing::info!(
                "the scene model resumes from its checkpoint at {at} s: {cells} cells, epoch {}",
                durable.epoch
            );
            mapper
        }
        other => {
            if other.is_some() {
                tracing::warn!("the checkpoint of the scene model is of another mission: it starts from scratch");
            }
            Mapper::new(
                config,
                configured_vocabulary(config.scene.vocabulary.as_deref())?,
                durable.epoch,
                config.runtime.seed,
            )?
        }
    };
    let last_s = mapper.last_s();
    let keep = Keep { file, lineage: durable.lineage, every_s: config.scene.checkpoint_s, last_s, is_refused: false };
    let labels = (config.bands.source != LabelSource::SceneModel).then(|| {
        let file = CheckpointFile::of_labels(folder);
        let restored = (config.scene.checkpoint_s > 0.0).then(|| labels::restore(config, &file)).flatten();
        foreign(config, restored, file, &run.durable)
    });
    Ok(Start { run, mapper, keep, labels })
}

/// Begins a run with the labels of another program. The scene model stays empty.
fn start_labels(config: &Config, folder: Folder) -> Result<Start, UserError> {
    let file = CheckpointFile::of_labels(folder.clone());
    let every_s = config.scene.checkpoint_s;
    let restored = (every_s > 0.0).then(|| labels::restore(config, &file)).flatten();
    let claim = restored.as_ref().map(|(map, lineage)| (*lineage, map.epoch()));
    let run = Keeper::begin_run(folder.clone(), super::random_bits(), claim, &FirstStart::of(config)?);
    let (lineage, epoch, seed) = (run.durable.lineage, run.durable.epoch, config.runtime.seed);
    let labels = foreign(config, restored, file, &run.durable);
    let unused = Keep { file: CheckpointFile::new(folder), lineage, every_s: 0.0, last_s: None, is_refused: false };
    let mapper = Mapper::new(config, None, epoch, seed)?;
    Ok(Start { run, mapper, keep: unused, labels: Some(labels) })
}

/// The map of another program, that of the last checkpoint if it is of this mission, and its checkpoints.
fn foreign(
    config: &Config,
    restored: Option<(ForeignMap, u64)>,
    file: CheckpointFile<Folder>,
    durable: &Durable,
) -> (ForeignMap, Keep) {
    let map = match restored {
        Some((mut map, of)) if of == durable.lineage => {
            map.resume(durable.epoch, durable.labels);
            let (cells, epoch) = (map.labels().explored(), durable.epoch);
            tracing::info!("the labels and bands resume from their checkpoint: {cells} labelled cells, epoch {epoch}");
            map
        }
        other => {
            if other.is_some() {
                tracing::warn!("the checkpoint of the labels is of another mission: they start from scratch");
            }
            ForeignMap::new(config, durable.epoch)
        }
    };
    let (lineage, every_s, last_s) = (durable.lineage, config.scene.checkpoint_s, map.last_s());
    (map, Keep { file, lineage, every_s, last_s, is_refused: false })
}

fn restore(config: &Config, file: &CheckpointFile<Folder>) -> Result<Option<Restored>, UserError> {
    let bytes = file.read().unwrap_or_else(|error| {
        tracing::error!("{error}; the scene model starts from scratch, with new labels");
        None
    });
    let Some(bytes) = bytes else { return Ok(None) };
    match Mapper::restore(config, configured_vocabulary(config.scene.vocabulary.as_deref())?, &bytes) {
        Ok(restored) => Ok(Some(restored)),
        Err(RestoreError::Config(error)) => Err(error),
        Err(why) => {
            let place = file.path();
            tracing::error!("{}: {why}; the scene model starts from scratch, with new labels", place.display());
            Ok(None)
        }
    }
}
