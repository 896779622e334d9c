//! A journal: the last state that was confirmed survives a power cut at any instant.

mod record;
mod storage;

#[cfg(test)]
mod cuts;
#[cfg(test)]
pub(super) mod disk;

pub(super) use record::Damage;
pub(crate) use storage::{Folder, Storage};

use std::io;

/// The reason that a state could not be read or made durable.
#[derive(Debug, thiserror::Error)]
pub(super) enum JournalError {
    /// The file is no valid journal.
    #[error(transparent)]
    Damage(#[from] Damage),
    #[error("{doing}: {cause}; check the disk, then start again")]
    Io { doing: &'static str, cause: io::Error },
    /// An earlier write failed, so the content of the file is unknown.
    #[error("a write has failed before; check the disk, then start again")]
    Broken,
}

/// Adds the operation to an error of the file system.
fn doing(doing: &'static str) -> impl FnOnce(io::Error) -> JournalError {
    move |cause| JournalError::Io { doing, cause }
}

/// The destination of the next record.
enum JournalEnd<F> {
    /// The beginning of a new file.
    New,
    /// The end of this file, whose length is `bytes`.
    Open { file: F, bytes: usize },
    /// None: after a failed write or sync the content of the disk is unknown, even if a later one succeeds.
    Broken,
}

/// A file of records, each a complete state; the last one is valid.
///
/// The first record of a run, and one for which the file has no room left, begins a new file: written beside the old
/// one, synced, renamed, and the folder synced. So no run ever writes behind the remains of an earlier one.
pub(super) struct Journal<S: Storage> {
    storage: S,
    name: &'static str,
    most_bytes: usize,
    sequence: u64,
    end: JournalEnd<S::File>,
    confirmed: Vec<u8>,
}

impl<S: Storage> Journal<S> {
    /// Opens the journal of this name; its state is `None` before the first record.
    pub(super) fn open(
        storage: S,
        name: &'static str,
        most_bytes: usize,
    ) -> Result<(Self, Option<Vec<u8>>), JournalError> {
        let bytes = storage.read(name).map_err(doing("reading"))?;
        let mut journal = Self { storage, name, most_bytes, sequence: 0, end: JournalEnd::New, confirmed: Vec::new() };
        let Some(bytes) = bytes else { return Ok((journal, None)) };
        let scan = record::scan(&bytes)?;
        if let Some(offset) = scan.torn {
            let file = journal.storage.path(name);
            tracing::warn!("{}: dropped an unfinished record at byte {offset}, cut short by a stop", file.display());
        }
        journal.sequence = scan.last.sequence;
        Ok((journal, Some(scan.last.body.to_vec())))
    }

    pub(super) fn storage(&self) -> &S {
        &self.storage
    }

    /// Makes a state durable. A power cut before the return of `Ok` leaves this state or the last confirmed one.
    pub(super) fn persist(&mut self, state: &[u8]) -> Result<(), JournalError> {
        let record = record::encode(self.sequence + 1, state);
        self.end = match std::mem::replace(&mut self.end, JournalEnd::Broken) {
            JournalEnd::Broken => return Err(JournalError::Broken),
            JournalEnd::Open { file, bytes } if self.confirmed == state => {
                self.end = JournalEnd::Open { file, bytes };
                return Ok(());
            }
            JournalEnd::Open { mut file, bytes } if bytes + record.len() <= self.most_bytes => {
                self.storage.append(&mut file, &record).map_err(doing("writing"))?;
                self.storage.sync(&mut file).map_err(doing("syncing"))?;
                JournalEnd::Open { file, bytes: bytes + record.len() }
            }
            JournalEnd::New | JournalEnd::Open { .. } => {
                JournalEnd::Open { file: self.begin_file(&record)?, bytes: record.len() }
            }
        };
        self.sequence += 1;
        self.confirmed = state.to_vec();
        Ok(())
    }

    fn begin_file(&mut self, record: &[u8]) -> Result<S::File, JournalError> {
        let part = format!("{}.part", self.name);
        let mut file = self.storage.create(&part).map_err(doing("creating"))?;
        self.storage.append(&mut file, record).map_err(doing("writing"))?;
        self.storage.sync(&mut file).map_err(doing("syncing"))?;
        self.storage.rename(&part, self.name).map_err(doing("renaming"))?;
        self.storage.sync_folder().map_err(doing("syncing the folder"))?;
        Ok(file)
    }
}
