//! Further properties of the link, over seeds, in virtual time.

use crate::pair::{LinkedEnds, LossyChannel, Setup, auv, hold, patchy, surface_of, utility};
use proptest::prelude::*;
use scenecast_protocol::directive::OrderStatus;
use scenecast_protocol::link::{
    Authenticity, DropReason, Mismatch, SlotInboxState, VehicleConfig, VehicleEvent, VehicleLink,
};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map::{Cell, LabelGrid, StateSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::seal::{HeldKey, MissionKey};
use scenecast_protocol::wire::{Address, Envelope, MapOrigin, MissionId, Seal, UtcHours};
use std::collections::BTreeMap;
use std::time::Duration;

const ROUGH: LossyChannel = LossyChannel {
    loss: 0.3,
    duplication: 0.2,
    reordering: 0.2,
    corruption: 0.1,
    talker: 0.2,
    propagation: Duration::from_millis(500),
};

const STILL: LossyChannel =
    LossyChannel { loss: 0.0, duplication: 0.0, reordering: 0.0, corruption: 0.0, talker: 0.0, ..ROUGH };

/// Every cell has the label of the phase.
fn flat(side: i32, phase: u8) -> LabelGrid {
    (0..side * side).map(|i| (Cell::new(i % side, i / side), phase)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::cases(24) as u32))]

    /// Labels are the time: a cell that goes back would be an old map shown as new.
    #[test]
    fn the_shown_map_never_goes_back(
        seed: u64,
        access in prop_oneof![Just(Access::Shared), Just(Access::ModemOwned { pool_frames: 8 }), Just(Access::Polled), Just(Access::FullDuplex)],
        restarts in proptest::collection::vec(0u8..8, 40),
    ) {
        let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) };
        let mut pair = LinkedEnds::new(seed, setup, ROUGH);
        let mut latest: BTreeMap<Cell, u8> = BTreeMap::new();
        for (phase, what) in restarts.into_iter().enumerate() {
            let phase = phase as u8 + 1;
            pair.vehicle.set_map(flat(12, phase).iter(), pair.now);
            for _ in 0..20 {
                pair.run(pair.now + Duration::from_millis(900), false);
                for (cell, label) in pair.shown().iter() {
                    let before = latest.insert(cell, label).unwrap_or(0);
                    prop_assert!(label >= before, "{cell:?} went back from {before} to {label}");
                    prop_assert!(label <= phase);
                }
            }
            match what {
                0 => pair.restart_vehicle(&flat(12, phase)),
                1 => pair.restart_surface(),
                _ => {}
            }
        }
    }
}

#[test]
fn hours_without_an_answer_do_not_make_the_ends_grow() {
    let accesses = [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex];
    for (nth, access) in (0..).zip(accesses) {
        let mutes = [[true, false], [false, true], [true, true], [false, false]].into_iter();
        // In `.ci/run` each access has two other ones.
        for mute in mutes.cycle().skip(nth).take(crate::cases(4) as usize) {
            let mut pair = LinkedEnds::new(5, Setup { access, ..Setup::new(64, 10_000, Codec::Png) }, ROUGH);
            let mut sizes = Vec::new();
            for phase in 0..60u8 {
                pair.vehicle.set_map(flat(20, phase + 1).iter(), pair.now);
                if phase < 10 {
                    pair.vehicle.push_object(vec![phase; 700]);
                }
                pair.surface.issue(auv(), utility(phase as i8), pair.now).unwrap();
                pair.mute = if phase == 0 { [false; 2] } else { mute };
                pair.run(pair.now + Duration::from_secs(300), false);
                sizes.push(pair.size());
            }
            // The sizes grow with the frames of unknown fate until a new run begins, and then again; a replayed hello adds an offered
            // run at any time. A steady growth would leave the smallest size of the last sixth 5/3 as large as the largest one of
            // the first half.
            let (early, late) = (sizes[..30].iter().max().unwrap(), sizes[50..].iter().min().unwrap());
            assert!(late * 2 < early * 3, "{access:?}, mute {mute:?}: {sizes:?}");
            let most = sizes.iter().max().unwrap();
            assert!(*most < 600_000, "{access:?}, mute {mute:?}: {most} bytes");
        }
    }
}

