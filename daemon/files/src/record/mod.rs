//! The record of a mission: a bag of rosbag2 in MCAP, in a folder of its own. A power cut takes its last two seconds at most.

mod frame_times;
mod metadata;
mod reader;
mod recover;

use crate::sync_folder;
pub use frame_times::{FrameTimes, MissionClock, MissionSpeed, SentFrame, StateTime};
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use metadata::Metadata;
pub use reader::{RecordFile, RecordedFrames, RecordedMessage, is_record, mission_records, read_record};
pub use recover::{RecoveredPart, recover};
use scenecast_core::UserError;
use scenecast_messages::scenecast_msgs::Frame;
use scenecast_messages::std_msgs::Text;
use scenecast_messages::{Definition, Message, encode};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of messages in a chunk at most, before compression.
const CHUNK_BYTES: u64 = 256 << 10;

/// A message with its topic and its time.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordEntry {
    pub topic: String,
    pub definition: &'static Definition,
    /// When it was recorded, nanoseconds since 1970, UTC.
    pub nanos: u64,
    /// The content of the message, coded as CDR.
    pub data: Vec<u8>,
}

impl RecordEntry {
    /// An entry of a message.
    pub fn new<M: Message>(topic: String, nanos: u64, message: &M) -> Self {
        Self { topic, definition: M::DEFINITION, nanos, data: encode(message) }
    }
}

/// Sizes of a record on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordLimits {
    /// Size at which the next file begins, bytes.
    pub part_bytes: u64,
    /// Size of all files together, above which the oldest is removed, bytes.
    pub all_bytes: u64,
}

/// Writes a record. After an error its files are as they were synced last, and it is to be dropped.
pub struct RecordWriter {
    dir: PathBuf,
    limits: RecordLimits,
    metadata: Metadata,
    open: OpenPart,
}

/// One thread compresses: chunks are small.
fn options() -> WriteOptions {
    let options = WriteOptions::new().profile("ros2").library("scenecast").chunk_size(Some(CHUNK_BYTES));
    options.compression_threads(0)
}

/// The file that is written now.
struct OpenPart {
    writer: Writer<BufWriter<Arc<File>>>,
    file: Arc<File>,
    /// Identifier and number of messages of each topic in this file.
    channels: BTreeMap<String, (u16, u32)>,
}

impl OpenPart {
    fn create(path: &Path) -> Result<Self, UserError> {
        let create = || -> std::io::Result<Arc<File>> { Ok(Arc::new(File::create_new(path)?)) };
        let file = create().map_err(|e| UserError::file(path, e))?;
        let writer = options().create(BufWriter::new(file.clone()));
        let writer = writer.map_err(|e| UserError::file(path, e))?;
        Ok(Self { writer, file, channels: BTreeMap::new() })
    }

    fn write(&mut self, entry: &RecordEntry) -> Result<(), mcap::McapError> {
        let channel = match self.channels.get_mut(&entry.topic) {
            Some(channel) => channel,
            None => {
                let definition = entry.definition;
                let text = definition.ros2msg();
                let schema = self.writer.add_schema(&definition.full_name(), "ros2msg", text.as_bytes())?;
                let qos = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
                let id = self.writer.add_channel(schema, &entry.topic, "cdr", &qos)?;
                self.channels.entry(entry.topic.clone()).or_insert((id, 0))
            }
        };
        let (channel_id, sequence) = *channel;
        channel.1 = sequence.wrapping_add(1);
        let times = (entry.nanos, entry.nanos);
        let header = MessageHeader { channel_id, sequence, log_time: times.0, publish_time: times.1 };
        self.writer.write_to_known_channel(&header, &entry.data)
    }

    /// Ends the chunk, and makes all durable. Returns the size of the file.
    fn sync(&mut self) -> Result<u64, mcap::McapError> {
        self.writer.flush()?;
        self.file.sync_data()?;
        Ok(self.file.metadata()?.len())
    }

    fn finish(mut self) -> Result<(), mcap::McapError> {
        self.writer.finish()?;
        self.writer.into_inner().flush()?;
        Ok(self.file.sync_all()?)
    }
}

impl RecordWriter {
    /// Begins a record in a new folder.
    ///
    /// # Errors
    /// The folder or its files cannot be written, or the folder exists.
    pub fn create(dir: &Path, limits: RecordLimits) -> Result<Self, UserError> {
        let parent = dir.parent().unwrap_or(Path::new(""));
        std::fs::create_dir_all(parent).map_err(|e| UserError::file(parent, e))?;
        std::fs::create_dir(dir).map_err(|e| UserError::file(dir, e))?;
        sync_folder(parent).map_err(|e| UserError::file(parent, e))?;
        let stem = dir.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut metadata = Metadata::new(stem);
        let open = OpenPart::create(&dir.join(metadata.begin_part()))?;
        metadata.write(dir)?;
        Ok(Self { dir: dir.to_owned(), limits, metadata, open })
    }

