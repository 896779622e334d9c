//! Maps of runs that have ended, one file for each vehicle, epoch and run.

use super::batch;
use crate::journal::{Storage, write_whole};
use scenecast_surface::record::{self, RunId, SurfaceMemory, VehicleMemory};
use scenecast_surface::recorder::Archive;
use std::collections::{BTreeMap, VecDeque};
use std::io;

const PREFIX: &str = "archive-";
const SUFFIX: &str = ".scmap";
/// Maps that wait for a disk that refuses.
const MAX_WAITING: usize = 32;

/// An archived map without its cells.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArchiveInfo {
    /// Name of the file without its ending.
    pub(crate) name: String,
    pub(crate) vehicle: u8,
    pub(crate) vehicle_name: String,
    pub(crate) id: RunId,
    /// When the map was archived, milliseconds since 1970.
    pub(crate) ended_unix_ms: u64,
    pub(crate) cells: u64,
}

/// The archived maps, and those that wait for the disk.
#[derive(Debug, Default)]
pub(super) struct Archives {
    known: BTreeMap<String, ArchiveInfo>,
    waiting: VecDeque<Archive>,
}

fn name(archive: &Archive) -> String {
    let RunId { run, epoch, began_unix_ms } = archive.id;
    format!("{PREFIX}{}-epoch-{epoch}-run-{run}-{}", archive.vehicle, began_unix_ms / 1000)
}

fn info(name: &str, memory: &SurfaceMemory) -> Option<ArchiveInfo> {
    let (vehicle, kept) = memory.vehicles().next()?;
    Some(ArchiveInfo {
        name: name.to_owned(),
        vehicle,
        vehicle_name: kept.name().to_owned(),
        id: kept.id(),
        ended_unix_ms: memory.last().unix_ms,
        cells: kept.archived()?.1,
    })
}

fn decode(bytes: &[u8]) -> Option<SurfaceMemory> {
    let scan = batch::scan(bytes);
    let events = record::decode(scan.bodies.first()?).ok()?;
    Some(SurfaceMemory::fold(events))
}

impl Archives {
    /// Reads which maps are archived. A file that is unreadable is left alone.
    pub(super) fn read<S: Storage>(storage: &S) -> io::Result<Self> {
        let mut known = BTreeMap::new();
        for file in storage.list()? {
            let Some(name) = file.strip_suffix(SUFFIX).filter(|name| name.starts_with(PREFIX)) else { continue };
            let memory = storage.read(&file)?.and_then(|bytes| decode(&bytes));
            match memory.and_then(|memory| info(name, &memory)) {
                Some(info) => drop(known.insert(name.to_owned(), info)),
                None => tracing::warn!("{}: not a readable archived map", storage.path(&file).display()),
            }
        }
        Ok(Self { known, waiting: VecDeque::new() })
    }

    /// Takes maps to write with [`Self::write`].
    pub(super) fn wait(&mut self, archives: impl IntoIterator<Item = Archive>) {
        self.waiting.extend(archives);
        let surplus = self.waiting.len().saturating_sub(MAX_WAITING);
        self.waiting.drain(..surplus);
    }

    /// Writes the maps that wait. Of two of the same run, the larger one is kept.
    pub(super) fn write<S: Storage>(&mut self, storage: &mut S) -> io::Result<()> {
        while let Some(archive) = self.waiting.front() {
            let name = name(archive);
            let memory = SurfaceMemory::fold(archive.events.iter().cloned());
            let found = info(&name, &memory);
            let is_smaller = |info: &ArchiveInfo| self.known.get(&name).is_some_and(|known| known.cells > info.cells);
            if let Some(info) = found.filter(|info| !is_smaller(info)) {
                let bytes = batch::encode(memory.last().unix_ms, 0, &record::encode(&archive.events));
                write_whole(storage, &format!("{name}{SUFFIX}"), &bytes)?;
                self.known.insert(name, info);
            }
            self.waiting.pop_front();
        }
        Ok(())
    }

    pub(super) fn list(&self) -> impl Iterator<Item = &ArchiveInfo> {
        self.known.values()
    }

    /// The file of the archived map of this name.
    pub(super) fn file<S: Storage + Clone>(&self, storage: Option<&S>, name: &str) -> Option<ArchivedFile<S>> {
        let vehicle = self.known.get(name)?.vehicle;
        Some(ArchivedFile { storage: storage?.clone(), name: name.to_owned(), vehicle })
    }
}

/// The file of an archived map. To read a large one takes longer than the link may wait.
pub(crate) struct ArchivedFile<S> {
    storage: S,
    name: String,
    vehicle: u8,
}

impl<S: Storage> ArchivedFile<S> {
    /// The map; `None` if the file is gone or unreadable.
    pub(crate) fn read(self) -> Option<VehicleMemory> {
        let bytes = self.storage.read(&format!("{}{SUFFIX}", self.name)).ok()??;
        decode(&bytes)?.take_vehicle(self.vehicle)
    }
}
