//! The surface requests exemplars of its vehicles.

use super::album::{Album, Wish};
use super::{Desk, Surface};
use scenecast_protocol::directive::{OrderStatus, Slot, SlotId, SlotProgress};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;

impl Surface {
    /// Requests an exemplar of a label. The error is one line for the operator.
    pub fn request_exemplar(&mut self, vehicle: Address, label: u8, wish: Wish, now: Instant) -> Result<u16, String> {
        if !self.labels(vehicle).ok_or("no such vehicle")?.contains_key(&label) {
            return Err(format!("label {label} is not on the map"));
        }
        self.change_requests(vehicle, |album| album.ask(label, wish, now), now)
    }

    /// Withdraws the request for an exemplar of a label. The error is one line for the operator.
    pub fn cancel_exemplar(&mut self, vehicle: Address, label: u8, now: Instant) -> Result<u16, String> {
        self.change_requests(vehicle, |album| album.cancel(label), now)
    }

    fn change_requests(
        &mut self,
        vehicle: Address,
        change: impl FnOnce(&mut Album) -> Result<(), String>,
        now: Instant,
    ) -> Result<u16, String> {
        let desk = self.desks.get(&vehicle).ok_or("no such vehicle")?;
        let mut album = desk.album.clone();
        change(&mut album)?;
        let version = self.issue(vehicle, Slot::Requests(album.wanted(desk.epoch)), now)?;
        self.desks.get_mut(&vehicle).ok_or("no such vehicle")?.album = album;
        Ok(version)
    }

    /// A restarted vehicle has lost the requests, so they are sent again.
    pub(super) fn request_again(&mut self, vehicle: Address, now: Instant) {
        let wanted = self.desks.get(&vehicle).map(Desk::wanted).filter(|r| !r.wanted.is_empty());
        if let Some(requests) = wanted {
            // The same order was valid before.
            let _ = self.issue(vehicle, Slot::Requests(requests), now);
        }
    }

    pub(super) fn handle_decision(&mut self, vehicle: Address, slot: SlotId, now: Instant) {
        let refused = |s: &SlotProgress| s.id == slot && matches!(s.status, OrderStatus::Refused(_));
        let is_refused = self.link.vehicle(vehicle).is_some_and(|v| v.slots().any(refused));
        if let Some(desk) = self.desks.get_mut(&vehicle).filter(|_| slot == SlotId::Requests && is_refused) {
            desk.album.handle_refusal(now);
        }
    }
}
