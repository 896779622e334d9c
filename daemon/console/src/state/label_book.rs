//! What the operator says of labels: one truth for the page, exports, reports and other programs.

use scenecast_core::palette;
use scenecast_surface::record::StoredLabel;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The operator's names, colours and merges, by label.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct LabelBook(BTreeMap<u8, LabelEntry>);

/// What the operator says of a label.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
pub struct LabelEntry {
    /// Its name; null without one.
    #[serde(default)]
    pub name: Option<String>,
    /// Its colour, as in `#a0b1c2`; null without one.
    #[serde(default)]
    pub colour: Option<String>,
    /// The label that it is shown as a part of; null without one.
    #[serde(default)]
    pub merged_into: Option<u8>,
}

impl From<&StoredLabel> for LabelEntry {
    fn from(StoredLabel { name, colour, merged_into }: &StoredLabel) -> Self {
        Self { name: name.clone(), colour: colour.clone(), merged_into: *merged_into }
    }
}

impl FromIterator<(u8, LabelEntry)> for LabelBook {
    fn from_iter<I: IntoIterator<Item = (u8, LabelEntry)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}

impl LabelBook {
    /// The labels that the operator has said something of.
    pub fn entries(&self) -> impl Iterator<Item = (u8, &LabelEntry)> {
        self.0.iter().map(|(&label, entry)| (label, entry))
    }

    /// The label that `label` is shown as: itself, or where its merges lead.
    pub fn shown_as(&self, label: u8) -> u8 {
        let mut at = label;
        // Merges in a circle, of an earlier version, end somewhere.
        for _ in 0..self.0.len() {
            match self.0.get(&at).and_then(|entry| entry.merged_into) {
                Some(into) => at = into,
                None => break,
            }
        }
        at
    }

    /// The operator's name of a label.
    pub fn name(&self, label: u8) -> Option<&str> {
        self.0.get(&label)?.name.as_deref()
    }

    /// The name of a label, or its number in words.
    pub fn title(&self, label: u8) -> String {
        self.name(label).map_or_else(|| format!("label {label}"), str::to_owned)
    }

    /// The colour of a label by itself: the operator's, or that of the palette.
    pub fn colour(&self, label: u8) -> [u8; 3] {
        let own = self.0.get(&label).and_then(|entry| entry.colour.as_deref());
        let own = own.and_then(|text| u32::from_str_radix(text.strip_prefix('#')?, 16).ok());
        own.map_or_else(|| palette::colour(label), |rgb| [(rgb >> 16) as u8, (rgb >> 8) as u8, rgb as u8])
    }

    /// The same as text, as in `#a0b1c2`.
    pub fn colour_text(&self, label: u8) -> String {
        let [red, green, blue] = self.colour(label);
        format!("#{red:02x}{green:02x}{blue:02x}")
    }

    /// The book of a map on which `group` stands for each label. A group without a name has that of its largest member with one;
    /// `cells` counts the cells of each label.
    #[must_use]
    pub fn grouped(&self, group: impl Fn(u8) -> u8, cells: &BTreeMap<u8, u32>) -> Self {
        let mut grouped = Self::default();
        for (label, entry) in self.entries().filter(|(label, _)| group(*label) == *label) {
            let merged_into = entry.merged_into.map(&group).filter(|into| *into != label);
            grouped.0.insert(label, LabelEntry { merged_into, ..entry.clone() });
        }
        let mut members: Vec<(u8, u32)> = cells.iter().map(|(&label, &count)| (label, count)).collect();
        members.sort_by_key(|&(label, count)| (std::cmp::Reverse(count), label));
        for (label, _) in members {
            if let Some(name) = self.name(label) {
                grouped.0.entry(group(label)).or_default().name.get_or_insert_with(|| name.to_owned());
            }
        }
        grouped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: Option<&str>, merged_into: Option<u8>) -> LabelEntry {
        LabelEntry { name: name.map(str::to_owned), colour: None, merged_into }
    }

    #[test]
    fn merges_are_followed_to_their_end_and_circles_end() {
        let book = LabelBook::from_iter([
            (7, entry(None, Some(6))),
            (6, entry(Some("rubble"), Some(5))),
            (5, entry(Some("sand"), None)),
        ]);
        assert_eq!([7, 6, 5, 4].map(|label| book.shown_as(label)), [5, 5, 5, 4]);
        assert_eq!((book.title(5), book.title(7)), ("sand".to_owned(), "label 7".to_owned()));
        let circle = LabelBook::from_iter([(1, entry(None, Some(2))), (2, entry(None, Some(1)))]);
        assert!([1, 2].contains(&circle.shown_as(1)));
    }

    #[test]
    fn a_colour_is_the_operators_or_that_of_the_palette() {
        let own = LabelEntry { colour: Some("#0a0Bff".to_owned()), ..LabelEntry::default() };
        let book = LabelBook::from_iter([(3, own)]);
        assert_eq!((book.colour(3), book.colour_text(3)), ([10, 11, 255], "#0a0bff".to_owned()));
        assert_eq!(book.colour(4), palette::colour(4));
    }

    #[test]
    fn a_group_is_named_after_its_largest_named_member() {
        let book = LabelBook::from_iter([(2, entry(Some("weed"), None)), (3, entry(Some("coral"), Some(9)))]);
        let cells = BTreeMap::from([(1, 50), (2, 10), (3, 20)]);
        let grouped = book.grouped(|label| if label < 4 { 1 } else { label }, &cells);
        assert_eq!((grouped.name(1), grouped.shown_as(1)), (Some("coral"), 1));
    }
}
