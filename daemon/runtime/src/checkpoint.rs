//! The file of a map producer's checkpoint. It is replaced atomically.

use super::journal::{Storage, write_whole};
use scenecast_core::UserError;
use std::io;

const NAME: &str = "scene.checkpoint";
const LABELS: &str = "labels.checkpoint";

/// Whether the folder has a checkpoint, readable or not.
pub(super) fn is_there(storage: &impl Storage) -> bool {
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
