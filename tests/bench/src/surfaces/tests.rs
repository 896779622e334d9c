use super::waters::first_series;
use super::*;
use scenecast_protocol::directive::{OrderStatus, SlotId, Withdrawal};
use scenecast_protocol::link::Mismatch;

fn keyed(access: Access) -> EndsSetup {
    EndsSetup::new(access).keyed(true, true)
}

const LIMITS: SlotId = SlotId::Limits;
const CONSTRAINTS: SlotId = SlotId::Constraints;
const APPLIED: Option<OrderStatus> = Some(OrderStatus::Applied);

fn withdrawn(why: Withdrawal) -> Option<OrderStatus> {
    Some(OrderStatus::Withdrawn(why))
}

fn run_s(waters: &mut Waters, seconds: u64) {
    waters.run(Duration::from_secs(seconds));
}

#[test]
fn a_second_surface_is_refused_by_name_and_can_take_over() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(1, keyed(access));
        waters.is_away = [false, false, true];
        run_s(&mut waters, 90);
        assert_eq!(waters.holder(1), Some(first_series(0)), "{access:?}");
        let caller = waters.view(0).caller(waters.now);
        assert_eq!(caller.map(|caller| caller.series), Some(first_series(1)), "{access:?}");
        waters.give(0, limits(1));
        run_s(&mut waters, 30);
        assert_eq!(waters.status(0, LIMITS), APPLIED, "the holder is not disturbed: {access:?}");

        waters.take_over(1);
        run_s(&mut waters, 60);
        assert_eq!(waters.holder(1), None, "{access:?}");
        assert_eq!(waters.holder(0), Some(first_series(1)), "{access:?}");
        waters.give(1, limits(2));
        run_s(&mut waters, 30);
        assert_eq!(waters.status(1, LIMITS), APPLIED, "{access:?}");

        // The second surface leaves: the first one has the vehicle again, and its order is not applied twice.
        waters.is_away = [false, true, true];
        run_s(&mut waters, 300);
        assert_eq!(waters.holder(0), None, "{access:?}");
        assert_eq!(waters.status(0, LIMITS), withdrawn(Withdrawal::Superseded), "{access:?}");
        assert_eq!(waters.orders.applied.len(), 2, "{access:?}: {:?}", waters.orders);
    }
}

#[test]
fn two_surfaces_without_a_key_learn_of_each_other() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(1, EndsSetup::new(access));
        waters.restart_surface(0);
        run_s(&mut waters, 60);
        assert_eq!(waters.view(0).caller(waters.now), None, "{access:?}: it is alone");
        waters.is_away = [false, false, true];
        run_s(&mut waters, 180);
        let held = waters.view(1).caller(waters.now).map(|caller| caller.series.is_of_same_surface(first_series(0)));
        assert_eq!(held, Some(true), "{access:?}: the holder learns of the other one by name");
        // It names what it hears once it has heard enough of it, which takes longer where modems poll.
        let is_named = (0..40).any(|_| {
            run_s(&mut waters, 10);
            waters.view(0).mismatch(waters.now) == Some(Mismatch::Foreign)
        });
        assert!(is_named, "{access:?}");
    }
}

#[test]
fn a_hold_of_any_surface_is_applied_within_seconds() {
    for seed in 0..60 {
        let seconds = hold_of_second_s(seed);
        assert!(seconds.is_some_and(|seconds| seconds <= 8.0), "{seed}: {seconds:?}");
    }
}

