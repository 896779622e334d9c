//! A journal: the last state that was confirmed survives a power cut at any instant.

mod record;
mod storage;

#[cfg(test)]
mod cuts;
#[cfg(test)]
pub(super) mod disk;

pub(super) use record::Damage;
#[cfg(feature = "surface")]
pub(crate) use storage::create_folder;
pub(crate) use storage::{Folder, Storage};

use std::io;

/// Why a state could not be read, or not be made safe.
#[derive(Debug, thiserror::Error)]
pub(super) enum JournalError {
    /// The file is no journal to go on from.
    #[error(transparent)]
    Damage(#[from] Damage),
    #[error("{doing}: {cause}; check the disk, then start again")]
    Io { doing: &'static str, cause: io::Error },
    /// A write failed before; the content of the disk behind it is unknown.
    #[error("a write has failed before; check the disk, then start again")]
    Broken,
}

/// Names the operation in an error message.
fn doing(doing: &'static str) -> impl FnOnce(io::Error) -> JournalError {
    move |cause| JournalError::Io { doing, cause }
}

/// Where the next record goes.
enum JournalEnd<F> {
    /// To the beginning of a new file.
    New,
    /// To the end of this file, which has so many bytes.
    Open { file: F, bytes: usize },
    /// Nowhere: a failed write or sync leaves the content of the disk open, whatever a later one returns.
    Broken,
}

/// A file of records, each a whole state; the last one counts.
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
    /// The journal of this name, and its state; no state before the first.
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

    /// Makes a state safe. Before this has returned `Ok` a power cut leaves this state or the last confirmed one.
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
