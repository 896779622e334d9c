//! The store's file: a snapshot, and after it the batches of events since.

use super::batch;
use crate::journal::{Storage, write_whole};
use scenecast_surface::record::{self, DecodeError, Event};
use std::io;

pub(super) const STORE: &str = "surface.store";
/// Length of the batches behind the snapshot at which the file is written again, if the snapshot is not longer.
const MIN_TAIL: usize = 4 << 20;

/// The content of a store's file.
pub(super) struct Found {
    pub(super) events: Vec<Event>,
    /// The file is damaged in a way that no power cut causes, from this byte on.
    pub(super) damaged_at: Option<usize>,
}

/// Reads the events of a file; `None` if there is no file.
pub(super) fn read<S: Storage>(storage: &S) -> io::Result<Option<Result<Found, DecodeError>>> {
    let Some(bytes) = storage.read(STORE)? else { return Ok(None) };
    let scan = batch::scan(&bytes);
    let mut events = Vec::new();
    for body in &scan.bodies {
        match record::decode(body) {
            Ok(batch) => events.extend(batch),
            Err(e) => return Ok(Some(Err(e))),
        }
    }
    let place = storage.path(STORE);
    if let Some(offset) = scan.unreadable.filter(|_| !scan.is_damaged) {
        tracing::warn!("{}: dropped unfinished events at byte {offset}, cut short by a stop", place.display());
    }
    let damaged_at = scan.is_damaged.then(|| scan.unreadable.unwrap_or(0));
    Ok(Some(Ok(Found { events, damaged_at })))
}

/// A file that is open for appending. After an error its end is unknown, so it must be dropped.
pub(super) struct EventLog<S: Storage> {
    storage: S,
    file: S::File,
    last: u64,
    snapshot_bytes: usize,
    tail_bytes: usize,
}

impl<S: Storage> EventLog<S> {
    /// Begins a new file with all events so far, folded. The old file stays until the new one is whole.
    pub(super) fn begin(mut storage: S, snapshot: &[Event]) -> io::Result<Self> {
        let last = snapshot.last().map_or(0, |event| event.sequence);
        let bytes = batch::encode(last, 0, &record::encode(snapshot));
        let file = write_whole(&mut storage, STORE, &bytes)?;
        Ok(Self { storage, file, last, snapshot_bytes: bytes.len(), tail_bytes: 0 })
    }

    /// Makes events durable. A power cut before the return of `Ok` leaves all of them or none. A
    /// removed file is an error without events too.
    pub(super) fn append(&mut self, events: &[Event]) -> io::Result<()> {
        let Some(last) = events.last() else { return self.storage.append(STORE, &mut self.file, &[]) };
        let bytes = batch::encode(last.sequence, self.last, &record::encode(events));
        self.storage.append(STORE, &mut self.file, &bytes)?;
        self.storage.sync(&mut self.file)?;
        self.last = last.sequence;
        self.tail_bytes += bytes.len();
        Ok(())
    }

    /// Whether the batches are so long that the file should begin again with a snapshot.
    pub(super) fn is_long(&self) -> bool {
        self.tail_bytes > MIN_TAIL.max(self.snapshot_bytes)
    }

    pub(super) fn storage(&self) -> &S {
        &self.storage
    }

    pub(super) fn storage_mut(&mut self) -> &mut S {
        &mut self.storage
    }

    pub(super) fn into_storage(self) -> S {
        self.storage
    }
}