    /// Adds a message.
    ///
    /// # Errors
    /// The disk refuses it.
    pub fn write(&mut self, entry: &RecordEntry) -> Result<(), UserError> {
        self.metadata.note(entry);
        self.open.write(entry).map_err(|e| UserError::file(&self.dir, e))
    }

    /// Makes what was written durable; to be called every two seconds. Returns whether a new file has begun, which is to repeat
    /// the state of the map.
    ///
    /// # Errors
    /// The disk refuses it.
    pub fn sync(&mut self) -> Result<bool, UserError> {
        let bytes = self.open.sync().map_err(|e| UserError::file(&self.dir, e))?;
        self.metadata.set_bytes(bytes);
        if bytes < self.limits.part_bytes {
            return Ok(false);
        }
        let next = OpenPart::create(&self.dir.join(self.metadata.begin_part()))?;
        std::mem::replace(&mut self.open, next).finish().map_err(|e| UserError::file(&self.dir, e))?;
        let excess = self.metadata.take_excess(self.limits.all_bytes);
        // The list of files is never longer than there are files.
        self.metadata.write(&self.dir)?;
        for old in excess {
            let path = self.dir.join(old);
            std::fs::remove_file(&path).map_err(|e| UserError::file(&path, e))?;
        }
        Ok(true)
    }

    /// Ends the record.
    ///
    /// # Errors
    /// The disk refuses it.
    pub fn finish(self) -> Result<(), UserError> {
        self.open.finish().map_err(|e| UserError::file(&self.dir, e))?;
        self.metadata.write(&self.dir)
    }

    /// The folder of the record.
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}

/// The frames of both directions of a link, in the order of their times.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct RecordedLink {
    /// From the vehicle to the surface.
    pub up: Vec<FrameFate>,
    /// From the surface to the vehicle.
    pub down: Vec<FrameFate>,
}

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameFate {
    /// The mission time at which it had been received, or would have been, seconds.
    pub arrives_s: f64,
    pub delivered: bool,
}

impl RecordedLink {
    /// Reads it from the records of both ends, which lie in this folder.
    ///
    /// # Errors
    /// One of the records is missing, or they have no frame in common.
    pub fn read(folder: &Path) -> Result<Self, UserError> {
        let (mut surfaces, mut vehicles, mut clock) = (Vec::new(), Vec::new(), MissionClock::default());
        for record in mission_records(folder)? {
            let (mut frames, mut is_surface) = (FrameTimes::default(), false);
            let _damaged = read_record(&record, |message| {
                let nanos = message.nanos();
                match message.topic() {
                    "/scenecast/frames" => message.decode::<Frame>().iter().for_each(|frame| frames.take(nanos, frame)),
                    "/scenecast/state" => {
                        let time = message.decode::<Text>().and_then(|text| StateTime::of_json(&text.data));
                        is_surface |= time.is_some();
                        time.into_iter().for_each(|time| clock.take(nanos, time));
                    }
                    _ => {}
                }
            })?;
            if is_surface { &mut surfaces } else { &mut vehicles }.push(frames);
        }
        let [surface, vehicle] = [&surfaces, &vehicles].map(|frames| FrameTimes::joined(frames.iter()));
        let shift = vehicle.shift_to(&surface);
        // By the clock of the surface, which tells the mission time.
        let to_surface = |frame: SentFrame| SentFrame { arrives: frame.arrives.saturating_add_signed(shift), ..frame };
        let up = vehicle.fates(&surface, shift).into_iter().map(to_surface).collect::<Vec<_>>();
        let down = surface.fates(&vehicle, -shift);
        let link = Self { up: fates(&up, &clock), down: fates(&down, &clock) };
        let is_known = |fates: &[FrameFate]| fates.iter().any(|fate| fate.delivered);
        if !is_known(&link.up) && !is_known(&link.down) {
            let what = "it has no records of both ends with a frame in common: both folders of a mission are needed, with the \
                        bytes of their frames";
            return Err(UserError::file(folder, what));
        }
        Ok(link)
    }
}

