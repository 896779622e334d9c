//! Records that a power cut has left without their end: what was synced is written anew, with an index.

use super::metadata::{Metadata, Part};
use super::options;
use crate::bag::parts::mcap_files;
use crate::bag::stream::{Damage, is_whole, records};
use crate::sync_folder;
use mcap::Writer;
use mcap::records::{MessageHeader, Record};
use scenecast_core::UserError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecoveredPart {
    pub path: PathBuf,
    /// The number of messages that were found; `None` if the file was whole.
    pub messages: Option<u64>,
    /// Why some of it could not be read.
    pub damage: Option<String>,
}

/// What the records of a file add up to.
#[derive(Default)]
struct Contents {
    part: Part,
    types: BTreeMap<String, String>,
    damage: Option<Damage>,
    /// Messages whose topic was described in a part that could not be read.
    without_topic: u64,
}

impl Contents {
    /// Whether more is wrong than that the end is missing.
    fn is_damaged(&self) -> bool {
        self.without_topic > 0 || matches!(self.damage, Some(Damage::Chunk(_)))
    }

    fn damage(&self) -> Option<String> {
        let lost = (self.without_topic > 0)
            .then(|| format!("{} messages are lost with the description of their topics", self.without_topic));
        let all: Vec<String> = self.damage.iter().map(Damage::to_string).chain(lost).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// Makes the files of a record whole that are not, and writes `metadata.yaml` anew. `path` is a file or the folder of a record. A file of
/// which more than the end is damaged is kept beside as `*.mcap.damaged`.
///
/// # Errors
/// There is no file, or it cannot be written; it is then as it was.
pub fn recover(path: &Path) -> Result<Vec<RecoveredPart>, UserError> {
    let files = mcap_files(path)?;
    let (mut found, mut parts, mut types) = (Vec::new(), Vec::new(), BTreeMap::new());
    for file in files {
        let beside = file.with_extension("mcap.new");
        let known = if is_whole(&file)? { Some(read(&file, None)?) } else { None };
        let known = known.filter(|contents| !contents.is_damaged());
        let whole = known.is_some();
        let contents = match known {
            Some(contents) => contents,
            None => read(&file, Some(&beside))?,
        };
        if !whole {
            if contents.is_damaged() {
                // Another program may find more in it.
                let kept = file.with_extension("mcap.damaged");
                std::fs::rename(&file, &kept).map_err(|e| UserError::file(&kept, e))?;
            }
            std::fs::rename(&beside, &file).map_err(|e| UserError::file(&file, e))?;
            let folder = file.parent().unwrap_or(Path::new(""));
            sync_folder(folder).map_err(|e| UserError::file(folder, e))?;
        }
        let messages = (!whole).then(|| contents.part.messages.values().sum());
        found.push(RecoveredPart { path: file, messages, damage: contents.damage() });
        parts.push(contents.part);
        types.extend(contents.types);
    }
    if path.is_dir() {
        Metadata::of(parts, types).write(path)?;
    }
    Ok(found)
}

/// Reads a file as far as that goes, and writes what it has to `copy`.
fn read(file: &Path, copy: Option<&Path>) -> Result<Contents, UserError> {
    let failed = |e: &dyn std::fmt::Display| UserError::file(copy.unwrap_or(file), e);
    let mut contents = Contents::default();
    contents.part.name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let create = |path| -> Result<Writer<BufWriter<File>>, UserError> {
        let to = BufWriter::new(File::create(path).map_err(|e| failed(&e))?);
        options().create(to).map_err(|e| failed(&e))
    };
    let mut writer = copy.map(create).transpose()?;
    let mut schemas: BTreeMap<u16, (String, u16)> = BTreeMap::new();
    let mut topics: BTreeMap<u16, (String, u16)> = BTreeMap::new();
    let damage = records(file, |record| {
        match record {
            Record::Schema { header, data } => {
                let added = writer.as_mut().map(|w| w.add_schema(&header.name, &header.encoding, &data));
                let id = added.transpose().map_err(|e| failed(&e))?.unwrap_or_default();
                schemas.insert(header.id, (header.name, id));
            }
            Record::Channel(channel) => {
                let (kind, schema) = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let add = |w: &mut Writer<_>| {
                    w.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)
                };
                let id = writer.as_mut().map(add).transpose().map_err(|e| failed(&e))?.unwrap_or_default();
                contents.types.insert(channel.topic.clone(), kind);
                topics.insert(channel.id, (channel.topic, id));
            }
            Record::Message { header, data } => {
                let Some((topic, channel_id)) = topics.get(&header.channel_id) else {
                    contents.without_topic += 1;
                    return Ok(());
                };
                contents.part.note(topic, header.log_time);
                let header = MessageHeader { channel_id: *channel_id, ..header };
                let written = writer.as_mut().map(|w| w.write_to_known_channel(&header, &data));
                written.transpose().map_err(|e| failed(&e))?;
            }
            _ => {}
        }
        Ok(())
    })?;
    contents.damage = damage;
    if let Some(mut writer) = writer {
        writer.finish().map_err(|e| failed(&e))?;
        let mut inner = writer.into_inner();
        inner.flush().and_then(|()| inner.get_ref().sync_all()).map_err(|e| failed(&e))?;
    }
    Ok(contents)
}
