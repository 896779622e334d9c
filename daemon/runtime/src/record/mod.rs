//! The record of a mission: what an end knew and sent, as messages in a bag that a thread of its own writes. The link never waits for
//! it: what a slow disk does not take is left out, and counted.

#[cfg(feature = "surface")]
mod surface;
mod vehicle;

#[cfg(feature = "surface")]
pub use surface::{SurfaceRecord, SurfaceRecorder};
pub(crate) use vehicle::VehicleRecord;
pub use vehicle::VehicleRecorder;

use scenecast_config::Config;
use scenecast_core::{outln, utc_text};
use scenecast_files::{RecordEntry, RecordLimits, RecordWriter};
use scenecast_host::{FrameEvent, FrameOutcome};
pub use scenecast_messages::contents::Stamps;
use scenecast_messages::contents::{header, valid_part};
use scenecast_messages::scenecast_msgs::{Frame, MapCells, MapVersion};
use scenecast_protocol::map::{Cell, LabelGrid, MapDigest, UNEXPLORED};
use scenecast_protocol::wire::{Address, Envelope};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Entries that wait for the disk at most.
const WAITING: usize = 4096;
/// Time between two syncs; a power cut takes so much at most.
const SYNC_INTERVAL: Duration = Duration::from_millis(1500);
const MEGABYTE: u64 = 1 << 20;

/// Nanoseconds of the computer's clock since 1970.
fn unix_nanos() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// A new folder for a record that begins now: the name and the time, and a number if there is one of this second.
pub fn new_dir(folder: &Path, name: &str) -> PathBuf {
    let time = utc_text(unix_nanos() as f64 / 1e9).replace(['-', ':'], "");
    let named = |n: u32| match n {
        1 => folder.join(format!("{}-{time}", valid_part(name))),
        n => folder.join(format!("{}-{time}-{n}", valid_part(name))),
    };
    (1..100).map(named).find(|dir| !dir.exists()).unwrap_or_else(|| named(100))
}

/// The sizes of a record by the configuration.
pub fn limits(config: &Config) -> RecordLimits {
    let record = &config.record;
    RecordLimits { part_bytes: record.part_mb * MEGABYTE, all_bytes: record.quota_mb * MEGABYTE }
}

/// The stamps of a process whose mission time is `now_s`, and advances by `speed` seconds a second.
pub fn stamps_now(now_s: f64, speed: f64) -> Stamps {
    Stamps::new(now_s, speed, unix_nanos())
}

/// The record of an end, written by a thread.
struct Record {
    dir: PathBuf,
    /// `None` once the record has ended.
    entries: Option<SyncSender<RecordEntry>>,
    /// Files that were begun: each is to repeat the state of the map.
    parts: Arc<AtomicU32>,
    lost: u64,
    thread: Option<JoinHandle<()>>,
}

impl Record {
    /// Begins the record of an end with this name, in a folder of its own in `folder`, unless the configuration names another one.
    /// `None` if it wants none, or if the disk refuses it, which is logged.
    fn start(config: &Config, name: &str, folder: &Path) -> Option<Self> {
        let settings = &config.record;
        if !settings.enabled {
            return None;
        }
        let folder = settings.folder.as_deref().unwrap_or(folder);
        let dir = new_dir(folder, name);
        match RecordWriter::create(&dir, limits(config)) {
            Ok(writer) => {
                tracing::info!("record: {}", dir.display());
                let ((entries, received), parts) = (sync_channel(WAITING), Arc::new(AtomicU32::new(1)));
                let begun = parts.clone();
                let thread = std::thread::spawn(move || write(writer, &received, &begun));
                Some(Self { dir, entries: Some(entries), parts, lost: 0, thread: Some(thread) })
            }
            Err(error) => {
                tracing::error!("record: this mission is not recorded: {error}");
                None
            }
        }
    }

    /// The number of files so far.
    fn parts(&self) -> u32 {
        self.parts.load(Ordering::Relaxed)
    }

    /// Adds entries; those that find no room are left out.
    fn put(&mut self, entries: impl IntoIterator<Item = RecordEntry>) {
        for entry in entries {
            let Some(sender) = &self.entries else { return };
            match sender.try_send(entry) {
                Ok(()) => {}
                Err(TrySendError::Full(_)) => {
                    self.lost += 1;
                    if self.lost.is_power_of_two() {
                        tracing::warn!("record: the disk is too slow: {} messages left out so far", self.lost);
                    }
                }
                // The thread has said why.
                Err(TrySendError::Disconnected(_)) => self.entries = None,
            }
        }
    }

    /// Ends the record, and prints where it is.
    fn finish(mut self) {
        let is_whole = self.entries.take().is_some();
        if self.thread.take().is_some_and(|thread| thread.join().is_ok()) && is_whole {
            outln!("record: {}", self.dir.display());
        }
    }
}

