//! The operator's own names of labels, notes about a vehicle, markers on its map, and weights that are not sent. They stay
//! at the surface.

use super::label_book::LabelBook;
use super::record::{MAX_MARKERS, StoredDraft, StoredLabel, StoredMarker, StoredNote};
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::map::{ClassEntry, MAX_LABEL};
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};

/// Maximum length of a label's name, characters.
const MAX_NAME: usize = 60;
/// Maximum length of a note, characters.
const MAX_NOTE: usize = 1000;

/// Maximum length of a marker's text, characters.
const MAX_MARKER: usize = 200;

/// Names of labels of the current epoch, notes, markers, and the weights that are not sent.
#[derive(Debug, Clone, Default)]
pub struct Annotations {
    pub labels: LabelBook,
    /// The notes in the order of their times.
    pub notes: VecDeque<StoredNote>,
    /// The markers by their numbers.
    pub markers: BTreeMap<u32, StoredMarker>,
    /// The weights that an operator has set and not sent.
    pub draft: StoredDraft,
}

/// Why an annotation is not kept.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AnnotationRefusal {
    #[error("the map in view has the labels of an earlier epoch")]
    EarlierMap,
    #[error("label {0}: it takes 1 to {MAX_LABEL}")]
    Label(u8),
    #[error("name: it takes 1 to {MAX_NAME} characters without control characters, and no blank at its ends, or null")]
    Name,
    #[error("colour: it takes # and six hexadecimal digits, or null")]
    Colour,
    #[error("merged_into: it takes another label, 1 to {MAX_LABEL}, or null")]
    Merge,
    #[error("merged_into: label {0} is what that label is shown as, by its merges")]
    MergeInCircle(u8),
    #[error("weights: {0} is no label; they are 1 to {MAX_LABEL}")]
    WeightOf(u8),
    #[error("weight {0}: it takes -1 to 1")]
    Weight(f64),
    #[error("text: it takes 1 to {MAX_NOTE} characters")]
    Note,
    #[error("text: it takes 1 to {MAX_MARKER} characters")]
    Marker,
    #[error("x_m, y_m: the place lies more than 838 km from the origin")]
    Far,
    #[error("{MAX_MARKERS} markers are set: remove one first")]
    ManyMarkers,
    #[error("number: there is no marker {0}")]
    NoMarker(u32),
}

impl Annotations {
    /// Maximum number of notes; the oldest goes first.
    const MAX_NOTES: usize = 200;

    /// Sets name, colour and merging of a label.
    pub(super) fn set_label(&mut self, label: u8, book: StoredLabel) -> Result<(), AnnotationRefusal> {
        if !(1..=MAX_LABEL).contains(&label) {
            return Err(AnnotationRefusal::Label(label));
        }
        let is_name = |name: &String| {
            (1..=MAX_NAME).contains(&name.chars().count()) && name.trim() == name && !name.contains(char::is_control)
        };
        if book.name.as_ref().is_some_and(|name| !is_name(name)) {
            return Err(AnnotationRefusal::Name);
        }
        let is_colour = |c: &String| {
            c.strip_prefix('#').is_some_and(|hex| hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit()))
        };
        if book.colour.as_ref().is_some_and(|colour| !is_colour(colour)) {
            return Err(AnnotationRefusal::Colour);
        }
        if book.merged_into.is_some_and(|into| into == label || !(1..=MAX_LABEL).contains(&into)) {
            return Err(AnnotationRefusal::Merge);
        }
        if book.merged_into.is_some_and(|into| self.labels.merges(into).any(|at| at == label)) {
            return Err(AnnotationRefusal::MergeInCircle(label));
        }
        self.labels.insert(label, book);
        Ok(())
    }

    /// Gives a label the name and the colour of its class where the operator has given it none.
    pub(super) fn label_by_default(&mut self, entry: &ClassEntry) {
        let book = self.labels.entry(entry.label()).or_default();
        book.name.get_or_insert_with(|| entry.name().to_owned());
        let text = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
        book.colour = book.colour.take().or(entry.colour().map(text));
    }

    /// Replaces the draft of the weights, -1 to 1.
    pub fn set_draft(
        &mut self,
        author: &str,
        weights: BTreeMap<u8, f64>,
        (exploration, curiosity): (Option<f64>, Option<f64>),
        now: Instant,
    ) -> Result<(), AnnotationRefusal> {
        if let Some(&label) = weights.keys().find(|label| !(1..=MAX_LABEL).contains(*label)) {
            return Err(AnnotationRefusal::WeightOf(label));
        }
        let mut all = weights.values().chain(&exploration).chain(&curiosity);
        if let Some(&weight) = all.find(|weight| !(-1.0..=1.0).contains(*weight)) {
            return Err(AnnotationRefusal::Weight(weight));
        }
        let (number, author, at) = (self.draft.number.saturating_add(1), author.to_owned(), now.as_micros());
        self.draft = StoredDraft { number, weights, exploration, curiosity, at, author };
        Ok(())
    }

    /// Forgets everything that refers to labels, since another epoch has begun.
    pub(super) fn handle_epoch(&mut self) {
        self.labels.clear();
        self.draft = StoredDraft { number: self.draft.number.saturating_add(1), ..StoredDraft::default() };
    }

    /// Adds a note with the present time, in place of the oldest one when there are too many.
    pub fn add_note(&mut self, author: &str, text: &str, now: Instant) -> Result<(), AnnotationRefusal> {
        let text = text.trim();
        if text.is_empty() || text.chars().count() > MAX_NOTE {
            return Err(AnnotationRefusal::Note);
        }
        let (author, text) = (author.to_owned(), text.to_owned());
        self.notes.push_back(StoredNote { at: now.as_micros(), author, text });
        self.notes.drain(..self.notes.len().saturating_sub(Self::MAX_NOTES));
        Ok(())
    }

    /// Adds a marker on the operator's map; its number is one above the highest.
    pub fn add_marker(
        &mut self,
        author: &str,
        text: &str,
        place: WorldPoint,
        now: Instant,
    ) -> Result<(), AnnotationRefusal> {
        let text = text.trim();
        if text.is_empty() || text.chars().count() > MAX_MARKER {
            return Err(AnnotationRefusal::Marker);
        }
        if DecimetrePoint::nearest(place).is_none() {
            return Err(AnnotationRefusal::Far);
        }
        if self.markers.len() >= MAX_MARKERS {
            return Err(AnnotationRefusal::ManyMarkers);
        }
        let number = self.markers.last_key_value().map_or(1, |(last, _)| last.saturating_add(1));
        let (x_m, y_m) = place.xy();
        let marker =
            StoredMarker { number, x_m, y_m, at: now.as_micros(), author: author.to_owned(), text: text.to_owned() };
        self.markers.insert(number, marker);
        Ok(())
    }

    /// Removes the marker with this number.
    pub fn remove_marker(&mut self, number: u32) -> Result<(), AnnotationRefusal> {
        self.markers.remove(&number).map(drop).ok_or(AnnotationRefusal::NoMarker(number))
    }
}
