//! A vehicle whose disk refuses, is damaged or is removed, with restarts at random instants.

use super::journal::Storage;
use super::journal::disk::{DiskRefusal, DiskStep};
use super::power_cut_tests::PowerCutTrial;
use proptest::prelude::*;
use scenecast_host::CameraPose;
use scenecast_protocol::directive::{Constraints, OrderStatus, RefusalReason, SlotId, Withdrawal};
use scenecast_protocol::wire::{ModeReason, VehicleMode};
use scenecast_surface::FenceOrder;
use scenecast_vehicle::{Durable, LostOrders};

const FILES: [&str; 2] = ["vehicle.journal", "vehicle.journal.copy"];

fn trial(seed: u64) -> PowerCutTrial {
    let mut trial = PowerCutTrial::new(seed, 0, Vec::new());
    trial.is_damaged = true;
    trial
}

fn run(trial: &mut PowerCutTrial, ticks: u32) {
    (0..ticks).for_each(|_| trial.tick());
}

fn order(trial: &mut PowerCutTrial, hold: bool, abort: bool) {
    let (auv, now) = (trial.auv(), trial.now());
    trial.surface.surface_mut().set_order(auv, Constraints { hold, abort }, now).unwrap();
}

fn status(trial: &PowerCutTrial, id: SlotId) -> OrderStatus {
    let view = trial.surface.surface().view(trial.auv()).unwrap();
    let slot = view.slots().find(|slot| slot.id == id).unwrap();
    slot.status
}

/// Whether the surface knows that the vehicle's journal is refused.
fn is_refusal_reported(trial: &PowerCutTrial) -> bool {
    let status = trial.surface.surface().status(trial.auv());
    status.and_then(|(status, _)| status.disk).is_some_and(|disk| disk.journal_refused)
}

fn durable(trial: &PowerCutTrial) -> &Durable {
    trial.onboard.host.vehicle().durable()
}

#[test]
fn a_refusing_disk_leaves_hold_and_abort_and_the_link() {
    for refusal in [Some(DiskStep::Sync), Some(DiskStep::Overwrite), None] {
        let mut trial = trial(1);
        run(&mut trial, 100);
        match refusal {
            Some(step) => trial.disk.fail(Some(step)),
            None => trial.disk.refuse(DiskRefusal::ReadOnly),
        }
        let (auv, now) = (trial.auv(), trial.now());
        trial.surface.surface_mut().set_budget(5000, None, None, now).unwrap();
        order(&mut trial, true, false);
        run(&mut trial, 200);
        let refused = OrderStatus::Refused(RefusalReason::Disk);
        assert_eq!(status(&trial, SlotId::Budget), refused);
        assert_eq!(status(&trial, SlotId::Constraints), OrderStatus::Received, "in force, and not on the disk");
        assert_eq!(trial.onboard.host.vehicle().mode(), (VehicleMode::Hold, ModeReason::Order));
        assert!(trial.onboard.host.vehicle().disk_refusals().0 && is_refusal_reported(&trial));
        order(&mut trial, false, true);
        run(&mut trial, 200);
        assert_eq!(trial.onboard.host.vehicle().mode(), (VehicleMode::Surface, ModeReason::Order));
        order(&mut trial, false, false);
        run(&mut trial, 200);
        assert_eq!(status(&trial, SlotId::Constraints), refused, "a disk that keeps no order lifts none");
        assert!(durable(&trial).abort);
        trial.disk.fail(None);
        trial.disk.refuse(DiskRefusal::None);
        run(&mut trial, 200);
        assert!(trial.onboard.is_stored && trial.onboard.saved.abort, "it is stored when the disk takes it");
        let now = trial.now();
        trial.surface.surface_mut().set_budget(6000, None, None, now).unwrap();
        trial.surface.surface_mut().set_order(auv, Constraints::default(), now).unwrap();
        run(&mut trial, 200);
        assert_eq!(status(&trial, SlotId::Budget), OrderStatus::Applied);
        assert_eq!(status(&trial, SlotId::Constraints), OrderStatus::Applied);
        assert!(!durable(&trial).abort && !durable(&trial).hold && !is_refusal_reported(&trial));
    }
}

#[test]
fn a_vehicle_that_lost_its_journal_holds_until_a_new_series() {
    let mut trial = trial(2);
    order(&mut trial, false, false);
    let now = trial.now();
    trial.surface.surface_mut().set_budget(5000, None, None, now).unwrap();
    run(&mut trial, 200);
    assert_eq!(status(&trial, SlotId::Budget), OrderStatus::Applied);
    FILES.iter().for_each(|name| trial.disk.put(name, b"damaged"));
    trial.restart();
    assert!(durable(&trial).hold && durable(&trial).lost == LostOrders::Present);
    run(&mut trial, 300);
    assert_eq!(trial.onboard.host.vehicle().mode(), (VehicleMode::Hold, ModeReason::Order));
    assert!(durable(&trial).hold, "the old order does not lift the hold");
    trial.restart();
    assert!(durable(&trial).hold && durable(&trial).lost != LostOrders::None, "a restart changes neither");
    for id in [SlotId::Constraints, SlotId::Budget] {
        assert_eq!(status(&trial, id), OrderStatus::Withdrawn(Withdrawal::Lost));
    }
    let (auv, now) = (trial.auv(), trial.now());
    assert_eq!(trial.surface.surface_mut().restore_lost(auv, now), Ok(vec![SlotId::Budget]));
    run(&mut trial, 400);
    assert_eq!(status(&trial, SlotId::Budget), OrderStatus::Applied);
    assert!(durable(&trial).hold, "an order to resume is given by the operator alone");
    order(&mut trial, false, false);
    run(&mut trial, 400);
    assert_eq!(status(&trial, SlotId::Constraints), OrderStatus::Applied);
    assert!(!durable(&trial).hold);
}

