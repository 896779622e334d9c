//! The file `metadata.yaml` beside the files of a bag.

use super::RecordEntry;
use crate::write_whole;
use scenecast_core::UserError;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// One file of a bag.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub name: String,
    /// The times of its first and its last message, nanoseconds since 1970.
    pub span: Option<(u64, u64)>,
    pub bytes: u64,
    /// The number of messages by their topic.
    pub messages: BTreeMap<String, u64>,
}

/// The content of `metadata.yaml`, which describes the parts of a bag.
#[derive(Debug)]
pub(super) struct Metadata {
    stem: String,
    next: u32,
    parts: Vec<Part>,
    /// The full name of the type by topic.
    types: BTreeMap<String, String>,
}

impl Part {
    pub(super) fn note(&mut self, topic: &str, nanos: u64) {
        let (first, last) = self.span.unwrap_or((nanos, nanos));
        self.span = Some((first.min(nanos), last.max(nanos)));
        *self.messages.entry(topic.to_owned()).or_default() += 1;
    }
}

impl Metadata {
    pub(super) fn new(stem: String) -> Self {
        Self { stem, next: 0, parts: Vec::new(), types: BTreeMap::new() }
    }

    /// Of files that are whole.
    pub(super) fn of(parts: Vec<Part>, types: BTreeMap<String, String>) -> Self {
        Self { stem: String::new(), next: 0, parts, types }
    }

    /// Begins the next file, and returns its name.
    pub(super) fn begin_part(&mut self) -> String {
        let name = format!("{}_{}.mcap", self.stem, self.next);
        self.next += 1;
        self.parts.push(Part { name: name.clone(), ..Part::default() });
        name
    }

    pub(super) fn note(&mut self, entry: &RecordEntry) {
        if !self.types.contains_key(&entry.topic) {
            self.types.insert(entry.topic.clone(), entry.definition.full_name());
        }
        if let Some(part) = self.parts.last_mut() {
            part.note(&entry.topic, entry.nanos);
        }
    }

    /// Sets the size of the last file.
    pub(super) fn set_bytes(&mut self, bytes: u64) {
        if let Some(part) = self.parts.last_mut() {
            part.bytes = bytes;
        }
    }

    /// Takes the oldest files away until all have at most so many bytes, the last one apart.
    pub(super) fn take_excess(&mut self, all_bytes: u64) -> Vec<String> {
        let mut gone = Vec::new();
        while self.parts.len() > 1 && self.parts.iter().map(|part| part.bytes).sum::<u64>() > all_bytes {
            gone.push(self.parts.remove(0).name);
        }
        gone
    }

    /// Writes the file, whole or not at all.
    pub(super) fn write(&self, dir: &Path) -> Result<(), UserError> {
        write_whole(&dir.join("metadata.yaml"), self.text().as_bytes())
    }

    /// Source: rosbag2_storage, `BagMetadata`, version 5, which all readers since Humble know.
    fn text(&self) -> String {
        let mut counts: BTreeMap<&str, u64> = self.types.keys().map(|topic| (topic.as_str(), 0)).collect();
        for (topic, messages) in self.parts.iter().flat_map(|part| &part.messages) {
            *counts.entry(topic).or_default() += messages;
        }
        let spans = self.parts.iter().filter_map(|part| part.span);
        let (first, last) = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
        let mut text = String::from("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n");
        // Writing to a string cannot fail.
        let _ = write!(text, "  duration:\n    nanoseconds: {}\n", last - first);
        let _ = write!(text, "  starting_time:\n    nanoseconds_since_epoch: {first}\n");
        let _ = writeln!(text, "  message_count: {}", counts.values().sum::<u64>());
        text += if counts.is_empty() { "  topics_with_message_count: []\n" } else { "  topics_with_message_count:\n" };
        for (topic, count) in &counts {
            let kind = self.types.get(*topic).map_or("", String::as_str);
            let _ = write!(
                text,
                "    - topic_metadata:\n        name: {topic}\n        type: {kind}\n        serialization_format: cdr\n        \
                 offered_qos_profiles: \"\"\n      message_count: {count}\n"
            );
        }
        text += "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n";
        self.parts.iter().for_each(|part| _ = writeln!(text, "    - {}", part.name));
        text += "  files:\n";
        for part in &self.parts {
            let (first, last) = part.span.unwrap_or((first, first));
            let messages: u64 = part.messages.values().sum();
            let _ = write!(
                text,
                "    - path: {}\n      starting_time:\n        nanoseconds_since_epoch: {first}\n      duration:\n        \
                 nanoseconds: {}\n      message_count: {messages}\n",
                part.name,
                last - first
            );
        }
        text
    }
}