#[test]
fn clocks_that_are_more_than_a_day_apart_are_named_at_both_ends() {
    let hours = |hours: u64| UtcHours::from_unix(Duration::from_secs(3600 * hours)).unwrap();
    for (apart, expected) in [(24, None), (25, Some(Mismatch::Clock(1))), (24 * 365, Some(Mismatch::Clock(365)))] {
        for is_ahead in [true, false] {
            let mut pair = LinkedEnds::new(3, Setup::new(64, 10_000, Codec::Png).keyed(true, true), STILL);
            let (late, early) = (hours(500_000 + apart), hours(500_000));
            pair.vehicle.set_clock(if is_ahead { late } else { early });
            pair.surface.set_clock(if is_ahead { early } else { late });
            pair.run(pair.now + Duration::from_secs(30), false);
            assert_eq!(pair.surface.vehicle(auv()).unwrap().mismatch(pair.now), expected);
            let named = pair.vehicle_events.iter().find_map(|event| match event {
                VehicleEvent::Mismatch(mismatch) => Some(*mismatch),
                _ => None,
            });
            assert_eq!(named, expected);
        }
    }
}

#[test]
fn a_clock_that_is_set_right_or_wrong_under_way_is_noticed() {
    let hours = |hours: u64| UtcHours::from_unix(Duration::from_secs(3600 * hours)).unwrap();
    let mut pair = LinkedEnds::new(3, Setup::new(64, 10_000, Codec::Png).keyed(true, true), STILL);
    pair.vehicle.set_clock(hours(500_000));
    pair.surface.set_clock(hours(500_000));
    pair.run(pair.now + Duration::from_secs(30), false);
    let mismatch = |pair: &LinkedEnds| pair.surface.vehicle(auv()).unwrap().mismatch(pair.now);
    (1..100).for_each(|hour| pair.surface.set_clock(hours(500_000 + hour)));
    assert_eq!(mismatch(&pair), None, "it goes on");
    pair.surface.set_clock(hours(500_099 - 24 * 30));
    assert_eq!(mismatch(&pair), Some(Mismatch::Clock(30)));
    pair.surface.set_clock(hours(500_099));
    assert_eq!(mismatch(&pair), None);
    pair.surface.set_clock(hours(500_200));
    assert_eq!(mismatch(&pair), None, "the computer may have slept");
}

#[test]
fn each_frame_that_a_free_modem_carries_first_acknowledges() {
    let setup = Setup { access: Access::FullDuplex, ..Setup::new(64, 400, Codec::Auto) };
    let mut pair = LinkedEnds::new(3, setup, STILL);
    pair.vehicle.set_map(patchy(200, 1).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(60), false);
    for is_held in [true, false, true] {
        pair.surface.issue(auv(), hold(is_held), pair.now).unwrap();
        pair.run(pair.now + Duration::from_secs(4), false);
        let view = pair.surface.vehicle(auv()).unwrap();
        let status = view.slots().map(|slot| slot.status).last().unwrap();
        assert!(matches!(status, OrderStatus::Received | OrderStatus::Applied), "{status:?}");
        pair.run(pair.now + Duration::from_secs(20), false);
    }
}

#[test]
fn frames_for_which_a_cycle_has_no_room_are_not_lost() {
    let setup = Setup { access: Access::Polled, cycle_frames: 1, ..Setup::new(64, 10_000, Codec::Png) };
    let mut pair = LinkedEnds::new(3, setup, STILL);
    pair.run(pair.now + Duration::from_secs(300), false);
    let stats = pair.surface.vehicle(auv()).unwrap().stats().clone();
    assert_eq!((stats.frames_lost, stats.outgoing.loss.share()), (0, 0.0));
    assert!(stats.frames_delivered > 10 && stats.frames_delivered <= stats.frames_sent, "{stats:?}");
}

