//! The files of `scenecast asv`: the store, and the state of its disk.

use super::SurfaceStore;
use crate::clock::Clock;
use crate::durable::free_bytes;
use crate::journal::Folder;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::time::Instant;
use scenecast_surface::Surface;
use scenecast_surface::record::EventTime;
use scenecast_surface::state::{ArchivedMap, StorageInfo};
use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// Time between two attempts to write after the disk has refused.
const RETRY_INTERVAL: Duration = Duration::from_secs(5);
/// Minimum time between two commits of data that nobody waits for.
const COMMIT_INTERVAL: Duration = Duration::from_millis(250);
/// The link keeps at least this part of the time: a commit waits for this many times the duration of the last one.
const PAUSE_FACTOR: u32 = 10;

/// The files of the surface. No error of the disk ends the program.
pub(crate) struct SurfaceFiles {
    dir: PathBuf,
    /// Seconds of mission time for each second of the clock.
    scale: f64,
    pub(crate) store: SurfaceStore<Folder>,
    tried: std::time::Instant,
    committed: std::time::Instant,
    pause: Duration,
}

/// The time of the machine's clock in milliseconds since 1970.
fn unix_ms() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_millis() as u64)
}

fn event_time(now: Instant) -> EventTime {
    EventTime { mission_us: now.as_micros(), unix_ms: unix_ms() }
}

impl SurfaceFiles {
    /// Reads the files, and starts a clock that continues the mission time of the last run. The only errors are a folder that
    /// another process holds and a store of another layout.
    pub(crate) fn open(config: &Config) -> Result<(Self, Clock), UserError> {
        let dir = config.runtime.state_dir.clone();
        let folder = match Folder::hold(&dir) {
            Err(e) if e.kind() == ErrorKind::ResourceBusy => return Err(UserError::file(&dir, e)),
            folder => folder,
        };
        let store = SurfaceStore::load(folder, config.mission.id)?;
        let (last, scale) = (store.memory().last(), config.runtime.time_scale);
        let off_ms = if store.memory().began().is_some() { unix_ms().saturating_sub(last.unix_ms) } else { 0 };
        let start = Instant::from_micros(last.mission_us) + Duration::from_millis(off_ms).mul_f64(scale);
        let now = std::time::Instant::now();
        let files = Self { dir, scale, store, tried: now, committed: now, pause: COMMIT_INTERVAL };
        Ok((files, Clock::starting_at(start, scale)))
    }

    /// Whether an earlier run of the surface may have transmitted.
    pub(crate) fn is_again(&self) -> bool {
        self.store.memory().began().is_some()
    }

    /// Restores the surface; `id` and `mission` name a new store.
    pub(crate) fn begin(&mut self, surface: &mut Surface, id: u32, mission: u32, now: Instant) {
        self.store.begin(surface, id, mission, event_time(now));
    }

    /// Makes the changes of the surface durable. Orders since the last call are those of the principal `by`.
    pub(crate) fn commit(&mut self, surface: &mut Surface, by: Option<&str>, now: Instant) {
        let began = std::time::Instant::now();
        self.store.commit(surface, by, event_time(now));
        self.committed = std::time::Instant::now();
        self.pause = COMMIT_INTERVAL.max((self.committed - began) * PAUSE_FACTOR);
    }

    /// Whether data that nobody waits for may be committed.
    pub(crate) fn may_commit(&self) -> bool {
        self.committed.elapsed() >= self.pause
    }

    /// Tries again to write after the disk has refused.
    pub(crate) fn tend(&mut self, now: Instant) {
        if self.store.is_closed() && self.tried.elapsed() >= RETRY_INTERVAL {
            self.tried = std::time::Instant::now();
            self.store.reopen(Folder::hold(&self.dir), event_time(now));
        }
    }

    /// The archived maps, the newest first.
    pub(crate) fn archives(&self, now: Instant) -> Vec<ArchivedMap> {
        let unix_ms = unix_ms();
        let mut all: Vec<_> = self.store.archives().collect();
        all.sort_by_key(|info| std::cmp::Reverse(info.ended_unix_ms));
        let describe = |info: &super::ArchiveInfo| ArchivedMap {
            name: info.name.clone(),
            vehicle: info.vehicle,
            vehicle_name: info.vehicle_name.clone(),
            run: info.id.run,
            epoch: info.id.epoch,
            cells: info.cells,
            ended_s: now.as_secs_f64() - unix_ms.saturating_sub(info.ended_unix_ms) as f64 / 1000.0 * self.scale,
        };
        all.into_iter().map(describe).collect()
    }

    /// The state of the disk, for the page.
    pub(crate) fn info(&self) -> StorageInfo {
        let faults = &self.store.faults;
        StorageInfo {
            folder: self.dir.display().to_string(),
            free_bytes: free_bytes(&self.dir),
            write_errors: faults.write_errors,
            failing: faults.failing.clone(),
        }
    }
}