#[test]
fn a_hold_from_before_the_other_surface_was_known_takes_over() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(5, keyed(access));
        waters.hold(1);
        waters.is_away = [false, false, true];
        run_s(&mut waters, 40);
        assert_eq!(waters.status(1, CONSTRAINTS), APPLIED, "a new surface: {access:?}");
        assert_eq!(waters.holder(0), Some(first_series(1)), "{access:?}");
        let known = waters.view(1).caller(waters.now).map(|other| other.series);
        assert_eq!(known, Some(first_series(0)), "it knows from whom it took the vehicle: {access:?}");

        // The first one is cut off, so that it does not know of the second.
        let mut waters = Waters::held_by_first(5, keyed(access));
        waters.is_away = [true, false, true];
        waters.take_over(1);
        run_s(&mut waters, 60);
        waters.hold(0);
        run_s(&mut waters, 10);
        waters.is_away = [false, false, true];
        run_s(&mut waters, 90);
        assert_eq!(waters.status(0, CONSTRAINTS), APPLIED, "a surface that was cut off: {access:?}");
    }
}

#[test]
fn a_hold_against_a_known_surface_is_obeyed_despite_its_orders() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(7, keyed(access));
        waters.give(0, Slot::Constraints(Constraints { hold: false, abort: false }));
        run_s(&mut waters, 60);
        assert_eq!(waters.status(0, CONSTRAINTS), APPLIED, "{access:?}");
        waters.is_away = [false, false, true];
        run_s(&mut waters, 60);
        assert_eq!(waters.holder(1), Some(first_series(0)), "{access:?}");
        waters.hold(1);
        run_s(&mut waters, 40);
        assert_eq!(waters.status(1, CONSTRAINTS), APPLIED, "{access:?}");
    }
}

#[test]
fn a_hold_is_obeyed_after_an_older_order_of_the_holder() {
    for access in ACCESSES {
        for age_s in [0, 4] {
            let mut waters = Waters::held_by_first(8, keyed(access));
            waters.give(0, Slot::Constraints(Constraints { hold: false, abort: false }));
            run_s(&mut waters, 60);
            // A laptop that is started to stop the vehicle does not know of the holder yet.
            waters.hold(1);
            run_s(&mut waters, age_s);
            waters.is_away = [false, false, true];
            run_s(&mut waters, 60);
            assert_eq!(waters.status(1, CONSTRAINTS), APPLIED, "{access:?}, {age_s} s before it is heard");
        }
    }
}

#[test]
fn a_withdrawn_abort_takes_no_vehicle() {
    let abort = Slot::Constraints(Constraints { hold: false, abort: true });
    for access in ACCESSES {
        let setup = EndsSetup { abort_lifetime: Some(Duration::from_secs(60)), ..keyed(access) };
        let mut waters = Waters::held_by_first(9, setup);
        waters.is_away = [false, false, true];
        run_s(&mut waters, 60);
        assert_eq!(waters.holder(1), Some(first_series(0)), "{access:?}");
        waters.is_away = [false, true, true];
        waters.give(1, abort.clone());
        run_s(&mut waters, 70);
        assert_eq!(waters.status(1, CONSTRAINTS), withdrawn(Withdrawal::Late), "{access:?}");
        waters.is_away = [false, false, true];
        run_s(&mut waters, 90);
        assert_eq!(waters.holder(0), None, "{access:?}");
        assert_eq!(waters.holder(1), Some(first_series(0)), "{access:?}");

        // What the operator wishes besides stays.
        waters.is_away = [false, true, true];
        waters.give(1, abort.clone());
        waters.take_over(1);
        run_s(&mut waters, 70);
        assert_eq!(waters.status(1, CONSTRAINTS), withdrawn(Withdrawal::Late), "{access:?}");
        waters.is_away = [false, false, true];
        run_s(&mut waters, 90);
        assert_eq!(waters.holder(0), Some(first_series(1)), "{access:?}");
    }
}