#[test]
fn settings_that_differ_are_named_at_both_ends() {
    let common = || Setup::new(64, 10_000, Codec::Png).keyed(true, false);
    let origin = |lat_deg| Setup { origin: Some(MapOrigin::from_degrees(lat_deg, 5.0)), ..common() };
    let duplex = || Setup { access: Access::FullDuplex, ..common() };
    let orders_only = || Setup::new(64, 10_000, Codec::Png).keyed(false, false);
    let cases = [
        (origin(43.0), origin(44.0), Some(Mismatch::Origin(111_195))),
        (origin(43.0), origin(43.000_05), None),
        (origin(43.0), common(), None),
        (duplex(), common(), Some(Mismatch::Switch("", "modem.full_duplex"))),
        (orders_only(), common(), Some(Mismatch::Switch("", "link.authenticate"))),
        (common(), common().keyed(true, true), Some(Mismatch::Switch("", "link.encrypt"))),
    ];
    let kind = |mismatch: Mismatch| match mismatch {
        Mismatch::Switch(_, key) => Mismatch::Switch("", key),
        other => other,
    };
    for (one, other, named) in cases {
        for (vehicle, surface) in [(&one, &other), (&other, &one)] {
            let mut pair = LinkedEnds::new(3, vehicle.clone(), STILL);
            pair.surface = surface_of(surface, 4, pair.now);
            for seconds in [30, 600] {
                pair.run(pair.now + Duration::from_secs(seconds), false);
                assert_eq!(
                    pair.surface.vehicle(auv()).unwrap().mismatch(pair.now).map(kind),
                    named,
                    "after {seconds} s"
                );
            }
            let told = pair.vehicle_events.iter().find_map(|event| match event {
                VehicleEvent::Mismatch(mismatch) => Some(kind(*mismatch)),
                _ => None,
            });
            assert_eq!(told, named);
        }
    }
}

#[test]
fn a_vehicle_that_is_never_called_names_the_one_that_is() {
    let setup = Setup::new(64, 10_000, Codec::Png);
    let mut pair = LinkedEnds::new(3, setup.clone(), STILL);
    let config = VehicleConfig::new(Address::vehicle(2).unwrap(), setup.mission, setup.modem(), setup.budget_bps);
    let mut uncalled = VehicleLink::new(config, setup.codec, 5, SlotInboxState::default(), pair.now);
    let mut named_s = Vec::new();
    for second in 0..1500 {
        pair.run(pair.now + Duration::from_secs(1), false);
        for bytes in std::mem::take(&mut pair.overheard) {
            uncalled.handle_frame(&bytes, pair.now);
        }
        while let Some(event) = uncalled.poll_event() {
            named_s.extend((event == VehicleEvent::Mismatch(Mismatch::NotCalled(1))).then_some(second));
        }
    }
    assert!(matches!(named_s[..], [second] if (600..660).contains(&second)), "{named_s:?}");
    assert!(!pair.vehicle_events.iter().any(|event| matches!(event, VehicleEvent::Mismatch(_))));
}

#[test]
fn both_ends_name_another_key_or_mission_within_30_seconds() {
    let common = || Setup::new(64, 10_000, Codec::Png);
    let key = HeldKey::Mission(MissionKey::from_bytes([43; 16]));
    let other_key = Setup { authenticity: Some(Authenticity::new(key, true, false)), ..common() };
    let other_mission = Setup { mission: MissionId(8), ..common() };
    let cases = [
        (common().keyed(true, false), other_key, Mismatch::Key),
        (common(), other_mission, Mismatch::Key),
        (common().keyed(true, false), common(), Mismatch::NoTag),
        (common(), common().keyed(true, false), Mismatch::Tag),
    ];
    for (vehicle, surface, named) in cases {
        for access in [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex] {
            let mut pair = LinkedEnds::new(3, Setup { access, ..vehicle.clone() }, STILL);
            pair.surface = surface_of(&Setup { access, ..surface.clone() }, 4, pair.now);
            pair.run(pair.now + Duration::from_secs(30), false);
            assert_eq!(pair.vehicle_events, [VehicleEvent::Mismatch(named)], "{access:?}");
            let mismatch = pair.surface.vehicle(auv()).unwrap().mismatch(pair.now);
            assert_eq!(mismatch, Some(Mismatch::Unverified), "{access:?}, {named}");
        }
    }
}

