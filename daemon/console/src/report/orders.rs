//! The orders of a dive: what was ordered, by whom, and what became of it.

use super::dive::{Dive, DiveVehicle};
use super::order_step::{OrderKey, OrderStep};
use super::{Escaped, unix_s, words};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::{Exemplar, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_surface::state::VehicleState;
use serde_json::Value;
use std::fmt::Write;

/// The longest content of an order that is told whole, bytes.
const MAX_CONTENT: usize = 2000;

impl OrderStep {
    /// The status with its reason, for people.
    fn told(&self) -> String {
        let reason = if self.reason.is_empty() { String::new() } else { format!(": {}", self.reason) };
        let own = if self.is_own { ", by the vehicle's own record alone" } else { "" };
        format!("{}{reason}{own}", words::status(self.status))
    }
}

/// The time from an order to a moment.
fn after(dive: &Dive, given_s: f64, at_s: f64) -> String {
    dive.lasted_tenths((at_s - given_s).max(0.0))
}

impl DiveVehicle {
    /// Notes a status that the surface recorded.
    pub(super) fn take_order(&mut self, message: &OrderStatus) {
        let mut step = OrderStep::of(message);
        let way = self.orders.entry((message.slot.clone(), message.version)).or_default();
        // The first status was written when the order was given; later ones work that moment out from the mission's time.
        step.given_s = way.first().map_or(step.given_s, |first| first.given_s);
        // The next file of a record repeats the last status.
        if way.last().is_none_or(|last| last.status != step.status) {
            way.push(step);
        }
    }

    /// Notes a decision that the vehicle recorded: when it was made and, where the surface learned of none, what it was.
    pub(super) fn take_decision(&mut self, message: &OrderStatus) {
        let order = (message.slot.clone(), message.version);
        let Some(way) = self.orders.get_mut(&order) else { return };
        let decision = OrderStep { is_own: true, ..OrderStep::of(message) };
        self.own.decided_s.insert(order, decision.at_s);
        let Some(last) = way.last().filter(|last| !last.is_end()) else { return };
        way.push(OrderStep { given_s: last.given_s, ..decision });
    }

    /// When the images that an order asks for came in, in a clause; empty if none did, or it asks for none.
    fn images_received(&self, order: &OrderKey, given_s: f64) -> String {
        let labels = self.labels_of_images(order).unwrap_or_default();
        let is_asked = |image: &Exemplar| image.requested && labels.contains(&image.label.into());
        let arrived = self.exemplars.iter().filter(|(at_s, image)| *at_s >= given_s && is_asked(image));
        let first = arrived.map(|(at_s, _)| *at_s).reduce(f64::min);
        first.map_or_else(String::new, |at_s| format!("; image received {}", utc_text(at_s)))
    }

    /// Why an order that has no end has none, as far as a later one of its kind tells it.
    fn overtaken(&self, (slot, version): &OrderKey) -> Option<String> {
        let later = self.orders.range((slot.clone(), version + 1)..).take_while(|((other, _), _)| other == slot);
        let applied = |way: &Vec<OrderStep>| way.last().is_some_and(|last| last.status == OrderStatus::APPLIED);
        let ((_, by), _) = later.into_iter().find(|(_, way)| applied(way))?;
        let given_s = self.orders.get(&(slot.clone(), *by))?.last()?.given_s;
        Some(format!("the order of {} replaced it", utc_text(given_s)))
    }

    /// Whether a later order of the kind took the place of one that has no end.
    pub(super) fn is_replaced(&self, order: &OrderKey, way: &[OrderStep]) -> bool {
        !way.last().is_some_and(OrderStep::is_end) && self.overtaken(order).is_some()
    }

    /// The source of the events about its modes: on board or, without its own record, as they were reported.
    pub(super) fn mode_source(&self) -> &'static str {
        if self.own.runs_s.is_empty() { "mode" } else { "mode, on board" }
    }

    /// The orders but for position fixes, which the surface gives by itself.
    pub(super) fn orders_of_people(&self) -> impl Iterator<Item = (&OrderKey, &Vec<OrderStep>)> {
        self.orders.iter().filter(|((slot, _), _)| slot != SlotId::Fix.name())
    }

    /// The labels of which an order asks for images.
    pub(super) fn labels_of_images(&self, order: &OrderKey) -> Option<Vec<u64>> {
        let content: Value = serde_json::from_str(&self.given.get(order)?.content).ok()?;
        content.get("labels")?.as_array().map(|labels| labels.iter().filter_map(Value::as_u64).collect())
    }

    /// An order of the budget without what the one before it said too; any other order as it is.
    fn changed(&self, (slot, version): &OrderKey, given: &Order) -> Order {
        let members = |order: &Order| serde_json::from_str::<serde_json::Map<String, Value>>(&order.content).ok();
        let before = self.given.range((slot.clone(), 0)..(slot.clone(), *version)).next_back();
        let before = before.filter(|_| slot == SlotId::Budget.name()).and_then(|(_, before)| members(before));
        let Some((before, mut now)) = before.zip(members(given)) else { return given.clone() };
        now.retain(|name, value| before.get(name) != Some(value));
        match now.is_empty() {
            true => given.clone(),
            false => Order { content: Value::Object(now).to_string(), ..given.clone() },
        }
    }

    /// What such an order says, in words.
    pub(super) fn content(&self, state: &VehicleState, order @ (slot, version): &OrderKey) -> Option<String> {
        let given = self.given.get(order)?;
        let labels = |version: &u32| self.labels_of_images(&(slot.clone(), *version));
        // An order of images has all that are awaited.
        let before = self.given.range(..order.clone()).next_back().filter(|((other, _), _)| other == slot);
        let before = before.and_then(|((_, version), _)| labels(version)).unwrap_or_default();
        let title =
            |label: u64| u8::try_from(label).map_or_else(|_| label.to_string(), |l| words::label(&state.label_book, l));
        let named = |labels: Vec<u64>| labels.into_iter().map(title).collect::<Vec<_>>().join(", ");
        let of_images = labels(version).map(|labels| {
            let (awaited, new): (Vec<u64>, Vec<u64>) = labels.iter().partition(|label| before.contains(label));
            match (new.is_empty(), awaited.is_empty()) {
                (true, true) => "no image is asked for any more".to_owned(),
                (true, false) => format!("images of {}, asked for before, again", named(awaited)),
                (false, true) => format!("images of {}", named(new)),
                (false, false) => format!("images of {}, beside those of {}", named(new), named(awaited)),
            }
        });
        Some(of_images.unwrap_or_else(|| words::content(&state.label_book, &self.changed(order, given))))
    }
}

