//! With a key and `authenticate = "all"`, a stranger can only replay frames. These cost airtime, and no run of either end.

use crate::pair::{LinkedEnds, LossyChannel, Setup, auv, patchy, utility};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::wire::Envelope;
use std::time::Duration;

const STILL: LossyChannel = LossyChannel {
    loss: 0.0,
    duplication: 0.0,
    reordering: 0.0,
    corruption: 0.0,
    talker: 0.0,
    propagation: Duration::from_millis(300),
};
const ACCESSES: [Access; 3] = [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled];

/// Converged ends, and hellos of runs of the vehicle that the surface has never met.
fn with_unmet_hellos(access: Access) -> (LinkedEnds, Vec<Vec<u8>>) {
    let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) }.keyed(true, false);
    let mut pair = LinkedEnds::new(11, setup, STILL);
    let map = patchy(12, 1);
    pair.vehicle.set_map(map.iter(), pair.now);
    pair.mute = [false, true];
    for _ in 0..3 {
        pair.run(pair.now + Duration::from_secs(120), false);
        pair.restart_vehicle(&map);
    }
    let is_hello = |bytes: &&Vec<u8>| {
        Envelope::decode(bytes, |_| true).is_ok_and(|e| e.header.from == auv() && e.header.kind().is_hello())
    };
    let hellos: Vec<Vec<u8>> = pair.overheard.iter().filter(is_hello).cloned().collect();
    pair.mute = [false; 2];
    pair.run(pair.now + Duration::from_secs(600), true);
    assert!(pair.is_converged() && hellos.len() > 2, "{} hellos by {access:?}", hellos.len());
    (pair, hellos)
}

#[test]
fn a_replayed_hello_ends_no_run_and_delays_nothing() {
    for access in ACCESSES {
        let (mut pair, hellos) = with_unmet_hellos(access);
        let generation = |pair: &LinkedEnds| pair.surface.vehicle(auv()).unwrap().generation();
        let before = generation(&pair);
        for step in 0..40 {
            pair.surface.handle_frame(&hellos[step % hellos.len()], pair.now);
            pair.vehicle.set_map(patchy(12, step as u64).iter(), pair.now);
            pair.surface.issue(auv(), utility(step as i8), pair.now).unwrap();
            pair.run(pair.now + Duration::from_secs(30), true);
            assert!(pair.is_converged(), "step {step} by {access:?}");
            assert_eq!(pair.applied.last(), Some(&utility(step as i8)), "step {step} by {access:?}");
        }
        assert_eq!(generation(&pair), before, "{access:?}");
    }
}

#[test]
fn a_replayed_hello_does_not_make_a_silent_vehicle_look_alive() {
    for access in ACCESSES {
        let (mut pair, unmet) = with_unmet_hellos(access);
        let met = pair.overheard.iter().find(|bytes| {
            let header = |b: &Vec<u8>| Envelope::decode(b, |_| true).unwrap().header;
            header(bytes).from == auv() && header(bytes).kind().is_hello() && !unmet.contains(bytes)
        });
        let hellos: Vec<Vec<u8>> = met.into_iter().chain(&unmet).cloned().collect();
        pair.mute = [true; 2];
        pair.run(pair.now + Duration::from_secs(5), false);
        let last_received = pair.surface.vehicle(auv()).unwrap().last_received();
        for hello in hellos.iter().cycle().take(60) {
            pair.surface.handle_frame(hello, pair.now);
            pair.run(pair.now + Duration::from_secs(5), false);
        }
        assert_eq!(pair.surface.vehicle(auv()).unwrap().last_received(), last_received, "{access:?}");
    }
}

#[test]
fn replayed_hellos_cost_at_most_two_frames_a_second() {
    for access in ACCESSES {
        let (mut pair, hellos) = with_unmet_hellos(access);
        let sent = |pair: &LinkedEnds| pair.surface.vehicle(auv()).unwrap().stats().frames_sent;
        pair.mute = [true; 2];
        let begun = sent(&pair);
        pair.run(pair.now + Duration::from_secs(600), false);
        let (quiet, again) = (sent(&pair) - begun, sent(&pair));
        for hello in hellos.iter().cycle().take(6000) {
            pair.surface.handle_frame(hello, pair.now);
            pair.run(pair.now + Duration::from_millis(100), false);
        }
        let attacked = sent(&pair) - again;
        println!("{access:?}: {quiet} frames in 10 minutes without replays, {attacked} with 10 replays a second");
        assert!(attacked < 1200, "{access:?}: {attacked} frames, {quiet} without replays");
    }
}

/// Converged ends, and hellos of earlier runs of the surface that the vehicle has never met.
fn with_unmet_calls(access: Access) -> (LinkedEnds, Vec<Vec<u8>>) {
    let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) }.keyed(true, false);
    let mut pair = LinkedEnds::new(12, setup, STILL);
    pair.vehicle.set_map(patchy(12, 1).iter(), pair.now);
    pair.mute = [true, false];
    for _ in 0..6 {
        pair.run(pair.now + Duration::from_secs(30), false);
        pair.restart_surface();
    }
    let calls: Vec<Vec<u8>> = pair.overheard.iter().cloned().collect();
    pair.mute = [false; 2];
    pair.run(pair.now + Duration::from_secs(600), true);
    assert!(pair.is_converged() && calls.len() > 5, "{} calls by {access:?}", calls.len());
    (pair, calls)
}

#[test]
fn replayed_calls_of_the_surface_delay_nothing() {
    for access in ACCESSES {
        let (mut pair, calls) = with_unmet_calls(access);
        let restarts = pair.vehicle.stats().peer_restarts;
        for step in 0..40 {
            let map = patchy(12, step as u64);
            pair.vehicle.set_map(map.iter(), pair.now);
            pair.surface.issue(auv(), utility(step as i8), pair.now).unwrap();
            for i in 0..30 {
                pair.vehicle.handle_frame(&calls[(step + i) % calls.len()], pair.now);
                pair.run(pair.now + Duration::from_secs(1), false);
            }
            assert!(pair.is_converged(), "step {step} by {access:?}");
            assert_eq!(pair.applied.last(), Some(&utility(step as i8)), "step {step} by {access:?}");
        }
        assert_eq!(pair.vehicle.stats().peer_restarts, restarts, "{access:?}");
    }
}

#[test]
fn fifty_replayed_calls_cause_few_answers() {
    for access in ACCESSES {
        let (mut pair, calls) = with_unmet_calls(access);
        pair.mute = [true; 2];
        pair.run(pair.now + Duration::from_secs(120), false);
        let before = pair.vehicle.stats().frames_sent;
        for i in 0..50 {
            pair.vehicle.handle_frame(&calls[i % calls.len()], pair.now);
            pair.run(pair.now + Duration::from_secs(1), false);
        }
        let sent = pair.vehicle.stats().frames_sent - before;
        println!("{access:?}: {sent} transmissions after 50 replays in 50 s");
        assert!(sent <= 25, "{access:?}: {sent} transmissions");
    }
}
