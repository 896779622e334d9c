//! The surface sends its vehicles orders.

use super::orders::{FenceOrder, LimitsOrder};
use super::settings::SettingsOrder;
use super::{Surface, SurfaceOutput};
use scenecast_protocol::directive::{Constraints, Fix, OrderStatus, Slot, SlotId, Utility};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;

impl Surface {
    /// Sends weights of labels, of unexplored cells and of curiosity, each from -1 to 1. The error is
    /// one line for the operator.
    pub fn set_utility(
        &mut self,
        vehicle: Address,
        weights: &BTreeMap<u8, f64>,
        (exploration, curiosity): (f64, f64),
        now: Instant,
    ) -> Result<u16, String> {
        let known = match weights.is_empty() {
            true => BTreeMap::new(),
            false => self.labels_for_orders(vehicle)?,
        };
        let hundredths = |what: &str, w: f64| {
            let ok = w.is_finite() && (-1.0..=1.0).contains(&w);
            ok.then_some((w * 100.0).round() as i8).ok_or(format!("{what} {w} is not within -1 to 1"))
        };
        let mut utility = Utility {
            exploration: hundredths("exploration", exploration)?,
            curiosity: hundredths("curiosity", curiosity)?,
            ..Utility::default()
        };
        for (&label, &weight) in weights {
            if !known.contains_key(&label) {
                return Err(format!("label {label} is not on the map"));
            }
            let weight = hundredths(&format!("weight of label {label}:"), weight)?;
            if weight != 0 {
                utility.weights.insert(label, weight);
            }
        }
        let record = self.records.get_mut(&vehicle).ok_or("no such vehicle")?;
        utility.epoch = record.epoch;
        record.utility = utility.clone();
        self.issue(vehicle, Slot::Utility(utility), now)
    }

    /// Orders a vehicle to hold, or to continue.
    pub fn set_hold(&mut self, vehicle: Address, hold: bool, now: Instant) -> Result<u16, String> {
        self.set_order(vehicle, Constraints { hold, abort: false }, now)
    }

    /// Orders a vehicle to hold, to abort, or to continue.
    pub fn set_order(&mut self, vehicle: Address, order: Constraints, now: Instant) -> Result<u16, String> {
        self.issue(vehicle, Slot::Constraints(order), now)
    }

    /// Sends a fence with keep-outs and return point. They replace the last ones.
    pub fn set_fence(&mut self, vehicle: Address, order: &FenceOrder, now: Instant) -> Result<u16, String> {
        let fence = order.read()?;
        let version = self.issue(vehicle, Slot::Fence(fence.clone()), now)?;
        self.records.get_mut(&vehicle).ok_or("no such vehicle")?.fence.sent = Some(fence);
        Ok(version)
    }

    /// Sends limits. They replace the last ones.
    pub fn set_limits(&mut self, vehicle: Address, order: &LimitsOrder, now: Instant) -> Result<u16, String> {
        let limits = order.read()?;
        let version = self.issue(vehicle, Slot::Limits(limits), now)?;
        self.records.get_mut(&vehicle).ok_or("no such vehicle")?.limits.sent = Some(limits);
        Ok(version)
    }

    /// Changes settings of a vehicle. Those that the order does not name stay as they are there.
    pub fn set_settings(&mut self, vehicle: Address, order: &SettingsOrder, now: Instant) -> Result<u16, String> {
        let view = self.link.vehicle(vehicle).ok_or("no such vehicle")?;
        let order = order.read(view.layers())?;
        let last = self.order_status(vehicle, SlotId::Settings);
        let settings = self.records.get(&vehicle).ok_or("no such vehicle")?.settings.next_order(&order, last);
        let version = self.issue(vehicle, Slot::Settings(settings), now)?;
        self.records.get_mut(&vehicle).ok_or("no such vehicle")?.settings.handle_sent(settings, last);
        Ok(version)
    }

    /// The order status of a slot.
    fn order_status(&self, vehicle: Address, slot: SlotId) -> Option<OrderStatus> {
        self.link.vehicle(vehicle)?.slots().find(|s| s.id == slot).map(|s| s.status)
    }

    pub fn send_fix(&mut self, vehicle: Address, fix: Fix, now: Instant) -> Result<u16, String> {
        self.issue(vehicle, Slot::Fix(fix), now)
    }

    pub(super) fn issue(&mut self, vehicle: Address, slot: Slot, now: Instant) -> Result<u16, String> {
        let version = self.link.issue(vehicle, slot, now).map_err(|e| e.to_string())?;
        self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        Ok(version)
    }
}