#[test]
fn a_vehicle_with_an_older_folder_has_lost_the_orders_since() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(10, keyed(access));
        waters.give(0, limits(1));
        run_s(&mut waters, 30);
        let copy = waters.durable();
        waters.give(0, limits(2));
        run_s(&mut waters, 30);
        assert_eq!(waters.status(0, LIMITS), APPLIED, "{access:?}");
        waters.restart_vehicle_with(copy);
        run_s(&mut waters, 60);
        assert_eq!(waters.status(0, LIMITS), withdrawn(Withdrawal::Lost), "{access:?}");
        assert!(waters.lost[0], "{access:?}: the person is asked");
        waters.confirm(0);
        run_s(&mut waters, 40);
        assert_eq!(waters.status(0, LIMITS), APPLIED, "{access:?}");
        assert_eq!(waters.orders.applied.last().map(|order| order.slot.clone()), Some(limits(2)), "{access:?}");
    }
}

#[test]
fn an_old_hold_asks_and_takes_over_once_it_is_given_again() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(6, keyed(access));
        waters.is_away = [true, false, true];
        run_s(&mut waters, 130);
        waters.hold(0);
        run_s(&mut waters, 130);
        waters.is_away = [false, false, true];
        run_s(&mut waters, 120);
        assert_eq!(waters.status(0, CONSTRAINTS), withdrawn(Withdrawal::Late), "{access:?}");
        assert_eq!(waters.holder(0), Some(first_series(1)), "{access:?}");
        waters.confirm(0);
        run_s(&mut waters, 40);
        assert_eq!(waters.status(0, CONSTRAINTS), APPLIED, "{access:?}");
        run_s(&mut waters, 60);
        assert_eq!(waters.holder(1), Some(first_series(0)), "{access:?}");
    }
}

#[test]
fn an_order_that_another_surface_has_overtaken_is_withdrawn() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(3, keyed(access));
        waters.is_away = [true; SURFACES];
        waters.give(0, limits(1));
        run_s(&mut waters, 130);
        waters.is_away = [true, false, true];
        waters.give(1, limits(2));
        run_s(&mut waters, 120);
        assert_eq!(waters.status(1, LIMITS), APPLIED, "{access:?}");
        waters.is_away = [false, true, true];
        run_s(&mut waters, 300);
        assert_eq!(waters.status(0, LIMITS), withdrawn(Withdrawal::Overtaken), "{access:?}");
        assert_eq!(waters.orders.applied.len(), 1, "{access:?}");
        waters.confirm(0);
        run_s(&mut waters, 60);
        assert_eq!(waters.status(0, LIMITS), APPLIED, "{access:?}");
    }
}

#[test]
fn orders_that_a_vehicle_lost_are_sent_again_once_confirmed() {
    let resume = || Slot::Constraints(Constraints { hold: false, abort: false });
    for access in ACCESSES {
        let mut waters = Waters::new(4, keyed(access));
        waters.is_away = [false, true, true];
        waters.give(0, limits(1));
        waters.give(0, resume());
        run_s(&mut waters, 120);
        assert_eq!(waters.orders.applied.len(), 2, "{access:?}");
        waters.restart_vehicle(false);
        run_s(&mut waters, 200);
        assert!(waters.lost[0] && waters.status(0, LIMITS) == withdrawn(Withdrawal::Lost), "{access:?}");
        assert!(waters.orders.applied.is_empty(), "{access:?}: {:?}", waters.orders);
        waters.confirm(0);
        run_s(&mut waters, 120);
        let applied: Vec<&Slot> = waters.orders.applied.iter().map(|order| &order.slot).collect();
        assert_eq!(applied, [&limits(1)], "{access:?}");
        let lifted = waters.status(0, SlotId::Constraints);
        assert_eq!(lifted, withdrawn(Withdrawal::Lost), "what lifts a hold is never restored: {access:?}");
        waters.give(0, resume());
        run_s(&mut waters, 60);
        assert_eq!(waters.status(0, SlotId::Constraints), APPLIED, "{access:?}");
    }
}

