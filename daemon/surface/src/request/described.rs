//! Requests in words, for the log of the mission.

use super::SurfaceRequest;
use crate::orders::{ExemplarAction, LabelOrder, OrderChanges, member_in_words, name_and_unit};
use crate::record::StoredLabel;
use crate::{LimitsOrder, LogKind};
use scenecast_protocol::directive::{Constraints, SlotId};
use scenecast_protocol::wire::Address;
use serde_json::Value;
use std::collections::BTreeMap;

/// The vehicle, the kind and the text of the entry for a request; `None` if it changes nothing that the log has. `name_of_order` says
/// what the latest order in a slot of a vehicle is called, `stored` what a label of a vehicle has been until now.
pub(super) fn describe(
    request: &SurfaceRequest,
    name_of_order: impl Fn(u8, SlotId) -> &'static str,
    stored: impl Fn(u8, u8) -> Option<StoredLabel>,
) -> Option<(Option<Address>, LogKind, String)> {
    use SurfaceRequest as R;
    let order = |id: u8, text: String| (Address::vehicle(id), LogKind::Order, text);
    let record = |id: u8, text: String| (Address::vehicle(id), LogKind::Record, text);
    Some(match request {
        R::Map(_) | R::FormerLabels(..) | R::Exemplar(..) | R::Fit(..) | R::DryRun(..) => return None,
        R::Floor(..) | R::FloorImage(..) => return None,
        // A draft changes with each move of a slider.
        R::Draft(..) | R::Log | R::Archives | R::ArchivedMap(_) | R::Command(_) => return None,
        R::Replay(_) | R::ReplayEvents | R::Report | R::Barred(..) => return None,
        R::Utility(id, weights, terms) => order(*id, utility(weights, *terms)),
        R::ExemplarOrder(id, wanted) => {
            let verb = match wanted.action {
                ExemplarAction::Another => "image requested",
                ExemplarAction::Larger => "larger image requested",
                ExemplarAction::Cancel => "request for an image withdrawn",
            };
            order(*id, format!("{verb}: label {}", wanted.label))
        }
        R::Constraints(id, Constraints { abort: true, .. }) => order(*id, "abort".into()),
        R::Constraints(id, Constraints { hold: true, .. }) | R::Hold(id, true) => order(*id, "hold".into()),
        R::Constraints(id, _) | R::Hold(id, false) => order(*id, "resume".into()),
        R::Fence(id, fence) => {
            let count = |value: &Value| value.as_array().map_or(0, Vec::len);
            let part = |(name, value): (&String, &Value)| match name.as_str() {
                "fence" if value.is_null() => "no fence".to_owned(),
                "fence" => format!("{} corners", count(value)),
                "keep_outs" if count(value) == 0 => "no keep-outs".to_owned(),
                "keep_outs" if count(value) == 1 => "1 keep-out".to_owned(),
                "keep_outs" => format!("{} keep-outs", count(value)),
                _ if value.is_null() => "no return point".to_owned(),
                _ => format!("return point {value}"),
            };
            order(*id, format!("fence: {}", fence.named().iter().map(part).collect::<Vec<_>>().join(", ")))
        }
        R::Limits(id, limits) => order(*id, format!("limits: {}", limits_named(limits))),
        R::Areas(id, areas) => {
            let weights: Vec<String> = areas.areas.iter().map(|area| place(&area.outline, area.weight)).collect();
            order(*id, if weights.is_empty() { "no areas".into() } else { format!("areas: {}", weights.join(", ")) })
        }
        R::Destination(id, to) => order(
            *id,
            to.place.map_or("destination withdrawn".into(), |[x, y]| format!("destination: E {x:.1} N {y:.1} m")),
        ),
        R::Settings(id, settings) => order(*id, format!("settings: {}", members(settings))),
        R::Again(id, slot, _) => order(*id, format!("{} sent again", name_of_order(*id, *slot))),
        R::Restore(id) => order(*id, "orders that the vehicle may have lost are to be sent again".into()),
        R::TakeOver(id) => order(*id, "the vehicle is taken over from another surface".into()),
        R::Budget(budget) => (None, LogKind::Order, format!("budget: {} bit/s", budget.budget_bps)),
        R::Label(id, order) => record(*id, label(order, &stored(*id, order.label).unwrap_or_default())),
        R::Note(id, _, note) => record(*id, format!("note: {}", note.text.trim())),
        R::Marker(id, _, marker) => {
            record(*id, format!("marker at E {:.1} N {:.1} m: {}", marker.x_m, marker.y_m, marker.text.trim()))
        }
        R::RemoveMarker(id, marker) => record(*id, format!("marker {} removed", marker.number)),
        R::DismissEarlierMap(id) => record(*id, "the earlier map is out of view".into()),
    })
}

/// What an edit changes of the name, the colour and the merging of a label.
fn label(order: &LabelOrder, before: &StoredLabel) -> String {
    let member = |now: &Option<String>, before: &Option<String>, what: &str| {
        (now != before).then(|| now.as_ref().map_or_else(|| format!("no {what}"), |now| format!("{what} {now}")))
    };
    let merged = match (order.merged_into, before.merged_into) {
        (now, before) if now == before => None,
        (Some(into), _) => Some(format!("merged into label {into}")),
        (None, before) => before.map(|into| format!("no longer merged into label {into}")),
    };
    let name = member(&order.name, &before.name, "name");
    let all: Vec<String> =
        [name, member(&order.colour, &before.colour, "colour"), merged].into_iter().flatten().collect();
    format!("label {}: {}", order.label, if all.is_empty() { "as it was".to_owned() } else { all.join(", ") })
}

