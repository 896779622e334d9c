//! What was in force at the end of a dive, and what was still awaited.

use super::dive::{Dive, DiveVehicle};
use super::order_step::{OrderKey, OrderStep};
use super::{Escaped, words};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::{Event, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_surface::LogKind;
use scenecast_surface::state::{InForceKnowledge, VehicleState};
use serde_json::Value;
use std::collections::BTreeMap;

impl Dive {
    /// The orders that were in force at the end, beside what was configured.
    pub(super) fn in_force(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let passing = [SlotId::Requests.name(), SlotId::Fix.name()];
        let mut last: BTreeMap<&str, (&OrderKey, &OrderStep)> = BTreeMap::new();
        for (order, way) in vehicle.orders_of_people().filter(|((slot, _), _)| !passing.contains(&slot.as_str())) {
            if let Some(applied) = way.iter().rev().find(|step| step.status == OrderStatus::APPLIED) {
                last.insert(order.0.as_str(), (order, applied));
            }
        }
        let is_aborted = last
            .get(SlotId::Constraints.name())
            .is_some_and(|(order, _)| vehicle.content(state, order).is_some_and(|content| content == "abort"));
        last.retain(|slot, (order, _)| {
            let is_over = state.orders.in_force.get(*slot) == Some(&InForceKnowledge::None);
            !is_over && vehicle.content(state, order).is_none_or(|content| content != "resume")
        });
        let mut last: Vec<_> = last.into_iter().collect();
        last.sort_by(|a, b| a.1.1.given_s.total_cmp(&b.1.1.given_s));
        let rows: String = last
            .into_iter()
            .map(|(slot, (order, step))| {
                let (by, mut ordered) = self.ordered(state, vehicle, order);
                let given = utc_text(step.given_s);
                let kind = Escaped(words::order(slot, &ordered)).to_string();
                if slot == SlotId::Utility.name() {
                    ordered += &inherited(state, vehicle, order);
                }
                if is_aborted && slot == SlotId::Destination.name() {
                    ordered += "; the abort ended it";
                }
                let (ordered, by) = (Escaped(&ordered).to_string(), Escaped(&by).to_string());
                format!("<tr><td>{kind}</td><td>{ordered}</td><td class=\"t\">{given}</td><td>{by}</td></tr>\n")
            })
            .collect();
        let budget = state.status.as_ref().map_or_else(String::new, |status| {
            format!(
                " The vehicle kept to a budget of {} bit/s then, the surface to {}.",
                status.budget_bps, self.state.link.budget_bps
            )
        });
        *page += "<h3>In force at the end</h3>\n";
        *page += &match rows.is_empty() {
            true => format!("<p>No order was in force: all was as configured.{budget}</p>\n"),
            false => format!(
                "<p>The last order of each kind that the vehicle applied; all else was as configured.{budget}</p>\n<table><thead><tr><th>kind</th>\
                 <th>what was ordered</th><th>given (UTC)</th><th>by</th></tr></thead>\n{rows}</table>\n"
            ),
        };
        *page += &self.awaited_images(state, vehicle);
    }

    /// The images that the last order of them asked for and that have not arrived, in a paragraph.
    fn awaited_images(&self, state: &VehicleState, vehicle: &DiveVehicle) -> String {
        let slot = SlotId::Requests.name();
        let last = vehicle
            .orders_of_people()
            .filter(|((of, _), _)| of == slot)
            .filter_map(|(order, way)| Some((order, way.last()?)));
        let Some((order, last)) = last.max_by_key(|((_, version), _)| *version) else { return String::new() };
        // The record has no larger version of an image that it has.
        let has_come = |label: &u8| {
            let text = format!("image of label {label}");
            let is_it = |event: &Event| {
                event.source == LogKind::Image.name() && event.text == text && event.vehicle == state.name
            };
            let is_logged = self.events.iter().any(|(at_s, event)| *at_s >= last.given_s && is_it(event));
            is_logged || vehicle.exemplars.iter().any(|(at_s, image)| image.label == *label && *at_s >= last.given_s)
        };
        let awaited: Vec<String> = (vehicle.labels_of_images(order).into_iter().flatten())
            .filter_map(|label| u8::try_from(label).ok())
            .filter(|label| !has_come(label))
            .map(|label| words::label(&state.label_book, label))
            .collect();
        if awaited.is_empty() || last.status == OrderStatus::REFUSED || last.status == OrderStatus::WITHDRAWN {
            return String::new();
        }
        format!(
            "<p>Asked for at {} and not arrived since: images of {}.</p>\n",
            utc_text(last.given_s),
            Escaped(&awaited.join(", "))
        )
    }
}

/// The weights that labels took over from those of an order; empty where they are not known, as after a later order.
fn inherited(state: &VehicleState, vehicle: &DiveVehicle, order: &OrderKey) -> String {
    let is_last = vehicle.orders.keys().filter(|(slot, _)| *slot == order.0).max() == Some(order);
    let content = vehicle.given.get(order).and_then(|given| serde_json::from_str::<Value>(&given.content).ok());
    let Some(content) = content.filter(|_| is_last) else { return String::new() };
    let is_named = |label: u8| content["weights"].get(label.to_string()).is_some();
    let others = state.labels.iter().filter(|label| label.weight != 0.0 && !is_named(label.id));
    let others: Vec<String> =
        others.map(|label| format!("{}: {:.2}", words::label(&state.label_book, label.id), label.weight)).collect();
    match others.is_empty() {
        true => String::new(),
        false => format!("; labels that came later took over weights of these: {}", others.join(", ")),
    }
}