#[test]
fn orders_of_three_surfaces_all_end_and_replace_no_newer_one() {
    for seed in 0..if std::env::var_os("SCENECAST_FULL").is_some() { 400 } else { 200 } {
        let figures = run_schedule(seed);
        assert!(figures.regressions.is_empty() && figures.open.is_empty(), "seed {seed}: {figures:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_schedule() {
    assert_eq!(run_schedule(7), run_schedule(7));
    assert_ne!(run_schedule(7), run_schedule(8));
}

/// Seconds from the arrival of a second vehicle with the same address, `late_s` after the first, until the surface names it.
fn seconds_until_a_twin_is_named(setup: &EndsSetup, late_s: u64) -> Option<u64> {
    let mut waters = Waters::new(late_s, setup.clone());
    waters.is_away = [false, true, true];
    if late_s > 0 {
        run_s(&mut waters, late_s);
    }
    waters.add_twin();
    (0..400).find(|_| {
        run_s(&mut waters, 1);
        waters.twin_found && waters.view(0).mismatch(waters.now) == Some(Mismatch::Twin)
    })
}

#[test]
fn two_vehicles_with_one_address_are_named() {
    for access in ACCESSES {
        for is_keyed in [true, false] {
            let setup = EndsSetup { discovery: Some(Duration::from_secs(60)), ..EndsSetup::new(access) };
            let setup = if is_keyed { setup.keyed(true, true) } else { setup };
            let named = seconds_until_a_twin_is_named(&setup, 0);
            assert!(named.is_some_and(|seconds| seconds <= 30), "{access:?}, keyed {is_keyed}: {named:?}");
            // The first one is in contact, and the second one silent until a call or a hello.
            let limit_s = if access == Access::Shared { 90 } else { 320 };
            for late_s in [100, 120, 333] {
                let named = seconds_until_a_twin_is_named(&setup, late_s);
                let is_in_time = named.is_some_and(|seconds| seconds <= limit_s);
                assert!(is_in_time, "{access:?}, keyed {is_keyed}, {late_s} s late: {named:?}");
            }
        }
    }
}

#[test]
fn a_late_vehicle_learns_that_its_address_is_taken() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(2, keyed(access));
        assert!(!waters.twin_found_itself, "{access:?}: it is alone");
        waters.add_twin();
        run_s(&mut waters, 30);
        assert!(waters.twin_found_itself, "{access:?}");
    }
}

#[test]
fn a_surface_that_slept_continues_within_ten_seconds() {
    for access in ACCESSES {
        for asleep_s in [20, 3600, 100_000] {
            let mut waters = Waters::held_by_first(asleep_s, keyed(access));
            let frames = waters.view(0).stats().frames_received;
            waters.is_asleep[0] = true;
            run_s(&mut waters, asleep_s);
            waters.is_asleep[0] = false;
            waters.give(0, limits(1));
            run_s(&mut waters, 10);
            assert_eq!(waters.status(0, LIMITS), APPLIED, "{access:?}, {asleep_s} s: the orders go on");
            let heard = waters.view(0).stats().frames_received - frames;
            assert!((1..100).contains(&heard), "{access:?}, {asleep_s} s: {heard} frames in 10 s");
        }
    }
}

#[test]
fn a_vehicle_that_answers_after_a_silence_is_not_taken_for_two() {
    let setup = EndsSetup { discovery: Some(Duration::from_secs(20)), ..keyed(Access::Shared) };
    let mut waters = Waters::new(5, setup);
    for silence_s in 60..160 {
        waters.is_away = [false, true, true];
        run_s(&mut waters, silence_s);
        waters.is_away = [true; SURFACES];
        run_s(&mut waters, silence_s);
    }
    assert!(!waters.twin_found);
}

#[test]
fn a_vehicle_that_restarts_again_and_again_is_not_taken_for_two() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(3, keyed(access));
        waters.loss = 0.2;
        for pause_s in [1, 3, 40, 12, 7, 90, 2, 25] {
            waters.restart_vehicle(pause_s % 2 == 1);
            run_s(&mut waters, pause_s);
            waters.restart_surface(0);
            run_s(&mut waters, 40 - pause_s.min(30));
        }
        assert!(!waters.twin_found, "{access:?}");
    }
}
