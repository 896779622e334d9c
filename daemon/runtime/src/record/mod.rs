//! The record of a mission: what an end knew and sent, as messages in a bag that a thread of its own writes. The link never waits for
//! it: what a slow disk does not take is left out, and counted.

mod log;
mod map;
#[cfg(feature = "surface")]
mod surface_record;
mod vehicle_record;

pub(crate) use log::LogLines;
use log::log_entries;
use map::{MapState, RecordedMap};

#[cfg(feature = "surface")]
pub use surface_record::{SurfaceRecord, SurfaceRecorder};
pub use vehicle_record::{IMAGES_INTERVAL_S, VehicleRecord, VehicleRecorder};

use crate::durable::free_bytes;
use scenecast_config::Config;
use scenecast_core::drop_counts::reason_name;
use scenecast_core::{UserError, outln, utc_text};
use scenecast_files::{RecordEntry, RecordLimits, RecordWriter};
use scenecast_host::{FrameEvent, FrameOutcome};
pub use scenecast_messages::contents::Stamps;
use scenecast_messages::contents::{header, valid_part};
use scenecast_messages::scenecast_msgs::{Event, Frame};
use scenecast_messages::std_msgs::Text;
use scenecast_protocol::map::LayerSet;
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
/// Space that the record leaves to other files, bytes.
const LEFT_FREE: u64 = 256 << 20;
/// The longest wait for the disk at the end.
const END_TIMEOUT: Duration = Duration::from_secs(3);

/// Nanoseconds of the computer's clock since 1970.
pub fn unix_nanos() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// A new folder for a record that begins now: the name and the time, and a number if there is one of this second.
fn new_dir(folder: &Path, name: &str) -> PathBuf {
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

/// The record of an end, written by a thread.
struct Record {
    dir: PathBuf,
    /// `None` once the record has ended.
    entries: Option<SyncSender<RecordEntry>>,
    /// Files that were begun: each is to repeat the state of the map.
    parts: Arc<AtomicU32>,
    /// Messages that were left out, and those that the record does not tell yet.
    lost: [u64; 2],
    /// Calls that have left some out: the whole state follows each.
    gaps: u32,
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
                Some(Self { dir, entries: Some(entries), parts, lost: [0; 2], gaps: 0, thread: Some(thread) })
            }
            Err(error) => {
                tracing::error!("record: this mission is not recorded: {error}");
                None
            }
        }
    }

    /// Changes when the record needs the whole state again: in a new file, and after messages were left out.
    fn state_number(&self) -> u32 {
        self.parts.load(Ordering::Relaxed).wrapping_add(self.gaps)
    }

    /// Adds entries; those that find no room are left out.
    fn put(&mut self, entries: impl IntoIterator<Item = RecordEntry>, stamps: &Stamps) {
        let [all, untold] = self.lost;
        if untold > 0 && self.send(gap_entry(untold, stamps)) {
            self.lost[1] = 0;
        }
        for entry in entries {
            _ = self.send(entry);
        }
        let lost = self.lost[0] - all;
        if lost > 0 {
            self.gaps = self.gaps.wrapping_add(1);
            if all.checked_ilog2() != self.lost[0].checked_ilog2() {
                tracing::warn!("record: the disk is too slow: {} messages left out so far", self.lost[0]);
            }
        }
    }

    /// Whether the thread takes the entry.
    fn send(&mut self, entry: RecordEntry) -> bool {
        let Some(sender) = &self.entries else { return false };
        match sender.try_send(entry) {
            Ok(()) => return true,
            Err(TrySendError::Full(_)) => self.lost.iter_mut().for_each(|count| *count += 1),
            // The thread has said why.
            Err(TrySendError::Disconnected(_)) => self.entries = None,
        }
        false
    }

    /// Ends the record, and prints where it is. A disk that hangs does not hold the end.
    fn finish(mut self) {
        self.entries = None;
        let Some(thread) = self.thread.take() else { return };
        let began = Instant::now();
        while !thread.is_finished() && began.elapsed() < END_TIMEOUT {
            std::thread::sleep(Duration::from_millis(10));
        }
        outln!("record: {}", self.dir.display());
    }
}

