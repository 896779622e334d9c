//! The surface requests exemplars of its vehicles.

use super::exemplar_cache::{ExemplarCache, RequestKind};
use super::{Surface, VehicleRecord};
use scenecast_protocol::directive::{OrderStatus, Slot, SlotId, SlotProgress};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;

impl Surface {
    /// Requests an exemplar of a label. The error is one line for the operator.
    pub fn request_exemplar(
        &mut self,
        vehicle: Address,
        label: u8,
        kind: RequestKind,
        now: Instant,
    ) -> Result<u16, String> {
        if !self.labels_for_orders(vehicle)?.contains_key(&label) {
            return Err(format!("label {label} is not on the map"));
        }
        self.change_requests(vehicle, |cache| cache.request(label, kind, now), now)
    }

    /// Withdraws the request for an exemplar of a label. The error is one line for the operator.
    pub fn cancel_exemplar(&mut self, vehicle: Address, label: u8, now: Instant) -> Result<u16, String> {
        self.change_requests(vehicle, |cache| cache.cancel(label), now)
    }

    fn change_requests(
        &mut self,
        vehicle: Address,
        change: impl FnOnce(&mut ExemplarCache) -> Result<(), String>,
        now: Instant,
    ) -> Result<u16, String> {
        let record = self.records.get(&vehicle).ok_or("no such vehicle")?;
        let mut cache = record.exemplars.clone();
        change(&mut cache)?;
        let version = self.issue(vehicle, Slot::Requests(cache.wanted(record.epoch)), now)?;
        self.records.get_mut(&vehicle).ok_or("no such vehicle")?.exemplars = cache;
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
        let refused = |s: &SlotProgress| s.id == slot && matches!(s.status, OrderStatus::Refused(_));
        let is_refused = self.link.vehicle(vehicle).is_some_and(|v| v.slots().any(refused));
        if let Some(record) = self.records.get_mut(&vehicle).filter(|_| slot == SlotId::Requests && is_refused) {
            record.exemplars.handle_refusal(now);
        }
    }
}
