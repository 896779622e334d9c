//! The orders that a change of a part of them begins with, and hold beside an abort.

use super::Surface;
use super::given_orders::SentOrder;
use super::orders::{FenceOrder, LimitsOrder};
use super::refusal::OrderRefusal;
use super::reported_orders::status;
use scenecast_protocol::directive::{Constraints, OrderStatus, Slot, SlotId, Withdrawal};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::link::{InForce, PeerView};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, ModeReason, VehicleMode};

/// The order that a change of a part of it begins with: the one that is on its way to the vehicle, or else the one in force.
///
/// # Errors
/// The vehicle may obey an order that this surface does not know, so that the rest of it would be removed.
fn present<T: Clone + Default>(order: &SentOrder<T>, id: SlotId, view: &PeerView<'_>) -> Result<T, OrderRefusal> {
    if status(view, id).is_some_and(OrderStatus::is_pending) {
        return Ok(order.sent.clone().unwrap_or_default());
    }
    let in_force = order.in_force.as_ref().map(|(_, content)| content.clone());
    let known = match view.in_force(id) {
        // A change of a part of what the vehicle has lost gives it again.
        InForce::None if status(view, id) == Some(OrderStatus::Withdrawn(Withdrawal::Lost)) => order.sent.clone(),
        InForce::None => Some(T::default()),
        InForce::Known(_) => in_force,
        InForce::NotReported => in_force.or_else(|| order.sent.clone()),
        InForce::Unknown => None,
    };
    known.ok_or(OrderRefusal::RestUnknown(id))
}

impl Surface {
    /// The fence that a change of a part of it begins with.
    pub fn present_fence(&self, vehicle: Address) -> Result<FenceOrder, OrderRefusal> {
        let (record, view) = self.records.get(&vehicle).zip(self.view(vehicle)).ok_or(IssueError::NoVehicle)?;
        present(&record.orders.fence, SlotId::Fence, &view).map(|fence| FenceOrder::from(&fence))
    }

    /// The limits that a change of a part of them begins with.
    pub fn present_limits(&self, vehicle: Address) -> Result<LimitsOrder, OrderRefusal> {
        let (record, view) = self.records.get(&vehicle).zip(self.view(vehicle)).ok_or(IssueError::NoVehicle)?;
        present(&record.orders.limits, SlotId::Limits, &view).map(|limits| LimitsOrder::from(&limits))
    }
}

/// The last order of hold and abort: its content, its status and when the status last changed.
type LastOrder = (Constraints, OrderStatus, Instant);
/// The mode of the last report with its reason, and when it came in.
type LastMode = (VehicleMode, ModeReason, Instant);

impl Surface {
    /// Orders a vehicle to hold, or to continue, and leaves an abort as it is. It is refused if an
    /// abort is in force and `hold` is false, or if it is not known whether one is.
    pub fn change_hold(&mut self, vehicle: Address, hold: bool, now: Instant) -> Result<u16, OrderRefusal> {
        match self.has_abort(vehicle) {
            None => Err(OrderRefusal::AbortUnknown),
            Some(true) if !hold => Err(OrderRefusal::Aborted),
            Some(abort) => self.set_order(vehicle, Constraints { hold, abort }, now),
        }
    }

    /// Whether an abort is in force or on its way; `None` while that is not known.
    pub fn has_abort(&self, vehicle: Address) -> Option<bool> {
        let view = self.link.vehicle(vehicle)?;
        let order = view.slots().find(|slot| slot.id == SlotId::Constraints).and_then(|slot| match slot.slot {
            Slot::Constraints(constraints) => Some((constraints, slot.status, slot.changed)),
            _ => None,
        });
        has_abort(order, view.status().map(|(status, at)| (status.mode, status.reason, *at)))
    }
}

/// The last order counts until the vehicle refuses it, or it is withdrawn; then, and before the first order, the reports
/// after that count. An
/// order in force and a later report that contradict each other show that somebody else has given an order.
fn has_abort(order: Option<LastOrder>, mode: Option<LastMode>) -> Option<bool> {
    let reported_after = |time: Instant| mode.filter(|&(.., at)| at > time).and_then(|m| reported_abort(m.0, m.1));
    match order {
        None => mode.and_then(|m| reported_abort(m.0, m.1)),
        Some((_, OrderStatus::Refused(_) | OrderStatus::Withdrawn(_), changed)) => reported_after(changed),
        Some((order, OrderStatus::Applied, changed)) => {
            Some(order.abort).filter(|&abort| reported_after(changed).is_none_or(|reported| reported == abort))
        }
        Some((order, ..)) => Some(order.abort),
    }
}

