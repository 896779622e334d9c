//! The messages of an MCAP file, one after the other, with bounded memory. Chunks and single messages may be compressed. A chunk that is
//! damaged is left out, and what follows is read.

use super::parts::{ZSTD, check_format, gaps, mcap_files};
use mcap::McapError;
use mcap::records::{Channel, Record, SchemaHeader, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use scenecast_core::UserError;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Size of the largest record, bytes: a chunk of some raw images.
const MAX_RECORD_BYTES: usize = 512 << 20;
/// What can be done about a file that breaks off, as the account of one ends.
pub const HOW_TO_RECOVER: &str =
    "; scenecast record recover FOLDER makes a record whole, and mcap recover OLD.mcap -o NEW.mcap another bag";

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BagTopic {
    pub(crate) name: String,
    /// Full name of the message's type, such as `sensor_msgs/msg/Image`.
    pub(crate) kind: String,
}

/// A message with its topic, in CDR.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BagMessage {
    pub(crate) topic: BagTopic,
    /// When it was recorded, nanoseconds since 1970.
    pub(crate) nanos: u64,
    pub(crate) bytes: Vec<u8>,
}

/// Why a record cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordError {
    #[error("it ends in the middle of a record, as when a program is killed")]
    CutOff,
    #[error("it has {0} bytes, more than {MAX_RECORD_BYTES}")]
    TooLarge(u64),
    #[error(transparent)]
    Mcap(McapError),
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// What could not be read of a bag.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Damage {
    /// A file of the bag is missing, or does not belong to it: a line of [`gaps`].
    #[error("{0}")]
    Gap(String),
    #[error("{}: {error}", .path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: it is empty", .0.display())]
    Empty(PathBuf),
    #[error("{}: it does not begin as an MCAP file does", .0.display())]
    NotMcap(PathBuf),
    #[error("it breaks off: {0}{HOW_TO_RECOVER}")]
    BreaksOff(RecordError),
    #[error("a chunk is damaged and left out: {0}")]
    Chunk(RecordError),
    #[error("a message that is compressed by zstd: {0}")]
    Message(std::io::Error),
    /// A record outside of chunks, or the end of the file.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// The files of a bag, which are read from the beginning of the first.
pub(crate) struct BagStream {
    /// What is missing among the files, until it is told.
    gaps: std::vec::IntoIter<String>,
    rest: std::vec::IntoIter<PathBuf>,
    open: Option<(File, LinearReader)>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, BagTopic>,
    /// Messages of the chunk that was read last, as they are in the file.
    read: VecDeque<BagMessage>,
    other_encodings: BTreeSet<String>,
}

impl BagStream {
    /// Opens a file, or the folder of a bag with its files `*.mcap`, which have the order of their names.
    ///
    /// # Errors
    /// There is no such file, or the folder has none.
    pub(crate) fn open(path: &Path) -> Result<Self, UserError> {
        let files = mcap_files(path)?;
        files.iter().try_for_each(|file| check_format(file))?;
        let gaps = gaps(path, &files).into_iter();
        let (schemas, channels) = (BTreeMap::new(), BTreeMap::new());
        let (read, other_encodings) = (VecDeque::new(), BTreeSet::new());
        Ok(Self { gaps, rest: files.into_iter(), open: None, schemas, channels, read, other_encodings })
    }

