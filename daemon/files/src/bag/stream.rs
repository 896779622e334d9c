//! The messages of an MCAP file, one after the other, with bounded memory.

use mcap::records::{Channel, Record, SchemaHeader};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use scenecast_core::UserError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Size of the largest record, bytes: a chunk of some raw images.
const MAX_RECORD_BYTES: usize = 512 << 20;

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
    pub(crate) bytes: Vec<u8>,
}

/// The files of a bag, which are read from the beginning of the first.
pub(crate) struct BagStream {
    rest: std::vec::IntoIter<PathBuf>,
    open: Option<(File, LinearReader)>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, BagTopic>,
}

impl BagStream {
    /// Opens a file, or the folder of a bag with its files `*.mcap`, which have the order of their names.
    ///
    /// # Errors
    /// There is no such file, or the folder has none.
    pub(crate) fn open(path: &Path) -> Result<Self, UserError> {
        let files = if path.is_dir() { files_of(path)? } else { vec![path.to_owned()] };
        for file in &files {
            scenecast_config::open_regular(file, u64::MAX)?;
        }
        Ok(Self { rest: files.into_iter(), open: None, schemas: BTreeMap::new(), channels: BTreeMap::new() })
    }

    /// The next message of a topic that is `wanted`; `None` at the end. After an error the next file follows.
    pub(crate) fn next(&mut self, wanted: impl Fn(&BagTopic) -> bool) -> Result<Option<BagMessage>, String> {
        loop {
            if self.open.is_none() {
                let Some(path) = self.rest.next() else { return Ok(None) };
                let file = File::open(&path).map_err(|e| format!("{}: {e}", path.display()))?;
                self.open = Some((file, reader()));
                self.schemas.clear();
                self.channels.clear();
            }
            match self.next_of_file(&wanted) {
                Ok(Some(message)) => return Ok(Some(message)),
                Ok(None) => self.open = None,
                Err(error) => {
                    self.open = None;
                    return Err(error);
                }
            }
        }
    }

    fn next_of_file(&mut self, wanted: &impl Fn(&BagTopic) -> bool) -> Result<Option<BagMessage>, String> {
        let Some((file, reader)) = &mut self.open else { return Ok(None) };
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| e.to_string())? {
                LinearReadEvent::ReadRequest(length) => {
                    let read = file.read(reader.insert(length)).map_err(|e| e.to_string())?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => match mcap::parse_record(opcode, data) {
                    Err(error) => return Err(error.to_string()),
                    Ok(Record::Schema { header: SchemaHeader { id, name, .. }, .. }) => {
                        self.schemas.insert(id, name);
                    }
                    Ok(Record::Channel(Channel { id, schema_id, topic, message_encoding, .. })) => {
                        let kind = self.schemas.get(&schema_id).filter(|_| message_encoding == "cdr");
                        let kind = kind.cloned().unwrap_or_default();
                        self.channels.insert(id, BagTopic { name: topic, kind });
                    }
                    Ok(Record::Message { header, data }) => {
                        let topic = self.channels.get(&header.channel_id).filter(|topic| wanted(topic));
                        if let Some(topic) = topic {
                            return Ok(Some(BagMessage { topic: topic.clone(), bytes: data.into_owned() }));
                        }
                    }
                    Ok(_) => {}
                },
            }
        }
        Ok(None)
    }
}

fn reader() -> LinearReader {
    // A recorder without power leaves a file without its end; chunks that are whole are read.
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES);
    LinearReader::new_with_options(options)
}

fn files_of(dir: &Path) -> Result<Vec<PathBuf>, UserError> {
    let entries = std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|e| e == "mcap")).collect();
    if files.is_empty() {
        return Err(UserError::file(dir, "the folder has no file *.mcap"));
    }
    // The files of a split bag end in _0, _1, ..., _10.
    files.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
    Ok(files)
}