impl Dive {
    /// Who gave an order to a vehicle, and what it was: by the log, which has the words of the page, or else by its content.
    pub(super) fn ordered(&self, state: &VehicleState, vehicle: &DiveVehicle, order: &OrderKey) -> (String, String) {
        let known = vehicle.given.get(order).zip(vehicle.content(state, order));
        let Some((given, content)) = known else { return (String::new(), "not recorded".to_owned()) };
        let given_s = unix_s(&given.header.stamp);
        // Several orders may be given within a second: the words are those of the nearest one in this slot.
        let logged = self.events.iter().filter_map(|(at_s, event)| {
            let is_of_it = event.vehicle == state.name || event.vehicle.is_empty();
            let (by, words) = said(&event.text, |words| words.starts_with(&given.slot) || words == content)?;
            (event.source == "order" && is_of_it).then_some(((at_s - given_s).abs(), by, words))
        });
        let nearest = logged.filter(|(away_s, ..)| *away_s < 0.5).min_by(|a, b| a.0.total_cmp(&b.0));
        let (by, words) = nearest.map_or((String::new(), content.clone()), |(_, by, words)| (by, words));
        let content = match self.is_of_larger(state, given) {
            true => content.replacen("images of", "a larger image of", 1),
            false => content,
        };
        // The log has places in a few words.
        let words = if content.len() > MAX_CONTENT { words } else { content };
        let by = match (given.principal.is_empty(), by.is_empty()) {
            (false, _) => given.principal.clone(),
            (true, true) if self.settings.is_rehearsal() => "the script of the rehearsal".to_owned(),
            // It asks a vehicle that was restarted again for what is awaited.
            (true, true) => "the surface itself".to_owned(),
            (true, false) => by,
        };
        (words::author(&by).to_owned(), words)
    }

