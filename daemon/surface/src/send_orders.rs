//! The surface sends its vehicles orders and requests for exemplars.

use super::exemplar_cache::{ExemplarCache, RequestKind};
use super::log::LogKind;
use super::orders::{AreasOrder, DestinationOrder, FenceOrder, LimitsOrder, SettingsOrder, hundredths};
use super::refusal::{OrderRefusal, Weighed};
use super::{Surface, SurfaceOutput, VehicleRecord};
use scenecast_protocol::directive::{Constraints, Fix, OrderStatus, Slot, SlotId, SlotProgress, Utility};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;

impl Surface {
    /// Sends weights of labels, of unexplored cells and of curiosity, each from -1 to 1.
    pub fn set_utility(
        &mut self,
        vehicle: Address,
        weights: &BTreeMap<u8, f64>,
        (exploration, curiosity): (f64, f64),
        now: Instant,
    ) -> Result<u16, OrderRefusal> {
        let (utility, highest) = self.utility_of(vehicle, weights, (exploration, curiosity))?;
        let record = self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?;
        record.orders.utility = utility.clone();
        record.orders.weighed = highest;
        self.issue(vehicle, Slot::Utility(utility), now)
    }

    /// The utility of these weights, and the highest label that they may name.
    pub fn utility_of(
        &self,
        vehicle: Address,
        weights: &BTreeMap<u8, f64>,
        (exploration, curiosity): (f64, f64),
    ) -> Result<(Utility, u8), OrderRefusal> {
        let known = match weights.is_empty() {
            true => BTreeMap::new(),
            false => self.labels_for_orders(vehicle)?,
        };
        let mut utility = Utility {
            exploration: hundredths(Weighed::Exploration, exploration)?,
            curiosity: hundredths(Weighed::Curiosity, curiosity)?,
            epoch: self.records.get(&vehicle).ok_or(IssueError::NoVehicle)?.epoch,
            ..Utility::default()
        };
        // A label may have lost its last cell since the operator looked at the map.
        let reported = self.status(vehicle).map_or(0, |(status, _)| status.labels);
        let highest = known.keys().last().map_or(reported, |&highest| highest.max(reported));
        for (&label, &weight) in weights {
            if !(1..=highest).contains(&label) {
                return Err(OrderRefusal::NotOnMap(label));
            }
            let weight = hundredths(Weighed::Label(label), weight)?;
            if weight != 0 {
                utility.weights.insert(label, weight);
            }
        }
        Ok((utility, highest))
    }

    /// Orders a vehicle to hold, or to continue.
    pub fn set_hold(&mut self, vehicle: Address, hold: bool, now: Instant) -> Result<u16, OrderRefusal> {
        self.set_order(vehicle, Constraints { hold, abort: false }, now)
    }

    /// Orders a vehicle to hold, to abort, or to continue.
    pub fn set_order(&mut self, vehicle: Address, order: Constraints, now: Instant) -> Result<u16, OrderRefusal> {
        self.issue(vehicle, Slot::Constraints(order), now)
    }