    /// The next message of a topic that is `wanted`; `None` at the end. After an error what lies behind the damage follows.
    pub(crate) fn next(&mut self, wanted: impl Fn(&BagTopic) -> bool) -> Result<Option<BagMessage>, Damage> {
        loop {
            if let Some(gap) = self.gaps.next() {
                return Err(Damage::Gap(gap));
            }
            if let Some(message) = self.read.pop_front() {
                let bytes = unpacked(message.bytes).map_err(Damage::Message)?;
                return Ok(Some(BagMessage { bytes, ..message }));
            }
            if self.open.is_none() {
                let Some(path) = self.rest.next() else { return Ok(None) };
                let fault = |error| Damage::File { path: path.clone(), error };
                let mut file = File::open(&path).map_err(fault)?;
                let mut head = Vec::new();
                (&mut file).take(mcap::MAGIC.len() as u64).read_to_end(&mut head).map_err(fault)?;
                file.rewind().map_err(fault)?;
                if head != mcap::MAGIC {
                    return Err(if head.is_empty() { Damage::Empty(path) } else { Damage::NotMcap(path) });
                }
                self.open = Some((file, reader()));
                self.schemas.clear();
                self.channels.clear();
            }
            match self.next_record() {
                Ok(Some((op::CHUNK, chunk))) => self.handle_chunk(&chunk, &wanted)?,
                Ok(Some((opcode, record))) => self.handle_record(opcode, &record, &wanted)?,
                Ok(None) => self.open = None,
                Err(error) => {
                    self.open = None;
                    return Err(Damage::BreaksOff(error));
                }
            }
        }
    }

    /// The next chunk, or record outside of chunks, of the open file: its kind and its bytes.
    fn next_record(&mut self) -> Result<Option<(u8, Vec<u8>)>, RecordError> {
        let Some((file, reader)) = &mut self.open else { return Ok(None) };
        next_of(reader, file, |opcode, record| (opcode, record.to_vec()))
    }

    /// Takes the messages of a chunk, all or none.
    fn handle_chunk(&mut self, chunk: &[u8], wanted: &impl Fn(&BagTopic) -> bool) -> Result<(), Damage> {
        let mut handled = Ok(());
        let read = read_chunk(chunk, |opcode, record| {
            if handled.is_ok() {
                handled = self.handle_record(opcode, record, wanted);
            }
        });
        read.and(handled).map_err(Damage::Chunk)
    }

    /// Takes a record outside of chunks or of a chunk.
    fn handle_record(
        &mut self,
        opcode: u8,
        bytes: &[u8],
        wanted: &impl Fn(&BagTopic) -> bool,
    ) -> Result<(), RecordError> {
        match mcap::parse_record(opcode, bytes).map_err(RecordError::Mcap)? {
            Record::Schema { header: SchemaHeader { id, name, .. }, .. } => {
                self.schemas.insert(id, name);
            }
            Record::Channel(Channel { id, schema_id, topic, message_encoding, .. }) => {
                let kind = self.schemas.get(&schema_id).cloned().unwrap_or_default();
                if message_encoding == "cdr" {
                    self.channels.insert(id, BagTopic { name: topic, kind });
                } else {
                    self.channels.remove(&id);
                    self.other_encodings.insert(message_encoding);
                }
            }
            Record::Message { header, data } => {
                let topic = self.channels.get(&header.channel_id).filter(|topic| wanted(topic));
                let nanos = header.log_time;
                self.read.extend(topic.map(|topic| BagMessage {
                    topic: topic.clone(),
                    nanos,
                    bytes: data.into_owned(),
                }));
            }
            _ => {}
        }
        Ok(())
    }

    /// The encodings other than CDR of topics so far.
    pub(crate) fn other_encodings(&self) -> &BTreeSet<String> {
        &self.other_encodings
    }
}

/// Whether a file has its end.
pub(crate) fn is_whole(path: &Path) -> Result<bool, UserError> {
    let ends = |path: &Path| -> std::io::Result<bool> {
        let mut file = File::open(path)?;
        let mut end = [0; mcap::MAGIC.len()];
        if file.metadata()?.len() < 2 * end.len() as u64 {
            return Ok(false);
        }
        file.seek(SeekFrom::End(-(end.len() as i64)))?;
        file.read_exact(&mut end)?;
        Ok(end == mcap::MAGIC)
    };
    ends(path).map_err(|e| UserError::file(path, e))
}