#[derive(Debug, Clone)]
enum OrderAction {
    Order(bool, bool),
    Budget,
    Refuse(DiskRefusal),
    Fail(Option<DiskStep>),
    /// One file, or both, are cut off at this byte.
    Truncate(bool, bool, usize),
    Remove(bool),
    Restart,
    /// The vehicle leaves its fence.
    Breach,
}

fn actions() -> impl Strategy<Value = Vec<(OrderAction, u32)>> {
    let action = prop_oneof![
        3 => (any::<bool>(), any::<bool>()).prop_map(|(hold, abort)| OrderAction::Order(hold, abort)),
        1 => Just(OrderAction::Budget),
        2 => prop_oneof![Just(DiskRefusal::None), Just(DiskRefusal::Full), Just(DiskRefusal::ReadOnly)]
            .prop_map(OrderAction::Refuse),
        1 => prop_oneof![Just(None), Just(Some(DiskStep::Sync)), Just(Some(DiskStep::Overwrite))]
            .prop_map(OrderAction::Fail),
        1 => (any::<bool>(), any::<bool>(), 0usize..16_384).prop_map(|(one, both, at)| OrderAction::Truncate(one, both, at)),
        1 => any::<bool>().prop_map(OrderAction::Remove),
        3 => Just(OrderAction::Restart),
        1 => Just(OrderAction::Breach),
    ];
    proptest::collection::vec((action, 1u32..60), 1..25)
}

/// Whether the vehicle is stopped by an order or a breach.
fn is_stopped(durable: &Durable) -> bool {
    durable.hold || durable.abort || durable.limits.breach != 0
}

fn restart(trial: &mut PowerCutTrial) -> Result<(), TestCaseError> {
    let onboard = &trial.onboard;
    let (before, was_stored) = (onboard.host.vehicle().durable().clone(), onboard.is_stored);
    trial.restart();
    let after = durable(trial).clone();
    // A state that the disk had not taken and a disk that takes writes again: the surface sends the order again, because
    // it was never reported as applied.
    let is_sent_again = !was_stored && trial.onboard.is_stored && !after.hold;
    prop_assert!(is_stopped(&after) || !is_stopped(&before) || is_sent_again, "{before:?} became {after:?}");
    // A run that found no readable state has a lineage of its own.
    if was_stored && after.lineage == before.lineage {
        prop_assert!(after.lost == before.lost);
        prop_assert!(after.abort || !before.abort);
        prop_assert!(after.hold || !before.hold);
        prop_assert!(after.limits.breach == before.limits.breach);
    }
    Ok(())
}

/// Whether the last order is obeyed after these actions, each followed by some ticks; no restart lifts a stop before.
fn check(actions: Vec<(OrderAction, u32)>, seed: u64) -> Result<(), TestCaseError> {
    let mut trial = trial(seed);
    let around = [[-90.0, -90.0], [90.0, -90.0], [90.0, 90.0], [-90.0, 90.0]].to_vec();
    let fence = FenceOrder { fence: Some(around), ..FenceOrder::default() };
    let (auv, now) = (trial.auv(), trial.now());
    trial.surface.surface_mut().set_fence(auv, &fence, now).unwrap();
    run(&mut trial, 100);
    for (action, ticks) in actions {
        act(&mut trial, action)?;
        run(&mut trial, ticks);
    }
    trial.disk.refuse(DiskRefusal::None);
    trial.disk.fail(None);
    order(&mut trial, true, false);
    run(&mut trial, 600);
    prop_assert!(is_stopped(durable(&trial)), "the last order is obeyed");
    Ok(())
}

fn act(trial: &mut PowerCutTrial, action: OrderAction) -> Result<(), TestCaseError> {
    let now = trial.now();
    match action {
        OrderAction::Order(hold, abort) => order(trial, hold, abort),
        OrderAction::Budget => trial.surface.surface_mut().set_budget(5000, None, None, now).unwrap(),
        OrderAction::Refuse(refusal) => trial.disk.refuse(refusal),
        OrderAction::Fail(step) => trial.disk.fail(step),
        OrderAction::Truncate(one, both, at) => {
            for name in FILES.into_iter().skip(usize::from(one && !both)).take(1 + usize::from(both)) {
                let whole = trial.disk.read(name).unwrap().unwrap_or_default();
                trial.disk.put(name, &whole[..at.min(whole.len())]);
            }
            restart(trial)?;
        }
        OrderAction::Remove(one) => {
            trial.disk.remove(FILES[usize::from(one)]);
            restart(trial)?;
        }
        OrderAction::Restart => restart(trial)?,
        OrderAction::Breach => {
            let outside = CameraPose { x_m: 500.0, y_m: 0.0, heading_rad: 0.0, depth_m: 10.0 };
            trial.onboard.host.handle_pose(outside, now);
        }
    }
    Ok(())
}

#[test]
fn a_vehicle_that_loses_its_journal_a_second_time_holds() {
    let refused = OrderAction::Refuse;
    let actions = vec![
        (OrderAction::Order(false, true), 27),
        (OrderAction::Truncate(false, true, 0), 40),
        (refused(DiskRefusal::ReadOnly), 41),
        (OrderAction::Order(false, false), 32),
        (refused(DiskRefusal::None), 53),
        (refused(DiskRefusal::None), 30),
        (OrderAction::Order(false, false), 1),
        (OrderAction::Truncate(false, true, 0), 1),
    ];
    check(actions, 0).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn no_restart_lifts_a_hold_an_abort_or_a_breach(actions in actions(), seed: u64) {
        check(actions, seed)?;
    }
}