#[test]
fn a_surface_names_a_vehicle_whose_frames_do_not_verify() {
    let common = Setup::new(64, 10_000, Codec::Png).keyed(true, false);
    let mut pair = LinkedEnds::new(3, common.clone(), STILL);
    pair.vehicle.set_map(flat(9, 1).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(120), false);
    let key = HeldKey::Mission(MissionKey::from_bytes([43; 16]));
    let other_key = Setup { authenticity: Some(Authenticity::new(key, true, false)), ..common };
    let mut listener = surface_of(&other_key, 4, pair.now);
    let mut mismatches = Vec::new();
    for bytes in &pair.overheard {
        listener.handle_frame(bytes, pair.now);
        mismatches.push(listener.vehicle(auv()).and_then(|view| view.mismatch(pair.now)));
    }
    assert_eq!(mismatches.last(), Some(&Some(Mismatch::Foreign)), "{} frames", mismatches.len());
    assert_eq!(pair.surface.vehicle(auv()).unwrap().mismatch(pair.now), None);
}

#[test]
fn frames_of_another_mission_are_dropped() {
    for keyed in [false, true] {
        let setup = Setup::new(64, 10_000, Codec::Png);
        let setup = if keyed { setup.keyed(true, false) } else { setup };
        let mut ours = LinkedEnds::new(1, setup.clone(), STILL);
        let mut theirs = LinkedEnds::new(2, Setup { mission: MissionId(8), ..setup }, STILL);
        for phase in 0..60u8 {
            for pair in [&mut ours, &mut theirs] {
                pair.vehicle.set_map(flat(9, phase + 1).iter(), pair.now);
                pair.surface.issue(auv(), hold(phase % 2 == 0), pair.now).unwrap();
                pair.run(pair.now + Duration::from_secs(20), false);
            }
            let heard = ours.vehicle.stats().frames_received;
            for bytes in &theirs.overheard {
                ours.vehicle.handle_frame(bytes, ours.now);
                ours.surface.handle_frame(bytes, ours.now);
            }
            assert_eq!(ours.vehicle.stats().frames_received, heard, "a frame of another mission was taken");
            assert_eq!(ours.vehicle.poll_event(), None);
        }
        assert!(ours.vehicle.stats().dropped[&DropReason::Checksum] > 1000);
    }
}

/// A small generator, so that a million tries are cheap.
struct TestRng(u64);

impl TestRng {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n
    }
}