/// The frames in the order of their arrival.
fn fates(frames: &[SentFrame], clock: &MissionClock) -> Vec<FrameFate> {
    let fate = |frame: &SentFrame| {
        Some(FrameFate { arrives_s: clock.mission_s(frame.arrives)?, delivered: frame.received.is_some() })
    };
    let mut fates: Vec<FrameFate> = frames.iter().filter_map(fate).collect();
    fates.sort_by(|a, b| a.arrives_s.total_cmp(&b.arrives_s));
    fates
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::stream::BagStream;
    use scenecast_messages::scenecast_msgs::Event;

    const LIMITS: RecordLimits = RecordLimits { part_bytes: 1 << 20, all_bytes: 10 << 20 };

    pub(super) fn fresh(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-record-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        dir
    }

    pub(super) fn event(second: u64) -> RecordEntry {
        let text = format!("event {second}");
        let event = Event { vehicle: "auv-1".to_owned(), level: Event::INFO, text, ..Event::default() };
        RecordEntry::new("/auv_1/events".to_owned(), second * 1_000_000_000, &event)
    }

    pub(super) fn texts(path: &Path) -> Vec<String> {
        let mut stream = BagStream::open(path).unwrap();
        let mut texts = Vec::new();
        while let Some(message) = stream.next(|_| true).unwrap() {
            texts.push(scenecast_messages::decode::<Event>(&message.bytes).unwrap().text);
        }
        texts
    }

    #[test]
    fn what_was_synced_is_read_after_a_power_cut() {
        let dir = fresh("cut");
        let mut writer = RecordWriter::create(&dir, LIMITS).unwrap();
        assert!(dir.join("metadata.yaml").exists());
        (0..5).for_each(|second| writer.write(&event(second)).unwrap());
        assert!(!writer.sync().unwrap());
        writer.write(&event(5)).unwrap();
        std::mem::forget(writer);
        let part = dir.join(format!("{}_0.mcap", dir.file_name().unwrap().to_str().unwrap()));
        assert!(part.exists());
        let recovered = recover(&dir).unwrap();
        assert_eq!(recovered.iter().map(|part| part.messages).collect::<Vec<_>>(), [Some(5)]);
        assert_eq!(texts(&dir), ["event 0", "event 1", "event 2", "event 3", "event 4"]);
        assert_eq!(recover(&dir).unwrap()[0].messages, None, "it is whole now");
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn a_damaged_middle_is_left_out_and_the_rest_made_whole() {
        let dir = fresh("middle");
        let mut writer = RecordWriter::create(&dir, LIMITS).unwrap();
        let part = dir.join(format!("{}_0.mcap", dir.file_name().unwrap().to_str().unwrap()));
        let mut lengths: Vec<usize> = Vec::new();
        for seconds in [0..3, 3..300, 300..303] {
            seconds.for_each(|second| writer.write(&event(second)).unwrap());
            writer.sync().unwrap();
            lengths.push(std::fs::metadata(&part).unwrap().len() as usize);
        }
        writer.finish().unwrap();
        let mut bytes = std::fs::read(&part).unwrap();
        // The second chunk begins where the first one and its index end.
        let damaged = lengths[0] + 100;
        bytes[damaged..damaged + 20].iter_mut().for_each(|byte| *byte ^= 0x55);
        std::fs::write(&part, &bytes).unwrap();
        let recovered = recover(&dir).unwrap();
        assert_eq!(recovered[0].messages, Some(6), "{recovered:?}");
        assert!(recovered[0].damage.is_some());
        assert_eq!(texts(&dir), [0, 1, 2, 300, 301, 302].map(|second| format!("event {second}")));
        assert_eq!(std::fs::read(part.with_extension("mcap.damaged")).unwrap(), bytes, "another program may find more");
        assert_eq!(recover(&dir).unwrap()[0].messages, None, "it is whole now");
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn the_oldest_files_give_room_to_the_newest() {
        let dir = fresh("parts");
        let limits = RecordLimits { part_bytes: 2000, all_bytes: 5000 };
        let mut writer = RecordWriter::create(&dir, limits).unwrap();
        let mut parts = 1;
        for second in 0..40 {
            writer.write(&event(second)).unwrap();
            parts += u32::from(writer.sync().unwrap());
        }
        writer.finish().unwrap();
        let files =
            std::fs::read_dir(&dir).unwrap().filter(|f| f.as_ref().unwrap().path().extension().unwrap() == "mcap");
        let files = files.count() as u32;
        assert!(parts > 3 && files < parts, "{files} of {parts}");
        let texts = texts(&dir);
        assert_eq!(texts.last().map(String::as_str), Some("event 39"));
        assert!(texts.len() < 40);
        let metadata = std::fs::read_to_string(dir.join("metadata.yaml")).unwrap();
        assert_eq!(metadata.matches("path: ").count() as u32, files);
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