fn write(mut writer: RecordWriter, entries: &Receiver<RecordEntry>, parts: &AtomicU32) {
    let mut synced = Instant::now();
    let mut step = || {
        let ends = match entries.recv_timeout(SYNC_INTERVAL / 4) {
            Ok(entry) => {
                writer.write(&entry)?;
                false
            }
            Err(RecvTimeoutError::Timeout) => false,
            Err(RecvTimeoutError::Disconnected) => true,
        };
        if !ends && synced.elapsed() >= SYNC_INTERVAL {
            parts.fetch_add(u32::from(writer.sync()?), Ordering::Relaxed);
            synced = Instant::now();
        }
        Ok::<bool, scenecast_core::UserError>(ends)
    };
    let ended = loop {
        match step() {
            Ok(true) => break writer.finish(),
            Ok(false) => {}
            Err(error) => break Err(error),
        }
    };
    if let Err(error) = ended {
        tracing::error!("record: it ends here: {error}");
    }
}

/// A frame on the link as a message.
fn frame_entry(event: &FrameEvent, name: impl Fn(Address) -> String, stamps: &Stamps) -> Option<RecordEntry> {
    let (direction, frame) = match event {
        FrameEvent::Sent { frame, .. } => (Frame::SENT, frame),
        FrameEvent::Received { frame, outcome: FrameOutcome::Dropped } => (Frame::DROPPED, frame),
        FrameEvent::Received { frame, .. } => (Frame::RECEIVED, frame),
        _ => return None,
    };
    let ends = Envelope::decode(frame, |_| true).ok().map(|envelope| [envelope.header.from, envelope.header.to]);
    let vehicle = ends.into_iter().flatten().find(|end| end.is_vehicle()).map(name).unwrap_or_default();
    let message = Frame {
        header: header(stamps.now(), ""),
        vehicle,
        direction,
        bits: frame.len() as u32 * 8,
        reason: String::new(),
        data: frame.clone(),
    };
    Some(entry("frames".to_owned(), stamps, &message))
}

fn entry<M: scenecast_messages::Message>(topic: String, stamps: &Stamps, message: &M) -> RecordEntry {
    RecordEntry::new(format!("/scenecast/{topic}"), stamps.now().nanos().max(0) as u64, message)
}

/// What a record has of a map.
#[derive(Default)]
struct RecordedMap {
    /// Epoch and version.
    key: Option<(u8, u64)>,
    shown: LabelGrid,
    digest: MapDigest,
}

/// A map that is to be recorded.
struct MapState<'a> {
    vehicle: &'a str,
    epoch: u8,
    version: u64,
    cell_m: f64,
    labels: &'a LabelGrid,
}

impl RecordedMap {
    /// The changes since the last call, and the new version.
    fn record(&mut self, map: &MapState<'_>, stamps: &Stamps) -> Vec<RecordEntry> {
        let &MapState { vehicle, epoch, version, cell_m, labels } = map;
        let whole = self.key.is_none_or(|(before, _)| before != epoch);
        if self.key.replace((epoch, version)) == Some((epoch, version)) {
            return Vec::new();
        }
        if whole {
            (self.shown, self.digest) = (LabelGrid::default(), MapDigest::default());
        }
        let gone = self.shown.iter().filter(|&(cell, _)| labels.get(cell) == UNEXPLORED);
        let gone: Vec<(Cell, u8)> = gone.map(|(cell, _)| (cell, UNEXPLORED)).collect();
        let changed = labels.iter().filter(|&(cell, label)| self.shown.get(cell) != label).chain(gone);
        let changed: Vec<(Cell, u8)> = changed.collect();
        for &(cell, label) in &changed {
            let before = self.shown.set(cell, label);
            self.digest.change(cell, before, label);
        }
        let head = || header(stamps.now(), scenecast_messages::contents::MAP_FRAME);
        let name = || vehicle.to_owned();
        let topic = |topic: &str| format!("{}/{topic}", valid_part(vehicle));
        let state = MapVersion {
            header: head(),
            vehicle: name(),
            epoch: epoch.into(),
            version,
            cells: labels.explored() as u32,
            digest: self.digest.value(),
        };
        let cells = MapCells {
            header: head(),
            vehicle: name(),
            epoch: epoch.into(),
            version,
            layer: String::new(),
            cell_m,
            whole,
            x: changed.iter().map(|(cell, _)| cell.x).collect(),
            y: changed.iter().map(|(cell, _)| cell.y).collect(),
            value: changed.iter().map(|&(_, label)| label).collect(),
        };
        let mut entries = vec![entry(topic("map_version"), stamps, &state)];
        if whole || !changed.is_empty() {
            entries.push(entry(topic("map_cells"), stamps, &cells));
        }
        entries
    }
}