/// A forgery that is possible without the key, made from an overheard frame.
fn forge(frame: &[u8], rng: &mut TestRng) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    match rng.below(4) {
        0 => {}
        1 => {
            let bit = rng.below(bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        2 => {
            for _ in 0..1 + rng.below(8) {
                let at = rng.below(bytes.len());
                bytes[at] = rng.below(256) as u8;
            }
        }
        // The tag is random, the rest unchanged or slightly changed.
        _ => {
            let n = bytes.len();
            bytes.iter_mut().skip(n - 8).for_each(|b| *b = rng.below(256) as u8);
            let at = rng.below(n - 8);
            bytes[at] ^= 1 << rng.below(8);
        }
    }
    bytes
}

#[test]
fn no_forged_replayed_or_flipped_directive_is_applied() {
    let mut recorded: Vec<Vec<u8>> = Vec::new();
    let mut pair = LinkedEnds::new(11, Setup::new(64, 10_000, Codec::Png).keyed(false, false), STILL);
    for run in 0..6 {
        for step in 0..10 {
            pair.surface.issue(auv(), utility(run * 10 + step), pair.now).unwrap();
            pair.surface.issue(auv(), hold(step % 2 == 0), pair.now).unwrap();
            pair.run(pair.now + Duration::from_secs(30), false);
        }
        recorded.extend(pair.overheard.iter().filter(|f| f[1] >> 4 == 0).cloned());
        match run % 2 {
            0 => pair.restart_vehicle(&LabelGrid::default()),
            _ => pair.restart_surface(),
        }
    }
    // The vehicle stays with the surface of before until that was silent for two minutes.
    pair.run(pair.now + Duration::from_secs(300), false);
    let applied = pair.applied.len();
    assert!(applied >= 100 && recorded.len() > 200, "{applied} applied, {} recorded", recorded.len());
    let mut rng = TestRng(3);
    for _ in 0..1_000_000 {
        let bytes = forge(&recorded[rng.below(recorded.len())], &mut rng);
        pair.vehicle.handle_frame(&bytes, pair.now);
        let event = pair.vehicle.poll_event();
        assert!(!matches!(event, Some(VehicleEvent::Slot { .. })), "{event:?} from {bytes:02x?}");
    }
    // The forgeries have not broken the link.
    pair.surface.issue(auv(), utility(99), pair.now).unwrap();
    pair.run(pair.now + Duration::from_secs(120), false);
    assert_eq!(pair.applied.last(), Some(&utility(99)));
}

#[test]
fn a_keyed_vehicle_refuses_and_counts_unkeyed_frames() {
    let plain = Setup::new(64, 10_000, Codec::Png);
    let mut keyless = LinkedEnds::new(1, plain.clone(), STILL);
    keyless.surface.issue(auv(), hold(true), keyless.now).unwrap();
    keyless.run(keyless.now + Duration::from_secs(60), false);
    let mut keyed = LinkedEnds::new(2, plain.keyed(false, false), STILL);
    for bytes in &keyless.overheard {
        keyed.vehicle.handle_frame(bytes, keyed.now);
    }
    // It hears the surface, and the other vehicle under its own address.
    let reported: Vec<_> = std::iter::from_fn(|| keyed.vehicle.poll_event()).collect();
    let expected = [Mismatch::OwnAddress, Mismatch::NoTag].map(VehicleEvent::Mismatch);
    assert_eq!(reported, expected, "each is reported once");
    // Only hellos of another mission can be recognised; other frames are sealed to a run that is not ours.
    let to_vehicle = |bytes: &&Vec<u8>| {
        let envelope = Envelope::decode(bytes, |to| to == auv()).ok();
        envelope.is_some_and(|e| e.header.from == Address::SURFACE && e.open(&Seal::Crc(MissionId(7), 0)).is_some())
    };
    let greetings = keyless.overheard.iter().filter(to_vehicle).count() as u64;
    assert!(greetings > 0);
    assert_eq!(keyed.vehicle.stats().dropped[&DropReason::Unauthenticated], greetings);
    keyless.vehicle.handle_frame(&keyed_hello(), keyless.now);
    assert_eq!(keyless.vehicle.stats().dropped[&DropReason::Keyed], 1);
}

#[test]
fn a_frame_with_a_bad_crc_never_begins_a_new_run() {
    let mut pair = LinkedEnds::new(3, Setup::new(64, 10_000, Codec::Png), STILL);
    pair.vehicle.set_map(flat(9, 1).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(30), false);
    // These frames of the vehicle's first run come in late.
    pair.mute = [false, true];
    pair.overheard.clear();
    pair.vehicle.set_map(flat(9, 2).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(60), false);
    let is_late = |bytes: &&Vec<u8>| {
        Envelope::decode(bytes, |_| true).is_ok_and(|e| e.header.from == auv() && !e.header.kind().is_hello())
    };
    let mut late: Vec<Vec<u8>> = pair.overheard.iter().rev().filter(is_late).cloned().collect();
    let mut seen = std::collections::BTreeSet::new();
    late.retain(|bytes| seen.insert(bytes.clone()));
    assert!(late.len() >= 4, "{} frames", late.len());
    pair.mute = [false; 2];
    pair.restart_vehicle(&flat(9, 2));
    pair.run(pair.now + Duration::from_secs(60), false);
    let resyncs = |pair: &LinkedEnds| pair.surface.vehicle(auv()).unwrap().stats().resyncs;
    let before = resyncs(&pair);
    pair.mute = [true; 2];
    pair.run(pair.now + Duration::from_secs(120), false);
    late[..2].iter().for_each(|bytes| pair.surface.handle_frame(bytes, pair.now));
    let mut damaged = late[2].clone();
    damaged[5] ^= 0x10;
    pair.surface.handle_frame(&damaged, pair.now);
    assert_eq!(resyncs(&pair), before, "by a damaged frame");
    pair.surface.handle_frame(&late[2], pair.now);
    assert_eq!(
        resyncs(&pair),
        before + 1,
        "by a whole one: {:?}",
        pair.surface.vehicle(auv()).unwrap().stats().dropped
    );
}

fn keyed_hello() -> Vec<u8> {
    let mut keyed = LinkedEnds::new(2, Setup::new(64, 10_000, Codec::Png).keyed(false, false), STILL);
    keyed.run(keyed.now + Duration::from_secs(10), false);
    keyed.overheard.back().cloned().expect("a hello")
}

#[test]
fn each_end_measures_the_others_clock_and_distance() {
    let mut pair = LinkedEnds::new(4, Setup::new(64, 10_000, Codec::Png), LossyChannel { loss: 0.2, ..STILL });
    pair.vehicle.set_map(flat(30, 1).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(120), false);
    let view = pair.surface.vehicle(auv()).unwrap();
    let round_trip = view.round_trip().unwrap().as_secs_f64();
    assert!((round_trip - 1.0).abs() < 0.01, "{round_trip} s");
    assert!((pair.vehicle.one_way().unwrap().as_secs_f64() - 0.5).abs() < 0.01);
    // Both ends share one clock here, so converted times must equal the original ones.
    let now = pair.now;
    for clock in [view.clock().unwrap(), pair.vehicle.surface_clock().unwrap()] {
        let shown = clock.to_theirs(now);
        let error = (clock.to_ours(shown, now).as_secs_f64() - now.as_secs_f64()).abs();
        let apart = (f64::from(shown) / 1000.0 - now.as_secs_f64()).abs();
        assert!(error < 0.002 && apart < 0.01, "{error} {apart}");
    }
}

#[test]
fn the_surface_estimates_the_vehicles_backlog() {
    let mut pair = LinkedEnds::new(5, Setup::new(256, 1000, Codec::Context), LossyChannel { loss: 0.2, ..STILL });
    let told =
        |pair: &LinkedEnds| pair.surface.vehicle(auv()).and_then(|v| v.backlog()).map(|(b, _)| b.map_bytes as usize);
    let mut compared = 0;
    for phase in 0..10 {
        pair.vehicle.set_map(patchy(200, phase).iter(), pair.now);
        pair.run(pair.now + Duration::from_secs(30), false);
        let (told, is) = (told(&pair), pair.vehicle.source().expected_backlog_bytes());
        if let Some(told) = told.filter(|_| phase > 2 && is > 300) {
            // The vehicle's estimate changes with the cells that it sends, and excludes those in flight.
            assert!((is / 3..=is * 3).contains(&told), "{told} bytes are said to wait, and {is} do");
            compared += 1;
        }
    }
    pair.run(pair.now + Duration::from_secs(400), false);
    assert!(compared >= 3, "the map was told too soon: {compared}");
    assert_eq!((told(&pair), pair.is_converged()), (Some(0), true));
}