/// Gives `take` the records of a file as they are, those of chunks too. Returns the first damage.
pub(crate) fn records(
    path: &Path,
    mut take: impl FnMut(Record<'_>) -> Result<(), UserError>,
) -> Result<Option<Damage>, UserError> {
    let mut file = File::open(path).map_err(|e| UserError::file(path, e))?;
    let (mut reader, mut damage) = (reader(), None);
    loop {
        match next_of(&mut reader, &mut file, |opcode, record| (opcode, record.to_vec())) {
            Ok(Some((op::CHUNK, chunk))) => {
                // All of a chunk or nothing.
                let mut found = Vec::new();
                match read_chunk(&chunk, |opcode, record| found.push((opcode, record.to_vec()))) {
                    Ok(()) => {
                        for (opcode, bytes) in found {
                            if let Ok(record) = mcap::parse_record(opcode, &bytes) {
                                take(record)?;
                            }
                        }
                    }
                    Err(error) => damage = damage.or(Some(Damage::Chunk(error))),
                }
            }
            Ok(Some((opcode, bytes))) => {
                if let Ok(record) = mcap::parse_record(opcode, &bytes) {
                    take(record)?;
                }
            }
            Ok(None) => return Ok(damage),
            Err(error) => return Ok(damage.or(Some(error.into()))),
        }
    }
}

/// Gives `take` the kinds and the bytes of the records of a chunk.
fn read_chunk(chunk: &[u8], mut take: impl FnMut(u8, &[u8])) -> Result<(), RecordError> {
    match mcap::parse_record(op::CHUNK, chunk) {
        Ok(Record::Chunk { header, .. }) if header.uncompressed_size > MAX_RECORD_BYTES as u64 => {
            return Err(RecordError::TooLarge(header.uncompressed_size));
        }
        Ok(_) => {}
        Err(error) => return Err(RecordError::Mcap(error)),
    }
    let head = [&[op::CHUNK][..], &(chunk.len() as u64).to_le_bytes()].concat();
    let (mut reader, mut bytes) = (chunk_reader(), head.chain(chunk));
    while next_of(&mut reader, &mut bytes, &mut take)?.is_some() {}
    Ok(())
}

/// An error of the reader: a program that was killed leaves a record without its length.
fn fault_of(error: McapError) -> RecordError {
    match error {
        McapError::RecordTooLarge { .. } | McapError::UnexpectedEof | McapError::UnexpectedEoc => RecordError::CutOff,
        other => RecordError::Mcap(other),
    }
}

/// What `take` makes of the kind and the bytes of the next record of a reader, which takes its bytes from a source.
fn next_of<T>(
    reader: &mut LinearReader,
    source: &mut impl Read,
    take: impl FnOnce(u8, &[u8]) -> T,
) -> Result<Option<T>, RecordError> {
    while let Some(event) = reader.next_event() {
        match event.map_err(fault_of)? {
            LinearReadEvent::ReadRequest(length) => {
                let read = source.read(reader.insert(length))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => return Ok(Some(take(opcode, data))),
        }
    }
    Ok(None)
}

/// A message as it was published: rosbag2 compresses each by itself with `compression_mode: message`. A message in CDR begins with a
/// zero.
fn unpacked(bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
    if bytes.starts_with(ZSTD) { zstd::bulk::decompress(&bytes, MAX_MESSAGE_BYTES) } else { Ok(bytes) }
}

/// Size of the largest message, bytes.
const MAX_MESSAGE_BYTES: usize = 256 << 20;

fn reader() -> LinearReader {
    // A recorder without power leaves a file without its end; chunks that are whole are read.
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_emit_chunks(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    LinearReader::new_with_options(options)
}

/// Reads the records of a chunk once its sum is right.
fn chunk_reader() -> LinearReader {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    LinearReader::new_with_options(options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_is_compressed_by_itself_is_unpacked() {
        let message = [&[0, 1, 0, 0][..], &[7; 1000]].concat();
        let packed = zstd::bulk::compress(&message, 3).unwrap();
        assert_eq!(unpacked(message.clone()).unwrap(), message);
        assert_eq!(unpacked(packed.clone()).unwrap(), message);
        assert!(unpacked(packed[..packed.len() / 2].to_vec()).is_err());
    }
}
