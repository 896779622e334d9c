//! The content in force that the link reports is that which the vehicle obeys, also after a restart.

use super::Vehicle;
use crate::{Durable, MapChanges};
use proptest::prelude::*;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{
    Areas, Budget, Change, Constraints, Destination, Fence, Limits, PerSlot, Polygon, REPORTED_SLOTS, RefusalReason,
    Settings, ShortDecimal, Slot, SlotId, Utility, WeightedArea,
};
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;

const AREA: Area = Area { west: 0.0, south: 0.0, east: 40.0, north: 30.0 };

fn start(durable: Durable) -> Vehicle {
    let config = Config::default();
    let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
    crate::assemble(&config, None, profile, AREA, durable, 1, Instant::ZERO).unwrap()
}

fn reported(vehicle: &Vehicle) -> PerSlot<Option<Slot>> {
    PerSlot::from_fn(|id| vehicle.link.in_force(id).cloned())
}

/// Shows the vehicle a map of two labels in an epoch.
fn see(vehicle: &mut Vehicle, epoch: u8) {
    vehicle.handle_changes(&MapChanges::of_labels(epoch, 2, Vec::new()), Instant::ZERO);
    vehicle.handle_persisted();
}

fn fence(metres: i32) -> Fence {
    let m = 10 * metres;
    let corners = [(-m, -m), (m, -m), (m, m), (-m, m)].map(|(x, y)| DecimetrePoint::new(x, y));
    Fence { fence: Some(Polygon(corners.into())), ..Fence::default() }
}

fn order() -> impl Strategy<Value = Slot> {
    let to = |value: f64| Change::To(ShortDecimal::new(value).unwrap());
    prop_oneof![
        (0u8..2, -100i8..100).prop_map(|(epoch, weight)| {
            Slot::Utility(Utility { epoch, weights: [(1, weight)].into(), ..Utility::default() })
        }),
        any::<bool>().prop_map(|hold| Slot::Constraints(Constraints { hold, abort: false })),
        (1u32..9).prop_map(|n| Slot::Limits(Limits { time_s: Some(1000 * n), ..Limits::default() })),
        Just(Slot::Limits(Limits::default())),
        (100i32..200).prop_map(|metres| Slot::Fence(fence(metres))),
        Just(Slot::Fence(Fence::default())),
        (-90i32..90).prop_map(|east_m| {
            let place = DecimetrePoint::new(10 * east_m, 50);
            Slot::Destination(Destination { place: Some(place) })
        }),
        Just(Slot::Destination(Destination::default())),
        (-100i8..100).prop_map(|weight| {
            let outline = fence(20).fence.unwrap_or_default();
            Slot::Areas(Areas(vec![WeightedArea { outline, weight }]))
        }),
        Just(Slot::Areas(Areas::default())),
        (1u8..9).prop_map(move |n| Slot::Settings(Settings { alpha: to(f64::from(n)), ..Settings::default() })),
        (1u8..9).prop_map(move |n| Slot::Settings(Settings { beta: to(f64::from(n)), ..Settings::default() })),
        Just(Slot::Settings(Settings { alpha: Change::Configured, ..Settings::default() })),
        (5u32..20_000).prop_map(|bits_per_s| {
            let config = Config::default();
            Slot::Budget(Budget { bits_per_s, shares: Shares([10; 5]), background: config.link.background })
        }),
    ]
}

proptest! {
    #[test]
    fn a_restart_reports_the_same_content_in_force(orders in proptest::collection::vec(order(), 0..12)) {
        let mut vehicle = start(Durable::default());
        see(&mut vehicle, 0);
        for slot in orders {
            let (id, before) = (slot.id(), reported(&vehicle));
            let result = vehicle.apply(slot.clone(), Instant::ZERO);
            let after = reported(&vehicle);
            for other in REPORTED_SLOTS.into_iter().filter(|&other| other != id || result.is_err()) {
                prop_assert_eq!(before.get(other), after.get(other));
            }
            if result.is_ok() && !matches!(id, SlotId::Settings | SlotId::Constraints) {
                prop_assert_eq!(after.get(id), Some(&slot.in_force()));
            }
        }
        prop_assert_eq!(reported(&start(vehicle.durable().clone())), reported(&vehicle));
    }
}

#[test]
fn a_vehicle_without_orders_reports_its_configured_budget() {
    let (vehicle, config) = (start(Durable::default()), Config::default());
    for id in REPORTED_SLOTS {
        let configured = Slot::Budget(Budget {
            bits_per_s: config.link.budget_bps,
            shares: config.link.shares,
            background: config.link.background,
        });
        assert_eq!(vehicle.link.in_force(id).cloned(), (id == SlotId::Budget).then_some(configured), "{id:?}");
    }
}

#[test]
fn a_new_epoch_leaves_no_utility_in_force() {
    let mut vehicle = start(Durable::default());
    see(&mut vehicle, 0);
    let utility = |epoch| Slot::Utility(Utility { epoch, weights: [(1, 50)].into(), ..Utility::default() });
    assert_eq!(vehicle.apply(utility(0), Instant::ZERO), Ok(()));
    assert_eq!(vehicle.link.in_force(SlotId::Utility), Some(&utility(0)));
    see(&mut vehicle, 1);
    assert_eq!(vehicle.link.in_force(SlotId::Utility), None);
    assert_eq!(vehicle.apply(utility(0), Instant::ZERO), Err(RefusalReason::OtherEpoch));
}
