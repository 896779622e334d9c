//! The surface's store: everything that the page shows survives a restart, and a disk that refuses stops no mission.

mod archives;
mod batch;
mod files;
mod log;

pub(super) use archives::{ArchiveInfo, ArchivedFile};
pub(super) use files::SurfaceFiles;

use crate::journal::{Storage, write_whole};
use archives::Archives;
use log::{EventLog, Found, STORE};
use scenecast_core::UserError;
use scenecast_surface::Surface;
use scenecast_surface::record::{EventTime, SurfaceMemory};
use scenecast_surface::recorder::{Observation, Recorder};
use std::io;

/// The state of the disk, for the page.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct DiskFaults {
    /// Writes that failed since the start.
    pub(super) write_errors: u64,
    /// The reason of the last failure, until a write has succeeded again.
    pub(super) failing: Option<String>,
}

impl DiskFaults {
    /// Counts a failure; the first of a row is logged.
    pub(super) fn fail(&mut self, what: &str, error: impl std::fmt::Display) {
        self.write_errors += 1;
        let line = format!("{what}: {error}");
        if self.failing.is_none() {
            tracing::error!("{line}; the surface continues without its files and tries again");
        }
        self.failing = Some(line);
    }

    /// Notes that writing succeeds again.
    pub(super) fn clear(&mut self) {
        if self.failing.take().is_some() {
            tracing::info!("the files of the surface are written again");
        }
    }
}

/// The surface's knowledge, in memory and on disk.
pub(super) struct SurfaceStore<S: Storage> {
    recorder: Recorder,
    /// `None` while the disk refuses.
    log: Option<EventLog<S>>,
    archives: Archives,
    /// Whether the file on disk is an earlier state of this memory, so that it may be replaced.
    is_own_file: bool,
    /// The storage between the reading and the first writing.
    unused: Option<S>,
    pub(super) faults: DiskFaults,
}

impl<S: Storage> SurfaceStore<S> {
    /// Reads the state that survived. Without a storage, or with one that refuses, the state is kept in memory only. The
    /// state of another mission than `mission` is set aside.
    pub(super) fn load(storage: io::Result<S>, mission: u32) -> Result<Self, UserError> {
        let mut store = Self {
            recorder: Recorder::default(),
            log: None,
            archives: Archives::default(),
            is_own_file: false,
            unused: None,
            faults: DiskFaults::default(),
        };
        match storage.and_then(|storage| store.read(storage, mission)) {
            Ok(memory) => store.recorder = Recorder::new(memory?),
            Err(error) => store.faults.fail(STORE, error),
        }
        Ok(store)
    }

    /// Begins a run of the surface: restores `surface` from the state that survived, and writes a
    /// new file. `id` and `mission` name a new store.
    pub(super) fn begin(&mut self, surface: &mut Surface, id: u32, mission: u32, time: EventTime) {
        let observation = self.recorder.begin(surface, id, mission, time);
        self.archives.wait(observation.archives);
        if let Some(storage) = self.unused.take() {
            self.reopen(Ok(storage), time);
        }
    }

    fn read(&mut self, mut storage: S, mission: u32) -> io::Result<Result<SurfaceMemory, UserError>> {
        self.archives = Archives::read(&storage)?;
        let found = log::read(&storage)?;
        let place = storage.path(STORE);
        let Found { events, damaged_at } = match found {
            None => {
                self.unused = Some(storage);
                return Ok(Ok(SurfaceMemory::default()));
            }
            Some(Err(error)) => return Ok(Err(UserError::file(&place, error))),
            Some(Ok(found)) => found,
        };
        let mut memory = SurfaceMemory::fold(events);
        let seconds = memory.last().unix_ms / 1000;
        if let Some(offset) = damaged_at {
            let aside = format!("surface-damaged-{seconds}.store");
            tracing::error!("{}: damaged at byte {offset}; it is kept as {aside}", place.display());
            set_aside(&mut storage, &aside)?;
        }
        if let Some(began) = memory.began().filter(|began| began.mission != mission) {
            let aside = format!("surface-mission-{}-{seconds}.store", began.mission);
            tracing::info!("{}: of mission {}; it is kept as {aside}", place.display(), began.mission);
            set_aside(&mut storage, &aside)?;
            memory = SurfaceMemory::default();
        }
        self.is_own_file = true;
        self.unused = Some(storage);
        Ok(Ok(memory))
    }

    /// The state that is kept.
    pub(super) fn memory(&self) -> &SurfaceMemory {
        self.recorder.memory()
    }

    /// Whether the disk refuses, so that [`Self::reopen`] should be called from time to time.
    pub(super) fn is_closed(&self) -> bool {
        self.log.is_none()
    }

    /// Makes the changes of the surface durable. Orders since the last call are those of the principal `by`.
    pub(super) fn commit(&mut self, surface: &mut Surface, by: Option<&str>, time: EventTime) {
        let Observation { events, archives } = self.recorder.observe(surface, by, time);
        self.archives.wait(archives);
        let Some(mut log) = self.log.take() else { return };
        match self.archives.write(log.storage_mut()).and_then(|()| log.append(&events)) {
            Ok(()) if log.is_long() => self.begin_file(log.into_storage()),
            Ok(()) => self.log = Some(log),
            Err(error) => self.faults.fail(STORE, error),
        }
    }

    /// Writes a new file after the disk has refused.
    pub(super) fn reopen(&mut self, storage: io::Result<S>, time: EventTime) {
        let prepared = storage.and_then(|mut storage| {
            if !self.is_own_file && storage.read(STORE)?.is_some() {
                // It was never read: it may hold the only copy of a map.
                set_aside(&mut storage, &format!("surface-unread-{}.store", time.unix_ms / 1000))?;
            }
            self.archives.write(&mut storage)?;
            Ok(storage)
        });
        match prepared {
            Ok(storage) => self.begin_file(storage),
            Err(error) => self.faults.fail(STORE, error),
        }
    }

    fn begin_file(&mut self, storage: S) {
        match EventLog::begin(storage, &self.recorder.snapshot()) {
            Ok(log) => {
                self.log = Some(log);
                self.is_own_file = true;
                self.faults.clear();
            }
            Err(error) => self.faults.fail(STORE, error),
        }
    }

    pub(super) fn archives(&self) -> impl Iterator<Item = &ArchiveInfo> {
        self.archives.list()
    }

    /// The file of an archived map; `None` if there is none of this name or the disk refuses.
    pub(super) fn archived(&self, name: &str) -> Option<ArchivedFile<S>>
    where
        S: Clone,
    {
        self.archives.file(self.log.as_ref().map(EventLog::storage), name)
    }
}

/// Copies the file under another name, before it is replaced.
fn set_aside<S: Storage>(storage: &mut S, name: &str) -> io::Result<()> {
    let Some(bytes) = storage.read(STORE)? else { return Ok(()) };
    write_whole(storage, name, &bytes).map(drop)
}

#[cfg(test)]
mod fuzz_corpus_tests;
#[cfg(test)]
mod kept_log_tests;
#[cfg(test)]
mod power_cuts_tests;
#[cfg(test)]
mod refusing_disk_tests;
