//! The change to the next key, through losses, replays and restarts.

use crate::pair::{CALM, LinkedEnds, LossyChannel, Setup, auv, hold, patchy, utility};
use proptest::prelude::*;
use scenecast_protocol::link::{Authenticity, SurfaceEvent};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::seal::{HeldKey, MissionKey};
use std::sync::Arc;
use std::time::Duration;

const ACCESSES: [Access; 4] =
    [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex];

fn key(byte: u8) -> HeldKey {
    HeldKey::Mission(MissionKey::from_bytes([byte; 16]))
}

fn keys(present: u8, next: Option<u8>) -> Option<Authenticity> {
    let next = next.map(|byte| Arc::new(key(byte)));
    Some(Authenticity { next, ..Authenticity::new(key(present), true, false) })
}

/// Both ends with the present key, in contact; the vehicle has its own alone.
fn ends(seed: u64, access: Access, channel: LossyChannel) -> LinkedEnds {
    let setup = Setup { authenticity: keys(1, None), access, ..Setup::new(64, 10_000, Codec::Auto) };
    let mut ends = LinkedEnds::new(seed, setup, channel);
    let own = HeldKey::Vehicle(key(1).vehicle(auv().number()));
    ends.vehicle_keys = Some(Authenticity::new(own, true, false));
    ends.restart_vehicle(&patchy(12, 1));
    ends
}

fn run(ends: &mut LinkedEnds, seconds: u64) {
    ends.run(ends.now + Duration::from_secs(seconds), false);
}

/// Restarts the surface as its host does: its orders go on in their series, so that it is no other surface.
fn restart_same_surface(ends: &mut LinkedEnds) {
    let series = ends.surface.series();
    ends.restart_surface();
    ends.surface.restore_series(series);
}

/// The mission key of which the vehicle holds keys, and that of the next ones.
fn held(ends: &LinkedEnds) -> (u32, Option<u32>) {
    let keys = ends.vehicle_keys.as_ref().unwrap();
    (keys.key.fingerprint(), keys.next.as_ref().map(|next| next.fingerprint()))
}

#[test]
fn the_vehicle_changes_to_the_next_key_and_drops_the_old_one() {
    for access in ACCESSES {
        let mut ends = ends(5, access, CALM);
        run(&mut ends, 60);
        ends.surface.issue(auv(), hold(true), ends.now).unwrap();
        run(&mut ends, 60);
        ends.set_surface_keys(keys(1, Some(2)));
        restart_same_surface(&mut ends);
        run(&mut ends, 90);
        assert_eq!(held(&ends), (key(2).fingerprint(), None), "{access:?}");
        assert!(ends.surface_events.contains(&SurfaceEvent::KeyChanged(auv())), "{access:?}");
        ends.surface.issue(auv(), utility(5), ends.now).unwrap();
        run(&mut ends, 120);
        assert!(ends.is_converged(), "{access:?}");
        assert_eq!(ends.applied, [hold(true), utility(5)], "{access:?}");

        ends.set_surface_keys(keys(1, None));
        ends.restart_surface();
        ends.surface.issue(auv(), hold(false), ends.now).unwrap();
        run(&mut ends, 300);
        assert_eq!(ends.applied.len(), 2, "{access:?}: an order under the key before");

        ends.set_surface_keys(keys(2, None));
        ends.restart_surface();
        run(&mut ends, 240);
        ends.surface.issue(auv(), hold(false), ends.now).unwrap();
        run(&mut ends, 60);
        assert!(ends.is_converged(), "{access:?}: the surface has the next key alone");
        assert_eq!(ends.applied.len(), 3, "{access:?}: an order under the next key");
    }
}

#[test]
fn a_surface_that_still_has_both_keys_finds_vehicles_of_either() {
    for access in ACCESSES {
        let mut ends = ends(6, access, CALM);
        ends.set_surface_keys(keys(1, Some(2)));
        restart_same_surface(&mut ends);
        run(&mut ends, 120);
        assert_eq!(held(&ends).0, key(2).fingerprint(), "{access:?}");
        // Nothing of it remembers that the vehicle has changed.
        restart_same_surface(&mut ends);
        run(&mut ends, 120);
        assert!(ends.is_converged(), "{access:?}: a vehicle that has changed");
        // The vehicle's folder is lost, and its key file has the key before.
        ends.vehicle_keys = Some(Authenticity::new(HeldKey::Vehicle(key(1).vehicle(1)), true, false));
        ends.restart_vehicle(&patchy(12, 1));
        run(&mut ends, 240);
        assert!(ends.is_converged(), "{access:?}: a vehicle that has lost it");
        assert_eq!(held(&ends).0, key(2).fingerprint(), "{access:?}: it changes again");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn restarts_losses_and_replays_end_in_the_next_key(
        seed: u64,
        access in prop::sample::select(&ACCESSES[..]),
        restarts in proptest::collection::vec((2u64..40, any::<bool>()), 0..8),
    ) {
        let channel = LossyChannel { loss: 0.3, duplication: 0.1, reordering: 0.1, corruption: 0.05, talker: 0.2, ..CALM };
        let mut ends = ends(seed, access, channel);
        run(&mut ends, 30);
        ends.set_surface_keys(keys(1, Some(2)));
        restart_same_surface(&mut ends);
        for (pause, of_vehicle) in restarts {
            run(&mut ends, pause);
            match of_vehicle {
                true => ends.restart_vehicle(&patchy(12, 1)),
                false => restart_same_surface(&mut ends),
            }
        }
        ends.channel = CALM;
        run(&mut ends, 300);
        prop_assert_eq!(held(&ends), (key(2).fingerprint(), None));
        prop_assert!(ends.is_converged());
    }
}
