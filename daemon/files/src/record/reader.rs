//! The messages of a record.

use crate::bag::parts::mcap_files;
use crate::bag::stream::{BagMessage, BagStream};
use scenecast_core::UserError;
use scenecast_messages::scenecast_msgs::Frame;
use scenecast_messages::{Message, decode};
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A message of a record.
#[derive(Debug)]
pub struct RecordedMessage(BagMessage);

impl RecordedMessage {
    /// The name of its topic.
    pub fn topic(&self) -> &str {
        &self.0.topic.name
    }

    /// When it was recorded, nanoseconds since 1970.
    pub fn nanos(&self) -> u64 {
        self.0.nanos
    }

    /// The message, if it is of this type and sound.
    pub fn decode<M: Message>(&self) -> Option<M> {
        let is_of_type = self.0.topic.kind == M::DEFINITION.full_name();
        is_of_type.then(|| decode(&self.0.bytes).ok()).flatten()
    }
}

/// Gives `take` every message of a file, or of the folder of a record, in the order of the files. Returns why some of it could not be
/// read.
///
/// # Errors
/// There is no file, or it cannot be opened.
pub fn read_record(path: &Path, mut take: impl FnMut(RecordedMessage)) -> Result<Option<String>, UserError> {
    let (mut stream, mut damage) = (BagStream::open(path)?, None);
    loop {
        match stream.next(|_| true) {
            Ok(Some(message)) => take(RecordedMessage(message)),
            Ok(None) => return Ok(damage),
            Err(error) => damage = damage.or_else(|| Some(error.to_string())),
        }
    }
}

/// The records at a path: itself, or else those in the folders in it, by their names.
///
/// # Errors
/// There is none.
pub fn mission_records(path: &Path) -> Result<Vec<PathBuf>, UserError> {
    let fault = |e| UserError::file(path, e);
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = |folder: &Path| -> std::io::Result<Vec<PathBuf>> {
        let entries = std::fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path()));
        let mut entries = entries.collect::<std::io::Result<Vec<_>>>()?;
        entries.sort();
        Ok(entries)
    };
    let has_files = |folder: &Path| {
        entries(folder).is_ok_and(|files| files.iter().any(|file| file.extension().is_some_and(|e| e == "mcap")))
    };
    if has_files(path) {
        return Ok(vec![path.to_owned()]);
    }
    let within = entries(path).map_err(fault)?.into_iter().filter(|folder| folder.is_dir() && has_files(folder));
    let records: Vec<PathBuf> = within.collect();
    if records.is_empty() {
        return Err(UserError::file(path, "it is no record, and no folder in it is one: a record has files *.mcap"));
    }
    Ok(records)
}

/// A file of a record, as it can be recognised.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordFile {
    /// Its folder and its name.
    pub name: String,
    pub bytes: u64,
    /// The digest of the file, in hexadecimal digits.
    pub sha256: String,
}

impl RecordFile {
    /// The files of the records at a path that have not been written to since a moment.
    ///
    /// # Errors
    /// There is none, or one cannot be read.
    pub fn all(path: &Path, since: SystemTime) -> Result<Vec<Self>, UserError> {
        let files = mission_records(path)?.iter().map(|record| mcap_files(record)).collect::<Result<Vec<_>, _>>()?;
        let is_ended = |file: &PathBuf| {
            let modified = std::fs::metadata(file).and_then(|about| about.modified());
            modified.is_ok_and(|modified| modified < since)
        };
        files.concat().iter().filter(|file| is_ended(file)).map(|file| Self::of(file)).collect()
    }

    fn of(path: &Path) -> Result<Self, UserError> {
        let (mut file, mut sum, mut part) =
            (scenecast_config::open_regular(path, u64::MAX)?, Sha256::new(), vec![0; 1 << 16]);
        let mut bytes = 0;
        loop {
            let read = file.read(&mut part).map_err(|e| UserError::file(path, e))?;
            if read == 0 {
                break;
            }
            bytes += read as u64;
            sum.update(&part[..read]);
        }
        let path = path.canonicalize().map_err(|e| UserError::file(path, e))?;
        let within: PathBuf = path.components().skip(path.components().count().saturating_sub(2)).collect();
        let sha256 = sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { name: within.display().to_string(), bytes, sha256 })
    }
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
            frames.extend(message.decode::<Frame>().map(|frame| (message.nanos(), frame.data)));
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
