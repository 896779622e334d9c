//! The orders to a vehicle: as given, and as in force.

use scenecast_protocol::directive::{Areas, Destination, Fence, Limits, OrderStatus, Settings, SlotId, Utility};
use scenecast_protocol::map::MAX_LABEL;

/// The last order of a kind that was sent, and the one in force.
#[derive(Debug, Clone, PartialEq)]
pub struct SentOrder<T> {
    /// The last one that was sent.
    pub sent: Option<T>,
    /// The one that the vehicle has applied, with its version.
    pub in_force: Option<(u16, T)>,
}

impl<T> Default for SentOrder<T> {
    fn default() -> Self {
        Self { sent: None, in_force: None }
    }
}

/// The last orders to a vehicle that were sent, and those in force.
#[derive(Debug)]
pub struct GivenOrders {
    /// The last utility that was sent, and the highest label at that time.
    pub utility: Utility,
    pub weighed: u8,
    pub fence: SentOrder<Fence>,
    pub limits: SentOrder<Limits>,
    pub areas: SentOrder<Areas>,
    pub destination: SentOrder<Destination>,
    /// The settings that were ordered, and those in force.
    pub settings: SettingsRecord,
}

impl Default for GivenOrders {
    fn default() -> Self {
        Self {
            utility: Utility::default(),
            weighed: MAX_LABEL,
            fence: SentOrder::default(),
            limits: SentOrder::default(),
            areas: SentOrder::default(),
            destination: SentOrder::default(),
            settings: SettingsRecord::default(),
        }
    }
}

impl GivenOrders {
    /// Why a vehicle holds that has nothing left to do, as a text.
    pub(super) fn end_of_survey(&self) -> &'static str {
        let has_areas = self.areas.sent.as_ref().is_some_and(|areas| !areas.0.is_empty());
        let has_interests = has_areas || !self.utility.weights.is_empty();
        if has_interests { "nothing of interest is left" } else { "the survey is complete" }
    }

    /// Another epoch voids the weights of labels.
    pub(super) fn begin_epoch(&mut self, epoch: u8) {
        (self.utility, self.weighed) = (Utility { epoch, ..Utility::default() }, MAX_LABEL);
    }

    /// The vehicle has applied the version of a slot that was sent last.
    pub fn handle_applied(&mut self, slot: SlotId, version: u16) {
        match slot {
            SlotId::Fence => self.fence.in_force = self.fence.sent.clone().map(|fence| (version, fence)),
            SlotId::Limits => self.limits.in_force = self.limits.sent.map(|limits| (version, limits)),
            SlotId::Areas => self.areas.in_force = self.areas.sent.clone().map(|areas| (version, areas)),
            SlotId::Destination => self.destination.in_force = self.destination.sent.map(|place| (version, place)),
            _ => {}
        }
    }
}

/// The ordered settings of a vehicle. Each order contains everything that this surface has ordered, so that a newer one
/// can replace one that the vehicle never received.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SettingsRecord {
    requested: Settings,
    in_force: Settings,
    /// An order was replaced before its fate was known.
    is_unsure: bool,
}

impl SettingsRecord {
    /// Everything that this surface has ordered.
    pub fn requested(&self) -> &Settings {
        &self.requested
    }

    /// The requested settings, those that the vehicle applied last, and whether an order was replaced before its fate was known.
    pub(super) fn parts(&self) -> (Settings, Settings, bool) {
        (self.requested, self.in_force, self.is_unsure)
    }

    /// The record with these [`Self::parts`].
    pub(super) fn of_parts(requested: Settings, in_force: Settings, is_unsure: bool) -> Self {
        Self { requested, in_force, is_unsure }
    }

    /// The settings that the vehicle has applied, as far as this surface ordered them; `None` while that is unknown.
    pub fn in_force(&self) -> Option<&Settings> {
        (!self.is_unsure).then_some(&self.in_force)
    }

    /// The complete settings to send for an order: the earlier orders, unless they were refused, and the new one.
    pub(super) fn next_order(&self, order: &Settings, last: Option<OrderStatus>) -> Settings {
        let base = if matches!(last, Some(OrderStatus::Refused(_))) { &self.in_force } else { &self.requested };
        base.then(order)
    }

    /// The settings were sent. `last` is the status of the order that they replace.
    pub(super) fn handle_sent(&mut self, settings: Settings, last: Option<OrderStatus>) {
        self.is_unsure |= matches!(last, Some(OrderStatus::OnAir | OrderStatus::Received));
        self.requested = settings;
    }

    /// The vehicle reports settings of another surface, and this one has ordered none.
    pub(super) fn handle_reported(&mut self, settings: Settings) {
        *self = Self { requested: settings, in_force: settings, is_unsure: false };
    }

    /// The vehicle has decided about the last order.
    pub(super) fn handle_decision(&mut self, status: OrderStatus) {
        if status == OrderStatus::Applied {
            (self.in_force, self.is_unsure) = (self.requested, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SettingsOrder;
    use scenecast_protocol::directive::RefusalReason;
    use scenecast_protocol::map::LayerSet;

    #[test]
    fn settings_in_force_are_those_that_the_vehicle_applied() {
        let typed = |json: &str| serde_json::from_str::<SettingsOrder>(json).unwrap();
        let order = |json: &str| typed(json).read(&LayerSet::default()).unwrap();
        let mut record = SettingsRecord::default();
        let send = |record: &mut SettingsRecord, json: &str, last| {
            let settings = record.next_order(&order(json), last);
            record.handle_sent(settings, last);
        };
        send(&mut record, r#"{"alpha": 0.5}"#, None);
        assert_eq!(record.in_force(), Some(&Settings::default()));
        send(&mut record, r#"{"gamma": 0.1}"#, Some(OrderStatus::Queued));
        record.handle_decision(OrderStatus::Applied);
        assert_eq!(
            record.in_force(),
            Some(&order(r#"{"alpha": 0.5, "gamma": 0.1}"#)),
            "the first was never sent alone"
        );
        send(&mut record, r#"{"layers": "confidence,depth"}"#, Some(OrderStatus::Applied));
        send(&mut record, r#"{"beta": 1}"#, Some(OrderStatus::Received));
        assert_eq!(record.in_force(), None, "the vehicle may follow the layers already");
        let refused = OrderStatus::Refused(RefusalReason::OutOfRange);
        record.handle_decision(refused);
        send(&mut record, r#"{"alpha": 0}"#, Some(refused));
        assert_eq!(
            record.requested(),
            &order(r#"{"alpha": 0, "gamma": 0.1}"#),
            "what was refused is not asked for again"
        );
        record.handle_decision(OrderStatus::Applied);
        assert_eq!(record.in_force(), Some(record.requested()));
    }
}