    /// Sends a fence with keep-outs and return point. They replace the last ones.
    pub fn set_fence(&mut self, vehicle: Address, order: &FenceOrder, now: Instant) -> Result<u16, OrderRefusal> {
        let fence = order.read()?;
        let version = self.issue(vehicle, Slot::Fence(fence.clone()), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.orders.fence.sent = Some(fence);
        Ok(version)
    }

    /// Sends limits. They replace the last ones.
    pub fn set_limits(&mut self, vehicle: Address, order: &LimitsOrder, now: Instant) -> Result<u16, OrderRefusal> {
        let limits = order.read()?;
        let version = self.issue(vehicle, Slot::Limits(limits), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.orders.limits.sent = Some(limits);
        Ok(version)
    }

    /// Sends weighted areas. They replace the last ones.
    pub fn set_areas(&mut self, vehicle: Address, order: &AreasOrder, now: Instant) -> Result<u16, OrderRefusal> {
        let areas = order.read()?;
        let version = self.issue(vehicle, Slot::Areas(areas.clone()), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.orders.areas.sent = Some(areas);
        Ok(version)
    }

    /// Sends a vehicle to a place before it resumes its survey, or withdraws that order.
    pub fn set_destination(
        &mut self,
        vehicle: Address,
        order: &DestinationOrder,
        now: Instant,
    ) -> Result<u16, OrderRefusal> {
        let destination = order.read()?;
        let version = self.issue(vehicle, Slot::Destination(destination), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.orders.destination.sent = Some(destination);
        Ok(version)
    }

    /// Changes settings of a vehicle. Those that the order does not name stay as they are there.
    pub fn set_settings(&mut self, vehicle: Address, order: &SettingsOrder, now: Instant) -> Result<u16, OrderRefusal> {
        let view = self.link.vehicle(vehicle).ok_or(IssueError::NoVehicle)?;
        let order = order.read(view.layers())?;
        let last = self.order_status(vehicle, SlotId::Settings);
        let settings =
            self.records.get(&vehicle).ok_or(IssueError::NoVehicle)?.orders.settings.next_order(&order, last);
        let version = self.issue(vehicle, Slot::Settings(settings), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.orders.settings.handle_sent(settings, last);
        Ok(version)
    }

    /// The order status of a slot.
    fn order_status(&self, vehicle: Address, slot: SlotId) -> Option<OrderStatus> {
        self.link.vehicle(vehicle)?.slots().find(|s| s.id == slot).map(|s| s.status)
    }

    pub fn send_fix(&mut self, vehicle: Address, fix: Fix, now: Instant) -> Result<u16, OrderRefusal> {
        self.issue(vehicle, Slot::Fix(fix), now)
    }

    pub(super) fn issue(&mut self, vehicle: Address, slot: Slot, now: Instant) -> Result<u16, OrderRefusal> {
        let replaced = self.replaced(vehicle, slot.id());
        let version = self.link.issue(vehicle, slot, now)?;
        replaced.iter().for_each(|text| self.log_fact(vehicle, LogKind::Answer, text, now));
        self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        Ok(version)
    }

    /// Gives a withdrawn order again, as a new one.
    pub fn give_again(&mut self, vehicle: Address, slot: SlotId, now: Instant) -> Result<u16, OrderRefusal> {
        let version = self.link.give_again(vehicle, slot, now)?;
        self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        version.ok_or(OrderRefusal::NotWithdrawn(slot))
    }

    /// Sends the orders that a vehicle has lost again, except one to resume; returns their slots.
    pub fn restore_lost(&mut self, vehicle: Address, now: Instant) -> Result<Vec<SlotId>, OrderRefusal> {
        let restored = self.link.restore_lost(vehicle, now)?;
        let names: Vec<&str> = restored.iter().map(|id| id.name()).collect();
        if names.is_empty() {
            return Err(OrderRefusal::NothingLost);
        }
        self.log_fact(vehicle, LogKind::Answer, &format!("sent again: {}", names.join(", ")), now);
        self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        Ok(restored)
    }

    /// Takes a vehicle over from another surface.
    pub fn take_over(&mut self, vehicle: Address, now: Instant) -> Result<(), OrderRefusal> {
        self.link.take_over(vehicle, now)?;
        self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        Ok(())
    }

    /// Requests an exemplar of a label.
    pub fn request_exemplar(
        &mut self,
        vehicle: Address,
        label: u8,
        kind: RequestKind,
        now: Instant,
    ) -> Result<u16, OrderRefusal> {
        if !self.labels_for_orders(vehicle)?.contains_key(&label) {
            return Err(OrderRefusal::NotOnMap(label));
        }
        self.change_requests(vehicle, |cache| cache.request(label, kind, now), now)
    }

    /// Withdraws the request for an exemplar of a label.
    pub fn cancel_exemplar(&mut self, vehicle: Address, label: u8, now: Instant) -> Result<u16, OrderRefusal> {
        self.change_requests(vehicle, |cache| cache.cancel(label), now)
    }

    fn change_requests(
        &mut self,
        vehicle: Address,
        change: impl FnOnce(&mut ExemplarCache) -> Result<(), OrderRefusal>,
        now: Instant,
    ) -> Result<u16, OrderRefusal> {
        let record = self.records.get(&vehicle).ok_or(IssueError::NoVehicle)?;
        let mut cache = record.exemplars.clone();
        change(&mut cache)?;
        let version = self.issue(vehicle, Slot::Requests(cache.wanted(record.epoch)), now)?;
        self.records.get_mut(&vehicle).ok_or(IssueError::NoVehicle)?.exemplars = cache;
        Ok(version)
    }

    /// A restarted vehicle has lost the requests, so they are sent again.
    pub(super) fn request_again(&mut self, vehicle: Address, now: Instant) {
        let wanted = self.records.get(&vehicle).map(VehicleRecord::wanted).filter(|r| !r.wanted.is_empty());
        if let Some(requests) = wanted {
            // The same order was valid before.
            let _ = self.issue(vehicle, Slot::Requests(requests), now);
        }
    }

    pub(super) fn handle_decision(&mut self, vehicle: Address, slot: SlotId, now: Instant) {
        let is_void = |status| matches!(status, OrderStatus::Refused(_) | OrderStatus::Withdrawn(_));
        let refused = |s: &SlotProgress| s.id == slot && is_void(s.status);
        let is_refused = self.link.vehicle(vehicle).is_some_and(|v| v.slots().any(refused));
        if let Some(record) = self.records.get_mut(&vehicle).filter(|_| slot == SlotId::Requests && is_refused) {
            record.exemplars.handle_refusal(now);
        }
    }
}