/// The program, the seed of a rehearsal, and the settings that differ from their defaults, as JSON.
fn settings_text(config: &Config, rehearsal_seed: Option<u64>) -> String {
    scenecast_config::changed_settings(scenecast_core::program(), rehearsal_seed, config)
}

/// What an end ran with.
fn settings_entry(settings: &str, stamps: &Stamps) -> RecordEntry {
    entry("settings".to_owned(), stamps, &Text { data: settings.to_owned() })
}

/// The event that `count` messages of the record were left out because the disk was too slow.
fn gap_entry(count: u64, stamps: &Stamps) -> RecordEntry {
    let text = format!("{count} messages of this record were left out: the disk was too slow");
    let (header, source) = (header(stamps.now(), ""), "record".to_owned());
    let message = Event { header, vehicle: String::new(), level: Event::WARN, source, text };
    entry("events".to_owned(), stamps, &message)
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
            // The journal needs the rest.
            if free_bytes(writer.dir()).is_some_and(|free| free < LEFT_FREE) {
                return Err(UserError::file(writer.dir(), "the disk is almost full"));
            }
        }
        Ok::<bool, UserError>(ends)
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

/// What the messages about frames of a vehicle name it, and its layers.
#[derive(Default)]
struct Named {
    name: String,
    layers: LayerSet,
}

/// A frame on the link as a message; without its bytes if it may carry a next key and `hides_keys`.
///
/// The surface hides a next key in frames to the vehicle under the present one, so that who has both a record and a key that was
/// replaced would have the one that replaced it.
fn frame_entry<'a>(
    event: &FrameEvent,
    named: impl Fn(Address) -> Option<&'a Named>,
    hides_keys: bool,
    stamps: &Stamps,
) -> Option<RecordEntry> {
    let (direction, reason, frame, contents) = match event {
        FrameEvent::Sent { frame, contents, .. } => (Frame::SENT, None, frame, contents),
        FrameEvent::Received { frame, contents, outcome: FrameOutcome::Dropped, reason } => {
            (Frame::DROPPED, *reason, frame, contents)
        }
        FrameEvent::Received { frame, contents, .. } => (Frame::RECEIVED, None, frame, contents),
        _ => return None,
    };
    let sent = Envelope::decode(frame, |_| true).ok().map(|envelope| envelope.header);
    let ends = sent.as_ref().map(|header| [header.from, header.to]);
    let is_to_vehicle = ends.is_none_or(|[_, to]| to != Address::SURFACE);
    let unknown = Named::default();
    let named = ends.into_iter().flatten().find(|end| end.is_vehicle()).and_then(named).unwrap_or(&unknown);
    let message = Frame {
        header: header(stamps.now(), ""),
        vehicle: named.name.clone(),
        direction,
        number: sent.map_or(0, |header| header.number),
        bits: frame.len() as u32 * 8,
        contents: contents.keys().map(|class| class.name_in(&named.layers)).collect(),
        content_bits: contents.values().map(|bytes| *bytes as u32 * 8).collect(),
        reason: reason.map_or_else(String::new, |reason| reason_name(reason).to_owned()),
        data: if hides_keys && is_to_vehicle { Vec::new() } else { frame.clone() },
    };
    Some(entry("frames".to_owned(), stamps, &message))
}

fn entry<M: scenecast_messages::Message>(topic: String, stamps: &Stamps, message: &M) -> RecordEntry {
    RecordEntry::new(format!("/scenecast/{topic}"), stamps.now().nanos().max(0) as u64, message)
}

/// An entry of a topic of this vehicle.
fn entry_of<M: scenecast_messages::Message>(vehicle: &str, topic: &str, stamps: &Stamps, message: &M) -> RecordEntry {
    entry(format!("{}/{topic}", valid_part(vehicle)), stamps, message)
}

