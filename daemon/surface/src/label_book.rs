//! What the operator says of labels: one truth for the page, exports, reports and other programs.

use scenecast_core::palette;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// The operator's name, colour and merging of a label.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
pub struct StoredLabel {
    /// The operator's name of the label; null without one.
    #[serde(default)]
    pub name: Option<String>,
    /// The operator's colour of the label, as in `#a0b1c2`; null without one.
    #[serde(default)]
    pub colour: Option<String>,
    /// The label that it is shown as a part of; null without one.
    #[serde(default)]
    pub merged_into: Option<u8>,
}

/// The operator's names, colours and merges, by label.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct LabelBook(BTreeMap<u8, StoredLabel>);

impl FromIterator<(u8, StoredLabel)> for LabelBook {
    fn from_iter<I: IntoIterator<Item = (u8, StoredLabel)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}

impl Deref for LabelBook {
    type Target = BTreeMap<u8, StoredLabel>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for LabelBook {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

impl LabelBook {
    /// The labels that the merges of `label` lead to, one after the other; a circle of an earlier version is left after its members.
    pub(super) fn merges(&self, label: u8) -> impl Iterator<Item = u8> + '_ {
        let into = |at: &u8| self.0.get(at)?.merged_into;
        std::iter::successors(into(&label), into).take(self.0.len())
    }

    /// The label that `label` is shown as: itself, or where its merges lead.
    pub fn shown_as(&self, label: u8) -> u8 {
        self.merges(label).last().unwrap_or(label)
    }

    /// The name of the label that `label` is shown as, or its number in words.
    pub fn class_title(&self, label: u8) -> String {
        self.title(self.shown_as(label))
    }

    /// The colour in which `label` is shown; black for an unexplored cell.
    pub fn class_colour(&self, label: u8) -> [u8; 3] {
        self.colour(self.shown_as(label))
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
        for (&label, entry) in self.0.iter().filter(|(label, _)| group(**label) == **label) {
            let merged_into = entry.merged_into.map(&group).filter(|into| *into != label);
            grouped.0.insert(label, StoredLabel { merged_into, ..entry.clone() });
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

    fn entry(name: Option<&str>, merged_into: Option<u8>) -> StoredLabel {
        StoredLabel { name: name.map(str::to_owned), colour: None, merged_into }
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
        let own = StoredLabel { colour: Some("#0a0Bff".to_owned()), ..StoredLabel::default() };
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