/// Whether a mode shows an abort. While it surfaces or returns on an abort, a vehicle reports these modes, by order; no other
/// order causes them.
fn reported_abort(mode: VehicleMode, reason: ModeReason) -> Option<bool> {
    match mode {
        VehicleMode::Abort => Some(true),
        VehicleMode::Survey | VehicleMode::Hold => Some(false),
        VehicleMode::Return | VehicleMode::Surface => match reason {
            ModeReason::Order => Some(true),
            ModeReason::Survey => None,
            _ => Some(false),
        },
        // The survey has ended for good, with an abort or without.
        VehicleMode::Done => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{EventTime, SurfaceMemory};
    use crate::recorder::Recorder;
    use scenecast_core::tuning_table::TuningTable;
    use scenecast_protocol::directive::RefusalReason;
    use scenecast_protocol::mac::{Access, ModemProfile};
    use std::time::Duration;

    fn at(seconds: u64) -> Instant {
        Instant::from_micros(seconds * 1_000_000)
    }

    fn auv() -> Address {
        Address::vehicle(1).unwrap()
    }

    fn surface(seed: u64) -> Surface {
        let modem = ModemProfile {
            bit_rate_bps: 1000.0,
            frame_bytes: 64,
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
            access: Access::Shared,
        };
        let config = scenecast_config::Config::default();
        crate::assemble(&config, None, TuningTable::default(), modem, seed, Instant::ZERO).unwrap()
    }

    /// The last order of hold and abort.
    fn last(surface: &Surface) -> Constraints {
        let view = surface.view(auv()).unwrap();
        let Slot::Constraints(order) = view.slots().find(|slot| slot.id == SlotId::Constraints).unwrap().slot else {
            panic!("another slot")
        };
        order
    }

    #[test]
    fn a_hold_keeps_an_abort_that_is_not_reported_yet() {
        let mut surface = surface(1);
        surface.set_order(auv(), Constraints { hold: false, abort: true }, at(1)).unwrap();
        assert!(surface.change_hold(auv(), false, at(2)) == Err(OrderRefusal::Aborted));
        surface.change_hold(auv(), true, at(3)).unwrap();
        assert_eq!(last(&surface), Constraints { hold: true, abort: true });
        surface.set_order(auv(), Constraints::default(), at(4)).unwrap();
        surface.change_hold(auv(), true, at(5)).unwrap();
        assert_eq!(
            last(&surface),
            Constraints { hold: true, abort: false },
            "an abort that has ended is not ordered again"
        );
    }

    #[test]
    fn a_hold_keeps_an_abort_across_a_restart() {
        let (mut before, mut recorder) = (surface(1), Recorder::default());
        let mut events = recorder.begin(&mut before, 7, 1, EventTime::default()).events;
        before.set_order(auv(), Constraints { hold: false, abort: true }, at(1)).unwrap();
        let time = EventTime { mission_us: 2_000_000, unix_ms: 0 };
        events.extend(recorder.observe(&mut before, None, time).events);
        let mut after = surface(2);
        assert_eq!(after.has_abort(auv()), None);
        Recorder::new(SurfaceMemory::fold(events)).begin(&mut after, 8, 1, time);
        assert!(after.change_hold(auv(), false, at(3)).is_err());
        after.change_hold(auv(), true, at(4)).unwrap();
        assert_eq!(last(&after), Constraints { hold: true, abort: true });
    }

    #[test]
    fn the_log_tells_the_end_of_an_order_that_a_newer_one_replaces() {
        let mut surface = surface(1);
        surface.set_order(auv(), Constraints { hold: true, abort: false }, at(1)).unwrap();
        surface.set_order(auv(), Constraints { hold: false, abort: true }, at(2)).unwrap();
        let texts: Vec<&str> = surface.log().entries().map(|entry| entry.text.as_str()).collect();
        assert_eq!(texts, ["hold version 1 was replaced before the vehicle was known to have applied it"]);
    }

    #[test]
    fn without_order_and_report_a_hold_is_refused() {
        let mut surface = surface(1);
        for hold in [false, true] {
            assert!(surface.change_hold(auv(), hold, at(1)) == Err(OrderRefusal::AbortUnknown));
        }
    }

    #[test]
    fn a_report_counts_without_an_order_and_after_a_refusal() {
        use VehicleMode::{Abort, Done, Hold, Return, Surface, Survey};
        let mode = |mode, reason| Some((mode, reason, at(9)));
        let expected = [
            (Survey, ModeReason::Survey, Some(false)),
            (Hold, ModeReason::Order, Some(false)),
            (Return, ModeReason::Distance, Some(false)),
            (Return, ModeReason::Order, Some(true)),
            (Surface, ModeReason::Order, Some(true)),
            (Abort, ModeReason::Order, Some(true)),
            (Done, ModeReason::Survey, None),
        ];
        let refused = OrderStatus::Refused(RefusalReason::Unable);
        for (name, reason, abort) in expected {
            assert_eq!(has_abort(None, mode(name, reason)), abort, "{name:?} {reason:?}");
            let order = |changed| Some((Constraints::default(), refused, at(changed)));
            assert_eq!(has_abort(order(8), mode(name, reason)), abort, "{name:?} {reason:?}");
            assert_eq!(has_abort(order(9), mode(name, reason)), None, "a report from before the refusal");
        }
    }

    #[test]
    fn a_later_report_casts_doubt_on_an_order_in_force() {
        let order = |abort, status| Some((Constraints { hold: false, abort }, status, at(8)));
        let surfaced = |s| Some((VehicleMode::Surface, ModeReason::Order, at(s)));
        let survey = Some((VehicleMode::Survey, ModeReason::Survey, at(9)));
        let applied = OrderStatus::Applied;
        assert_eq!(has_abort(order(true, applied), surfaced(9)), Some(true));
        assert_eq!(has_abort(order(false, applied), surfaced(8)), Some(false), "a report of the time before");
        assert_eq!(has_abort(order(false, applied), surfaced(9)), None, "somebody else's abort");
        assert_eq!(has_abort(order(true, applied), survey), None, "somebody else ended it");
        assert_eq!(has_abort(order(false, OrderStatus::Received), surfaced(9)), Some(false), "its end is on the way");
    }
}
