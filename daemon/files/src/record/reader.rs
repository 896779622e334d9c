//! The messages of a record.

use crate::bag::stream::{mcap_files, records};
use mcap::records::Record;
use scenecast_core::UserError;
use scenecast_messages::scenecast_msgs::Frame;
use scenecast_messages::{Message, decode};
use std::collections::BTreeMap;
use std::path::Path;

/// A message of a record.
#[derive(Debug, Clone, Copy)]
pub struct RecordedMessage<'a> {
    pub topic: &'a str,
    /// The full name of its type, such as `std_msgs/msg/String`.
    kind: &'a str,
    /// Nanoseconds since 1970.
    pub nanos: u64,
    data: &'a [u8],
}

impl RecordedMessage<'_> {
    /// The message, if it is of this type and sound.
    pub fn decode<M: Message>(&self) -> Option<M> {
        let is_of_type = self.kind == M::DEFINITION.full_name();
        is_of_type.then(|| decode(self.data).ok()).flatten()
    }
}

/// Gives `take` every message of a file, or of the folder of a record, in the order of the files. Returns why some of it could not be
/// read.
///
/// # Errors
/// There is no file, or it cannot be opened.
pub fn read_record(path: &Path, mut take: impl FnMut(RecordedMessage<'_>)) -> Result<Option<String>, UserError> {
    let mut damage = None;
    for file in mcap_files(path)? {
        let mut schemas: BTreeMap<u16, String> = BTreeMap::new();
        let mut channels: BTreeMap<u16, (String, String)> = BTreeMap::new();
        let found = records(&file, |record| {
            match record {
                Record::Schema { header, .. } => _ = schemas.insert(header.id, header.name),
                Record::Channel(channel) if channel.message_encoding == "cdr" => {
                    let kind = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    channels.insert(channel.id, (channel.topic, kind));
                }
                Record::Message { header, data } => {
                    let Some((topic, kind)) = channels.get(&header.channel_id) else { return Ok(()) };
                    take(RecordedMessage { topic, kind, nanos: header.log_time, data: &data });
                }
                _ => {}
            }
            Ok(())
        })?;
        damage = damage.or(found);
    }
    Ok(damage)
}

/// The frames that an end has sent and received, in the order of their times.
#[derive(Debug, Default)]
pub struct RecordedFrames {
    /// Nanoseconds since 1970, and the bytes on air.
    pub frames: Vec<(u64, Vec<u8>)>,
    /// Why some of the record could not be read.
    pub damage: Option<String>,
}

impl RecordedFrames {
    /// Reads those of a file, or of the folder of a record.
    ///
    /// # Errors
    /// There is no file, or it cannot be opened.
    pub fn read(path: &Path) -> Result<Self, UserError> {
        let mut frames = Vec::new();
        let damage = read_record(path, |message| {
            frames.extend(message.decode::<Frame>().map(|frame| (message.nanos, frame.data)));
        })?;
        frames.sort_by_key(|(nanos, _)| *nanos);
        Ok(Self { frames, damage })
    }
}

/// Whether a file begins as an MCAP does, or is a folder.
pub fn is_record(path: &Path) -> bool {
    path.is_dir()
        || std::fs::File::open(path).is_ok_and(|mut file| {
            let mut head = [0; mcap::MAGIC.len()];
            std::io::Read::read_exact(&mut file, &mut head).is_ok() && head == mcap::MAGIC
        })
}
