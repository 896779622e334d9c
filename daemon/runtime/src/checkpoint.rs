//! The file of a producer's checkpoints, which is replaced atomically, and when one is due.

use super::journal::{Folder, Storage, write_whole};
use scenecast_core::UserError;
use scenecast_vehicle::MapProducer;
use std::io;

const NAME: &str = "scene.checkpoint";
const LABELS: &str = "labels.checkpoint";

/// Whether the folder has a checkpoint, readable or not.
pub(super) fn has_checkpoint(storage: &impl Storage) -> bool {
    [NAME, LABELS].into_iter().any(|name| !matches!(storage.read(name), Ok(None)))
}

pub(super) struct CheckpointFile<S: Storage> {
    storage: S,
    name: &'static str,
}

impl<S: Storage> CheckpointFile<S> {
    pub(super) fn new(storage: S) -> Self {
        Self { storage, name: NAME }
    }

    /// The file of the checkpoint of another program's labels.
    pub(super) fn of_labels(storage: S) -> Self {
        Self { storage, name: LABELS }
    }

    /// Path of the file, for messages.
    pub(super) fn path(&self) -> std::path::PathBuf {
        self.storage.path(self.name)
    }

    /// The last checkpoint that was kept; `None` before the first.
    pub(super) fn read(&self) -> Result<Option<Vec<u8>>, UserError> {
        self.storage.read(self.name).map_err(|e| self.failed(e))
    }

    /// Keeps a checkpoint. A power cut before the return leaves either the previous one or this one.
    pub(super) fn keep(&mut self, bytes: &[u8]) -> Result<(), UserError> {
        self.write(bytes).map_err(|e| self.failed(e))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        write_whole(&mut self.storage, self.name, bytes).map(drop)
    }

    fn failed(&self, e: io::Error) -> UserError {
        UserError::Failed(format!("{}: {e}", self.path().display()))
    }
}

/// Schedule and file of the checkpoints.
pub(super) struct Keep {
    pub(super) file: CheckpointFile<Folder>,
    pub(super) lineage: u64,
    /// Seconds of mission time between two checkpoints; 0 for none.
    pub(super) every_s: f64,
    /// Mission time of the last attempt to write a checkpoint, or of the first frame.
    pub(super) last_s: Option<f64>,
    /// Whether the last checkpoint was refused.
    pub(super) is_refused: bool,
}

impl Keep {
    /// Keeps a checkpoint if one is due. A failing disk does not end the mission: the previous checkpoint stays.
    fn keep(&mut self, mapper: &impl MapProducer, is_due: impl Fn(f64) -> bool) {
        let Some(now_s) = mapper.last_s().filter(|_| self.every_s > 0.0) else { return };
        if !is_due(self.last_s.map_or(f64::INFINITY, |last_s| (now_s - last_s).abs())) {
            return;
        }
        let kept = self.file.keep(&mapper.save(self.lineage));
        self.last_s = Some(now_s);
        let was_refused = std::mem::replace(&mut self.is_refused, kept.is_err());
        match kept {
            Ok(()) if was_refused => tracing::info!("checkpoints of the scene model are written again"),
            Err(error) if !was_refused => {
                tracing::error!(
                    "no checkpoint of the scene model at {now_s} s, tried again every {} s: {error}",
                    self.every_s
                );
            }
            Ok(()) | Err(_) => {}
        }
    }

    pub(super) fn keep_if_due(&mut self, mapper: &impl MapProducer) {
        let every_s = self.every_s;
        // The interval begins at the first frame, whose map is not worth a checkpoint of its own.
        self.last_s = self.last_s.or(mapper.last_s());
        self.keep(mapper, |since_s| since_s >= every_s);
    }

    pub(super) fn keep_now(&mut self, mapper: &impl MapProducer) {
        self.keep(mapper, |since_s| since_s > 0.0);
    }
}