/// The weight of an area and the middle of its corners.
fn place(outline: &[[f64; 2]], weight: f64) -> String {
    let middle = |axis: usize| outline.iter().map(|corner| corner[axis]).sum::<f64>() / outline.len().max(1) as f64;
    format!("{weight:+.2} around E {:.1} N {:.1} m", middle(0), middle(1))
}

fn utility(weights: &BTreeMap<u8, f64>, (exploration, curiosity): (f64, f64)) -> String {
    let others =
        [("unexplored", exploration), ("curiosity", curiosity)].map(|(name, weight)| (name.to_owned(), weight));
    let labels = weights.iter().map(|(label, weight)| (format!("label {label}"), *weight));
    let all = labels.chain(others).filter(|(_, weight)| *weight != 0.0);
    let all: Vec<String> = all.map(|(name, weight)| format!("{name} {weight:+.2}")).collect();
    if all.is_empty() { "weights: all 0".to_owned() } else { format!("weights: {}", all.join(", ")) }
}

/// The limits that an order names, those that it removes last.
fn limits_named(order: &OrderChanges<LimitsOrder>) -> String {
    let removed: Vec<String> =
        order.named().iter().filter(|(_, v)| v.is_null()).map(|(name, _)| name_and_unit(name).0).collect();
    let stated = Some(members(order.named())).filter(|_| removed.len() < order.named().len());
    let removed = (!removed.is_empty()).then(|| format!("removed: {}", removed.join(", ")));
    stated.into_iter().chain(removed).collect::<Vec<_>>().join("; ")
}

/// The members of an order that it states.
fn members(order: &impl serde::Serialize) -> String {
    let value = serde_json::to_value(order).unwrap_or_default();
    let stated = value.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null());
    let stated: Vec<String> = stated.map(|(name, value)| member_in_words(name, value)).collect();
    if stated.is_empty() { "none".to_owned() } else { stated.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DestinationOrder, LimitsOrder};

    #[test]
    fn requests_are_described_by_what_they_change() {
        let text = |request: SurfaceRequest| {
            describe(&request, |_, _| "abort", |_, _| None).map(|(_, kind, text)| (kind.name(), text))
        };
        let again = SurfaceRequest::Again(1, SlotId::Constraints, "constraints".into());
        assert_eq!(text(again), Some(("order", "abort sent again".into())));
        let weights = SurfaceRequest::Utility(1, [(3, 0.8), (4, 0.0)].into(), (0.1, 0.0));
        assert_eq!(text(weights), Some(("order", "weights: label 3 +0.80, unexplored +0.10".into())));
        let limits = LimitsOrder { time_s: Some(600.0), on_silence: Some("hold".into()), ..LimitsOrder::default() };
        let whole = "limits: on silence hold, time 600 s; \
                     removed: altitude, depth, distance, on abort, on breach, silence";
        assert_eq!(text(SurfaceRequest::Limits(1, OrderChanges::whole(&limits))), Some(("order", whole.into())));
        let changes = serde_json::from_str(r#"{"depth_m": null, "time_s": 60}"#).unwrap();
        let depth = serde_json::from_str(r#"{"depth_m": [2, 25.5]}"#).unwrap();
        assert_eq!(text(SurfaceRequest::Limits(1, depth)), Some(("order", "limits: depth 2 to 25.5 m".into())));
        let removed = serde_json::from_str(r#"{"silence_s": null}"#).unwrap();
        assert_eq!(text(SurfaceRequest::Limits(1, removed)), Some(("order", "limits: removed: silence".into())));
        assert_eq!(
            text(SurfaceRequest::Limits(1, changes)),
            Some(("order", "limits: time 60 s; removed: depth".into()))
        );
        let to = DestinationOrder { place: Some([1.0, -2.5]) };
        assert_eq!(text(SurfaceRequest::Destination(1, to)), Some(("order", "destination: E 1.0 N -2.5 m".into())));
        assert_eq!(text(SurfaceRequest::Hold(1, true)), Some(("order", "hold".into())));
        assert_eq!(text(SurfaceRequest::Hold(1, false)), Some(("order", "resume".into())));
        assert_eq!(text(SurfaceRequest::Map(1)), None);
    }

    #[test]
    fn an_edit_of_a_label_is_described_by_what_it_changes() {
        let text = |name: Option<&str>, merged_into, before: &StoredLabel| {
            let order = LabelOrder { label: 5, name: name.map(str::to_owned), colour: None, merged_into };
            label(&order, before)
        };
        let silt = StoredLabel { name: Some("silt".into()), ..StoredLabel::default() };
        let merged = StoredLabel { merged_into: Some(6), ..silt.clone() };
        assert_eq!(text(Some("silt"), None, &StoredLabel::default()), "label 5: name silt");
        assert_eq!(text(Some("silt"), Some(6), &silt), "label 5: merged into label 6");
        assert_eq!(text(Some("silt"), Some(7), &merged), "label 5: merged into label 7");
        assert_eq!(text(Some("silt"), None, &merged), "label 5: no longer merged into label 6");
        assert_eq!(text(None, None, &merged), "label 5: no name, no longer merged into label 6");
        assert_eq!(text(Some("silt"), Some(6), &merged), "label 5: as it was");
    }
}