    /// Whether an order asks for a larger version of an image, which the log alone says.
    pub(super) fn is_of_larger(&self, state: &VehicleState, given: &Order) -> bool {
        let is_it = |words: &str| words.starts_with("larger image requested: ");
        let is_near = |at_s: f64| (at_s - unix_s(&given.header.stamp)).abs() < 0.5;
        let of_it = self.events.iter().filter(|(at_s, event)| is_near(*at_s) && event.vehicle == state.name);
        given.slot == SlotId::Requests.name()
            && of_it.into_iter().any(|(_, event)| event.source == "order" && said(&event.text, is_it).is_some())
    }

    /// The orders with their ends, the first one first.
    pub(super) fn orders_table(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        if vehicle.orders_of_people().next().is_none() {
            return;
        }
        *page += "<h3>Orders</h3>\n<p>Labels have the names that they had at the end.</p>\n<table class=\"wide\"><thead><tr><th>order</th><th>what was ordered</th><th>by</th><th>given (UTC)</th><th>outcome</th><th>decided on board after</th><th>known at the surface after</th></tr></thead>\n";
        let mut orders: Vec<(&OrderKey, &OrderStep)> =
            vehicle.orders_of_people().filter_map(|(order, way)| Some((order, way.last()?))).collect();
        orders.sort_by(|a, b| a.1.given_s.total_cmp(&b.1.given_s));
        for (order @ (slot, _), last) in orders {
            let (by, ordered) = self.ordered(state, vehicle, order);
            let known = Some(last).filter(|last| last.is_end() && !last.is_own).map(|last| last.at_s);
            let [on_board, known] = [vehicle.own.decided_s.get(order).copied(), known]
                .map(|at_s| at_s.map_or_else(|| "not known".to_owned(), |at_s| after(self, last.given_s, at_s)));
            let end = vehicle.overtaken(order).filter(|_| !last.is_end());
            let end = end.map_or_else(|| last.told(), |by| format!("{}; {by}", last.told()));
            let end = end + &vehicle.images_received(order, last.given_s);
            let _ = writeln!(
                page,
                "<tr><td>{}</td><td class=\"o\">{}</td><td>{}</td><td class=\"t\">{}</td><td>{}</td><td>{on_board}</td><td>{known}</td></tr>",
                Escaped(words::order(slot, &ordered)),
                Escaped(&ordered),
                Escaped(&by),
                utc_text(last.given_s),
                Escaped(&end),
            );
        }
        *page += "</table>\n";
    }

    /// What the vehicle was steered by over time, and its modes.
    pub(super) fn steering(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let modes = self.modes(state, vehicle).map(|(at_s, event)| (at_s, words::event(&state.label_book, event)));
        let steers = |slot: &str| ![SlotId::Requests.name(), SlotId::Budget.name()].contains(&slot);
        let orders = vehicle.orders_of_people().filter(|((slot, _), _)| steers(slot));
        let orders = orders.filter_map(|(order, way)| {
            let last = way.last()?;
            let end = match vehicle.own.decided_s.get(order) {
                Some(at_s) => format!(", on board after {}", after(self, last.given_s, *at_s)),
                None if last.is_end() => {
                    format!(", known at the surface after {}", after(self, last.given_s, last.at_s))
                }
                None => vehicle.overtaken(order).map_or_else(String::new, |by| format!("; {by}")),
            };
            Some((last.given_s, format!("ordered: {}; {}{end}", self.ordered(state, vehicle, order).1, last.told())))
        });
        let modes: Vec<(f64, String)> = modes.collect();
        let has_modes = !modes.is_empty();
        let mut steps: Vec<(f64, String)> = modes.into_iter().chain(orders).collect();
        if steps.is_empty() {
            return;
        }
        // A surface logs changes alone.
        if has_modes && vehicle.own.runs_s.is_empty() {
            let unknown = "its mode from here to the first change below is not known";
            steps.push((self.surface_s.0, unknown.to_owned()));
        }
        steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        *page += "<h3>Orders that steer, and modes, over time</h3>\n<table><thead><tr><th>time (UTC)</th><th>what</th><th>cells on the map by \
                  then</th></tr></thead>\n";
        for (at_s, text) in &steps {
            let cells = vehicle.maps.iter().rev().find(|maps| maps.at_s <= *at_s).map_or(0, |maps| maps.cells);
            let _ = writeln!(
                page,
                "<tr><td class=\"t\">{}</td><td>{}</td><td class=\"n\">{cells}</td></tr>",
                utc_text(*at_s),
                Escaped(text)
            );
        }
        *page += "</table>\n";
    }
}

