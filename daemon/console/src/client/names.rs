//! Labels and vehicles as people name them: by number, or by name in any case.

use scenecast_core::UserError;
use scenecast_protocol::map::MAX_LABEL;
use scenecast_surface::LabelBook;
use scenecast_surface::state::{MapLabel, MapLabelTree, MissionState, VehicleState};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The vehicle that `--vehicle` names. Its address goes before a name that looks like one.
pub(super) fn vehicle<'a>(state: &'a MissionState, text: &str) -> Result<&'a VehicleState, UserError> {
    let address = text.parse().ok();
    let by_address = state.vehicles.iter().find(|v| address == Some(v.id));
    let known = || {
        let title =
            |v: &VehicleState| if v.name.is_empty() { v.id.to_string() } else { format!("{} ({})", v.id, v.name) };
        state.vehicles.iter().map(title).collect::<Vec<_>>().join(", ")
    };
    let named = || state.vehicles.iter().filter(|v| is_same(&v.name, text)).collect::<Vec<_>>();
    match (by_address, &named()[..]) {
        (Some(vehicle), _) => Ok(vehicle),
        (None, [vehicle]) => Ok(*vehicle),
        (None, []) => {
            Err(UserError::Input(format!("--vehicle {text}: there is no such vehicle; the surface knows {}", known())))
        }
        (None, _) => {
            Err(UserError::Input(format!("--vehicle {text}: several have this name; give one of {}", known())))
        }
    }
}

/// The label that a person means. A number goes before a name that looks like one.
pub(super) fn label(book: &LabelBook, text: &str) -> Result<u8, UserError> {
    if let Some(number) = number(text) {
        return Ok(number);
    }
    let names = || book.iter().filter_map(|(&label, entry)| Some((label, entry.name.as_deref()?)));
    let named = names().filter(|(_, name)| is_same(name, text));
    let mut shown = named.map(|(label, _)| book.shown_as(label)).collect::<BTreeSet<u8>>().into_iter();
    match (shown.next(), shown.next()) {
        (Some(label), None) => Ok(label),
        (Some(a), Some(b)) => {
            Err(UserError::Input(format!("{text}: labels {a} and {b} have this name; give a number")))
        }
        (None, _) => {
            let known: Vec<String> = names().map(|(label, name)| format!("{name} ({label})")).collect();
            let known = if known.is_empty() { "no label has a name".to_owned() } else { known.join(", ") };
            Err(UserError::Input(format!("{text}: expected a label, as a number from 1 to 254 or as a name: {known}")))
        }
    }
}

/// The label that a person means, and after a name also those that are merged into it.
pub(super) fn labels(book: &LabelBook, text: &str) -> Result<Vec<u8>, UserError> {
    let found = label(book, text)?;
    let is_merged = |label: &u8| number(text).is_none() && *label != found && book.shown_as(*label) == found;
    Ok([found].into_iter().chain(book.keys().copied().filter(is_merged)).collect())
}

fn number(text: &str) -> Option<u8> {
    text.trim().parse().ok().filter(|number| (1..=MAX_LABEL).contains(number))
}

fn is_same(name: &str, text: &str) -> bool {
    name.trim().to_lowercase() == text.trim().to_lowercase()
}

/// Labels that are one where the tree is cut.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LabelGroup {
    /// The label that stands for them.
    pub(super) label: u8,
    pub(super) members: Vec<u8>,
    pub(super) cells: u32,
    pub(super) area_m2: f64,
    pub(super) name: Option<String>,
}

/// The groups of labels where the tree is cut at `count`, by the label that stands for each.
pub(super) fn groups(
    labels: &[MapLabel],
    book: &LabelBook,
    tree: Option<&MapLabelTree>,
    count: usize,
) -> Result<Vec<LabelGroup>, UserError> {
    let tree = tree.and_then(MapLabelTree::tree);
    let tree = tree.ok_or_else(|| UserError::Failed("the vehicle has sent no tree of its labels yet".to_owned()))?;
    let group = |label: u8| tree.group_of(label, count);
    let book = book.grouped(group, &labels.iter().map(|label| (label.id, label.cells)).collect());
    let mut groups: BTreeMap<u8, LabelGroup> = BTreeMap::new();
    for label in labels {
        let stands = group(label.id);
        let name = || book.name(stands).map(str::to_owned);
        let new = || LabelGroup { label: stands, members: Vec::new(), cells: 0, area_m2: 0.0, name: name() };
        let group = groups.entry(stands).or_insert_with(new);
        group.members.push(label.id);
        group.cells += label.cells;
        group.area_m2 += label.area_m2;
    }
    Ok(groups.into_values().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::record::StoredLabel;
    use serde_json::json;

    /// 2 is "Soft coral", 3 is merged into it, 4 and 5 are both "sand".
    fn reef() -> LabelBook {
        let entry = |name: Option<&str>, merged_into| StoredLabel {
            name: name.map(str::to_owned),
            merged_into,
            ..StoredLabel::default()
        };
        let (coral, sand) = (entry(Some("Soft coral"), None), entry(Some("sand"), None));
        LabelBook::from_iter([(2, coral), (3, entry(None, Some(2))), (4, sand.clone()), (5, sand)])
    }

    #[test]
    fn labels_are_named_by_number_or_in_any_case() {
        let reef = reef();
        assert_eq!(label(&reef, "3").unwrap(), 3);
        assert_eq!(label(&reef, " soft CORAL").unwrap(), 2);
        assert_eq!((labels(&reef, "soft coral").unwrap(), labels(&reef, "2").unwrap()), (vec![2, 3], vec![2]));
        let refused = |text: &str| label(&reef, text).unwrap_err().to_string();
        assert!(refused("sand").contains("labels 4 and 5 have this name"), "{}", refused("sand"));
        assert!(
            refused("rock").contains("Soft coral (2)") && refused("255").contains("1 to 254"),
            "{}",
            refused("rock")
        );
    }

    #[test]
    fn labels_are_grouped_where_the_tree_is_cut() {
        let label = |id: u8| {
            let exemplar =
                json!({"state": "none", "progress": 0.0, "bytes": null, "url": null, "at_s": null, "images": []});
            let label = json!({"id": id, "cells": 10, "area_m2": 2.5, "weight": 0.0, "exemplar": exemplar});
            serde_json::from_value::<MapLabel>(label).unwrap()
        };
        let tree = MapLabelTree { merges: vec![(2, 3), (4, 5), (1, 2), (1, 4)], clearest: None };
        let groups = groups(&[1, 2, 3, 4, 5].map(label), &reef(), Some(&tree), 3).unwrap();
        let shown: Vec<_> = groups.iter().map(|g| (g.label, &g.members[..], g.cells)).collect();
        assert_eq!(shown, [(1, &[1][..], 10), (2, &[2, 3], 20), (4, &[4, 5], 20)]);
        assert_eq!(groups[1].name.as_deref(), Some("Soft coral"));
    }
}
