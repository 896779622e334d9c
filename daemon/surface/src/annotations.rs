//! The operator's own names of labels, and notes about a vehicle. They stay at the surface.

use super::Surface;
use super::record::{StoredLabel, StoredNote};
use scenecast_protocol::map::MAX_LABEL;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::{BTreeMap, VecDeque};

/// Maximum length of a label's name, characters.
const MAX_NAME: usize = 40;
/// Maximum length of a note, characters.
const MAX_NOTE: usize = 1000;

/// Names of labels of the current epoch, and notes.
#[derive(Debug, Clone, Default)]
pub struct Annotations {
    pub labels: BTreeMap<u8, StoredLabel>,
    /// The notes in the order of their times.
    pub notes: VecDeque<StoredNote>,
}

impl Annotations {
    /// Maximum number of notes; the oldest goes first.
    const MAX_NOTES: usize = 200;

    fn add_note(&mut self, note: StoredNote) {
        self.notes.push_back(note);
        self.notes.drain(..self.notes.len().saturating_sub(Self::MAX_NOTES));
    }
}

impl Surface {
    /// Sets name, colour and merging of a label in the current epoch. The error is one line for the operator.
    pub fn set_label(&mut self, vehicle: Address, label: u8, book: StoredLabel) -> Result<(), String> {
        let record = self.records.get_mut(&vehicle).ok_or("no such vehicle")?;
        if !(1..=MAX_LABEL).contains(&label) {
            return Err(format!("label {label}: it takes 1 to {MAX_LABEL}"));
        }
        if book.name.as_ref().is_some_and(|name| name.is_empty() || name.chars().count() > MAX_NAME) {
            return Err(format!("name: it takes 1 to {MAX_NAME} characters, or null"));
        }
        let is_colour = |c: &String| {
            c.strip_prefix('#').is_some_and(|hex| hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit()))
        };
        if book.colour.as_ref().is_some_and(|colour| !is_colour(colour)) {
            return Err("colour: it takes # and six hexadecimal digits, or null".to_owned());
        }
        if book.merged_into.is_some_and(|into| into == label || !(1..=MAX_LABEL).contains(&into)) {
            return Err(format!("merged_into: it takes another label, 1 to {MAX_LABEL}, or null"));
        }
        if record.earlier_map().is_some_and(|earlier| earlier.epoch != record.epoch) {
            return Err("the map in view has the labels of an earlier epoch".to_owned());
        }
        record.annotations.labels.insert(label, book);
        Ok(())
    }

    /// Adds a note about a vehicle. The error is one line for the operator.
    pub fn add_note(&mut self, vehicle: Address, author: &str, text: &str, now: Instant) -> Result<(), String> {
        let record = self.records.get_mut(&vehicle).ok_or("no such vehicle")?;
        let text = text.trim();
        if text.is_empty() || text.chars().count() > MAX_NOTE {
            return Err(format!("text: it takes 1 to {MAX_NOTE} characters"));
        }
        let (author, text) = (author.to_owned(), text.to_owned());
        record.annotations.add_note(StoredNote { at: now.as_micros(), author, text });
        Ok(())
    }

    /// Takes the earlier map of a vehicle out of view, although the current one has fewer cells. The map stays in the archive.
    pub fn dismiss_earlier_map(&mut self, vehicle: Address) -> Result<(), String> {
        let record = self.records.get_mut(&vehicle).ok_or("no such vehicle")?;
        record.earlier.is_dismissed = record.earlier.map.is_some();
        Ok(())
    }
}
