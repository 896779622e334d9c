//! The frames in a record.

use crate::bag::stream::{mcap_files, records};
use mcap::records::Record;
use scenecast_core::UserError;
use scenecast_messages::scenecast_msgs::Frame;
use scenecast_messages::{Message, decode};
use std::collections::BTreeMap;
use std::path::Path;

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
        let mut found = Self::default();
        let name = Frame::DEFINITION.full_name();
        for file in mcap_files(path)? {
            let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
            let damage = records(&file, |record| {
                match record {
                    Record::Schema { header, .. } => _ = schemas.insert(header.id, header.name == name),
                    Record::Channel(channel) => {
                        let is_frames = schemas.get(&channel.schema_id).copied().unwrap_or(false);
                        channels.insert(channel.id, is_frames && channel.message_encoding == "cdr");
                    }
                    Record::Message { header, data } if channels.get(&header.channel_id) == Some(&true) => {
                        found.frames.extend(decode::<Frame>(&data).ok().map(|frame| (header.log_time, frame.data)));
                    }
                    _ => {}
                }
                Ok(())
            })?;
            found.damage = found.damage.or(damage);
        }
        found.frames.sort_by_key(|(nanos, _)| *nanos);
        Ok(found)
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
