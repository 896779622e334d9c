//! A journal: the last state that was confirmed survives a power cut at any instant, and a damaged file is recognised.

mod record;
mod storage;

pub(super) use record::Damage;
pub(crate) use storage::{Folder, Storage, write_whole};

use record::{FILE_BYTES, Record, RecordContent};
use std::io;

/// The reason that a state could not be made durable. A later attempt may succeed.
#[derive(Debug, thiserror::Error)]
pub(super) enum JournalError {
    #[error("{doing}: {cause}")]
    Io { doing: &'static str, cause: io::Error },
    #[error("the state of {bytes} bytes does not fit")]
    TooLong { bytes: usize },
}

/// Adds the operation to an error of the file system.
fn doing(doing: &'static str) -> impl FnOnce(io::Error) -> JournalError {
    move |cause| JournalError::Io { doing, cause }
}

/// The names of a journal's two files.
#[derive(Debug, Clone, Copy)]
pub(super) struct JournalNames {
    pub(super) journal: &'static str,
    pub(super) copy: &'static str,
}

impl JournalNames {
    fn name(&self, number: u8) -> &'static str {
        if number == 0 { self.journal } else { self.copy }
    }
}

/// The content of a journal at the start of a run.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Found {
    Absent,
    State {
        /// The last confirmed state, or one that was being written since.
        body: Vec<u8>,
        /// A file that is not as a run or a power cut leaves it; the state is that of the other file.
        damage: Option<(&'static str, Damage)>,
    },
    /// No file has a readable state.
    Lost(&'static str, Damage),
}

/// Two files of a fixed length, each with the whole state and a sequence number.
///
/// A record overwrites first the copy and then the journal, each followed by a sync. So at most one file is unreadable
/// after a power cut, and the other one has the last confirmed state. Both files have their full length from the start,
/// so that a full disk still takes records.
pub(super) struct Journal<S: Storage> {
    storage: S,
    names: JournalNames,
    /// The state with the highest number on the disk.
    last: Option<Record>,
    /// Whether the copy's last state may be in the page cache only, while the journal has the state before on the disk.
    is_copy_uncertain: bool,
    /// Whether the journal may lack the last state on the disk, while the copy has it.
    is_journal_uncertain: bool,
    /// Whether the names of both files may be missing after a power cut, because the folder's sync failed
    /// or was made by an earlier process.
    is_folder_uncertain: bool,
    files: [Option<S::File>; 2],
    /// Whether a file is put aside before a new one takes its name.
    is_damaged: [bool; 2],
}

impl<S: Storage> Journal<S> {
    /// Reads the journal of these names.
    pub(super) fn open(storage: S, names: JournalNames) -> (Self, Found) {
        let contents = [0, 1].map(|number| match storage.read(names.name(number)) {
            Ok(Some(bytes)) => record::read(number, &bytes),
            Ok(None) => RecordContent::Absent,
            Err(e) => RecordContent::Damaged(Damage::Unreadable(e.to_string())),
        });
        let last = contents.iter().filter_map(RecordContent::record).max_by_key(|record| record.sequence).cloned();
        // An earlier process may have been killed between a write and its sync: of two equal files the journal was
        // written last, and of two unequal ones the copy.
        let [journal, copy] = [0, 1].map(|at| contents[at].record());
        let is_copy_last = copy.is_some() && copy == last.as_ref();
        let is_next =
            journal.zip(copy).is_some_and(|(journal, copy)| copy.sequence == journal.sequence.wrapping_add(1));
        let is_copy_uncertain = is_copy_last && is_next;
        let is_unreadable =
            |content: &RecordContent| matches!(content, RecordContent::Torn | RecordContent::Damaged(_));
        let unreadable = [0, 1].map(|at| is_unreadable(&contents[at]));
        let found = find(names, contents);
        // A torn file beside a whole one is overwritten.
        let is_damaged = if matches!(found, Found::State { damage: None, .. }) { [false; 2] } else { unreadable };
        let is_journal_uncertain = is_copy_last;
        let files = [None, None];
        let journal = Self {
            storage,
            names,
            last,
            is_copy_uncertain,
            is_journal_uncertain,
            is_folder_uncertain: true,
            files,
            is_damaged,
        };
        (journal, found)
    }

    pub(super) fn storage(&self) -> &S {
        &self.storage
    }

    /// Makes a state durable. A power cut before the return of `Ok` leaves this state or the last one.
    ///
    /// # Errors
    /// The disk refuses. The next call writes the whole record again.
    pub(super) fn persist(&mut self, state: &[u8]) -> Result<(), JournalError> {
        let persisted = self.write_both(state);
        if persisted.is_err() {
            // The folder may have been removed with both files.
            self.files = [None, None];
        }
        persisted
    }

    fn write_both(&mut self, state: &[u8]) -> Result<(), JournalError> {
        if let Some(last) = self.last.clone().filter(|_| self.is_journal_uncertain) {
            if self.is_copy_uncertain {
                self.sync_copy(&last)?;
                self.is_copy_uncertain = false;
            }
            self.write(0, &last)?;
            self.is_journal_uncertain = false;
        }
        let sequence = self.last.as_ref().map_or(1, |last| last.sequence.wrapping_add(1));
        let next = Record { sequence, body: state.to_vec() };
        self.write(1, &next)?;
        (self.is_journal_uncertain, self.last) = (true, Some(next.clone()));
        self.write(0, &next)?;
        self.is_journal_uncertain = false;
        Ok(())
    }

    /// Syncs the copy, which alone has the last state. Writing it again could tear it.
    fn sync_copy(&mut self, last: &Record) -> Result<(), JournalError> {
        match self.storage.open(self.names.name(1), FILE_BYTES).map_err(doing("opening"))? {
            Some(mut file) => {
                self.storage.sync(&mut file).map_err(doing("syncing"))?;
                self.files[1] = Some(file);
                Ok(())
            }
            None => self.write(1, last),
        }
    }

    fn write(&mut self, number: u8, record: &Record) -> Result<(), JournalError> {
        let too_long = JournalError::TooLong { bytes: record.body.len() };
        let bytes = record::encode(number, record).ok_or(too_long)?;
        let (name, at) = (self.names.name(number), usize::from(number));
        let mut open = self.files[at].take();
        if open.is_none() && !self.is_damaged[at] {
            open = self.storage.open(name, FILE_BYTES).map_err(doing("opening"))?;
        }
        self.files[at] = Some(match open {
            Some(mut file) => {
                self.storage.overwrite(name, &mut file, &bytes).map_err(doing("writing"))?;
                self.storage.sync(&mut file).map_err(doing("syncing"))?;
                file
            }
            None => self.begin_file(number, &bytes)?,
        });
        if self.is_folder_uncertain {
            self.storage.sync_folder().map_err(doing("syncing the folder"))?;
            self.is_folder_uncertain = false;
        }
        Ok(())
    }

    fn begin_file(&mut self, number: u8, bytes: &[u8]) -> Result<S::File, JournalError> {
        let (name, at) = (self.names.name(number), usize::from(number));
        let part = format!("{name}.part");
        let mut file = self.storage.create(&part).map_err(doing("creating"))?;
        self.storage.append(&part, &mut file, bytes).map_err(doing("writing"))?;
        self.storage.sync(&mut file).map_err(doing("syncing"))?;
        if self.is_damaged[at] && self.storage.rename(name, &format!("{name}.damaged")).is_ok() {
            self.is_damaged[at] = false;
        }
        self.is_folder_uncertain = true;
        self.storage.rename(&part, name).map_err(doing("renaming"))?;
        Ok(file)
    }
}

/// Judges the two files together. Of two states the one with the higher sequence number is the last one.
fn find(names: JournalNames, [journal, copy]: [RecordContent; 2]) -> Found {
    let state = |record: Record, damage| Found::State { body: record.body, damage };
    match (journal, copy) {
        (RecordContent::Absent, RecordContent::Absent) => Found::Absent,
        (RecordContent::Sound(journal), RecordContent::Sound(copy)) if journal.sequence > copy.sequence => {
            state(journal, Some((names.copy, Damage::Older)))
        }
        (RecordContent::Sound(journal), RecordContent::Sound(copy)) => {
            let is_older = copy.sequence - journal.sequence > 1;
            state(copy, is_older.then_some((names.journal, Damage::Older)))
        }
        (RecordContent::Sound(record), RecordContent::Torn) | (RecordContent::Torn, RecordContent::Sound(record)) => {
            tracing::warn!("{}: one of two copies was cut short by a stop", names.journal);
            state(record, None)
        }
        // A stop between the first record's two files.
        (RecordContent::Absent, RecordContent::Sound(record)) if record.sequence == 1 => state(record, None),
        (RecordContent::Sound(record), RecordContent::Absent) => state(record, Some((names.copy, Damage::Missing))),
        (RecordContent::Absent, RecordContent::Sound(record)) => state(record, Some((names.journal, Damage::Missing))),
        (RecordContent::Sound(record), RecordContent::Damaged(damage)) => state(record, Some((names.copy, damage))),
        (RecordContent::Damaged(damage), RecordContent::Sound(record)) => state(record, Some((names.journal, damage))),
        (RecordContent::Damaged(damage), _) => Found::Lost(names.journal, damage),
        (RecordContent::Absent, _) => Found::Lost(names.journal, Damage::Missing),
        (RecordContent::Torn, _) => Found::Lost(names.journal, Damage::Content),
    }
}

#[cfg(test)]
mod cuts_tests;
#[cfg(test)]
mod damage_tests;
#[cfg(test)]
pub(super) mod disk;