/// Whether so much mission time has passed since the last time, which is set.
fn is_due(last: &mut Option<f64>, interval_s: f64, now_s: f64) -> bool {
    let is_due = last.is_none_or(|last| now_s - last >= interval_s || now_s < last);
    if is_due {
        *last = Some(now_s);
    }
    is_due
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::scenecast_msgs::MapCells;
    use scenecast_protocol::map::{Cell, LabelGrid, LayerId};
    use scenecast_protocol::schedule::Class;
    use scenecast_protocol::wire::{FrameBuilder, Header, MissionId, Seal, SessionId};

    fn stamps() -> Stamps {
        Stamps::new(10.0, 1.0, 1_000_000_000_000)
    }

    fn frame(from: Address, to: Address) -> Vec<u8> {
        let header = Header::hello(from, to, SessionId::from_random(7));
        FrameBuilder::new(&header, 64).finish(&Seal::Crc(MissionId(1), 0), true)
    }

    #[test]
    fn frames_that_may_hide_a_key_have_no_bytes() {
        let auv = Address::vehicle(1).unwrap();
        let recorded = |frame: Vec<u8>, hides_keys: bool| {
            let contents = [(Class::Map, 9), (Class::Layer(LayerId::DEPTH), 4)].into();
            let event = FrameEvent::Received { frame, contents, outcome: FrameOutcome::Opened, reason: None };
            let named = Named { name: "auv-1".to_owned(), ..Named::default() };
            let entry = frame_entry(&event, |_| Some(&named), hides_keys, &stamps()).unwrap();
            scenecast_messages::decode::<Frame>(&entry.data).unwrap()
        };
        let (down, up) = (frame(Address::SURFACE, auv), frame(auv, Address::SURFACE));
        assert!(recorded(down.clone(), true).data.is_empty());
        let shown = recorded(down.clone(), false);
        assert_eq!(shown.data, down);
        assert_eq!((shown.contents.join(" "), shown.content_bits), ("map depth".to_owned(), vec![72, 32]));
        assert_eq!(recorded(up.clone(), true).data, up);
        // Who reads no addresses does not know whose frame it is.
        assert!(recorded(vec![0xFF; 9], true).data.is_empty());
    }

    #[test]
    fn the_whole_map_follows_what_was_left_out() {
        let (entries, waiting) = sync_channel(2);
        let parts = Arc::new(AtomicU32::new(1));
        let mut record =
            Record { dir: PathBuf::new(), entries: Some(entries), parts, lost: [0; 2], gaps: 0, thread: None };
        let mut map = RecordedMap::default();
        let mut labels = LabelGrid::default();
        let mut change = |record: &mut Record, map: &mut RecordedMap, x: i32| {
            labels.set(Cell::new(x, 0), 3);
            let version = x as u64;
            let (vehicle, layer, source) = ("auv-1", "", None);
            let state = MapState { vehicle, layer, epoch: 0, version, cell_m: 0.5, labels: &labels, source };
            record.put(map.record(&state, &stamps()), &stamps());
        };
        let before = record.state_number();
        change(&mut record, &mut map, 1);
        assert_eq!(record.state_number(), before);
        change(&mut record, &mut map, 2);
        assert_ne!(record.state_number(), before, "the disk has taken nothing yet");
        while waiting.try_recv().is_ok() {}
        record.put([], &stamps());
        let told = waiting.try_recv().unwrap();
        let text = scenecast_messages::decode::<Event>(&told.data).unwrap().text;
        assert!(text.starts_with("2 messages of this record were left out"), "{text}");
        let mut map = RecordedMap::default();
        change(&mut record, &mut map, 3);
        let cells = waiting.try_iter().find_map(|entry| {
            let is_cells = entry.topic.ends_with("/map_cells");
            is_cells.then(|| scenecast_messages::decode::<MapCells>(&entry.data).unwrap())
        });
        assert_eq!(cells.map(|cells| (cells.whole, cells.x.len())), Some((true, 3)));
    }
}