/// The author and the words of an entry of the log, of which the words are to be recognised.
pub(super) fn said(text: &str, is_it: impl Fn(&str) -> bool) -> Option<(String, String)> {
    let (by, words) = text.split_once(": ").filter(|(_, words)| is_it(words)).unwrap_or(("", text));
    is_it(words).then(|| (by.to_owned(), words.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::scenecast_msgs::Event;

    fn status(version: u32, status: u8, s: i64) -> OrderStatus {
        let mut message = OrderStatus { slot: "fence".into(), version, status, ..OrderStatus::default() };
        (message.header.stamp, message.given) = (Time::from_nanos(s * 1_000_000_000), Time::from_nanos(1_000_000_000));
        message
    }

    #[test]
    fn an_order_was_given_when_its_first_status_says() {
        let mut vehicle = DiveVehicle::default();
        vehicle.take_order(&status(1, OrderStatus::QUEUED, 1));
        let later = OrderStatus { given: Time::from_nanos(3_000_000_000), ..status(1, OrderStatus::APPLIED, 4) };
        vehicle.take_order(&later);
        let last = vehicle.orders[&("fence".to_owned(), 1)].last().unwrap();
        assert_eq!((last.given_s, last.at_s), (1.0, 4.0));
    }

    #[test]
    fn an_order_of_images_tells_the_new_ones_first() {
        let mut vehicle = DiveVehicle::default();
        let slot = SlotId::Requests.name().to_owned();
        for (version, labels) in [(1, "[4]"), (2, "[4, 7]"), (5, "[7]"), (6, "[]")] {
            let content = format!("{{\"labels\": {labels}}}");
            vehicle
                .given
                .insert((slot.clone(), version), Order { slot: slot.clone(), version, content, ..Order::default() });
        }
        let told = |version: u32| vehicle.content(&VehicleState::default(), &(slot.clone(), version)).unwrap();
        assert_eq!(told(1), "images of label 4");
        assert_eq!(told(2), "images of label 7, beside those of label 4");
        assert_eq!(told(5), "images of label 7, asked for before, again");
        assert_eq!(told(6), "no image is asked for any more");
    }

    #[test]
    fn the_first_mode_of_a_surface_alone_is_not_known() {
        let (mut dive, state, mut vehicle) = (Dive::default(), VehicleState::default(), DiveVehicle::default());
        let mode =
            |source: &str| (5.0, Event { source: source.to_owned(), text: "surveying".to_owned(), ..Event::default() });
        dive.events = vec![mode("mode"), mode("mode, on board")];
        let told = |vehicle: &DiveVehicle| {
            let mut page = String::new();
            dive.steering(&mut page, &state, vehicle);
            page.contains("surveying").then(|| page.contains("to the first change below is not known"))
        };
        assert_eq!(told(&vehicle), Some(true));
        vehicle.own.runs_s = vec![(0.0, 9.0)];
        assert_eq!(told(&vehicle), Some(false));
    }

    #[test]
    fn what_only_the_vehicle_recorded_ends_an_order() {
        let mut vehicle = DiveVehicle::default();
        for (version, state) in [(1, OrderStatus::ON_AIR), (2, OrderStatus::REFUSED)] {
            vehicle.take_order(&status(version, state, 2));
            vehicle.take_decision(&status(version, OrderStatus::APPLIED, 5));
        }
        vehicle.take_decision(&status(3, OrderStatus::APPLIED, 5));
        let last = |version| vehicle.orders[&("fence".to_owned(), version)].last().unwrap();
        assert_eq!(last(1).told(), "applied, by the vehicle's own record alone");
        assert_eq!((last(1).at_s, last(1).given_s), (5.0, 1.0));
        assert_eq!(vehicle.own.decided_s.len(), 2);
        assert_eq!(last(2).told(), "refused");
        assert_eq!(vehicle.orders.len(), 2, "the surface did not give a third one");
    }

    #[test]
    fn a_later_order_tells_why_one_has_no_end() {
        let (mut vehicle, order) = (DiveVehicle::default(), ("fence".to_owned(), 7));
        vehicle.take_order(&status(7, OrderStatus::ON_AIR, 2));
        assert_eq!(vehicle.overtaken(&order), None);
        vehicle.take_order(&status(9, OrderStatus::APPLIED, 2));
        assert_eq!(vehicle.overtaken(&order).as_deref(), Some("the order of 1970-01-01T00:00:01Z replaced it"));
    }
}
