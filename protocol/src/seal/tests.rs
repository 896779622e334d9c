//! Properties of the keys together.

use super::*;
use proptest::collection::vec;
use proptest::prelude::*;
use std::collections::BTreeSet;

const KEY: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
const MISSION: u32 = 0x5CE7_0001;
const NONCES: [u64; 2] = [0x0102_0304_0506_0708, 0x1112_1314_1516_1718];

fn mission() -> MissionKey {
    MissionKey::from_bytes(KEY)
}

fn key() -> LinkKey {
    mission().vehicle(1)
}

fn session(encrypt: bool) -> SessionKey {
    key().session(MISSION, 1, NONCES[0], NONCES[1], encrypt)
}

fn direction() -> impl Strategy<Value = Direction> {
    prop_oneof![Just(Direction::Down), Just(Direction::Up)]
}

fn flip(bytes: &mut [u8], bit: usize) {
    bytes[bit / 8] ^= 1 << (bit % 8);
}

#[test]
fn nonces_are_those_of_their_key_and_reveal_no_other() {
    let drawn: BTreeSet<u64> = (0..1000).map(|number| key().nonce(number)).collect();
    assert_eq!(drawn.len(), 1000);
    assert!((0..1000).all(|number| MissionKey::from_bytes([9; 16]).vehicle(1).nonce(number) != key().nonce(number)));
    assert_eq!(key().nonce(1), 809_121_194_474_746_411);
}

/// Values for another implementation to check itself; one in Python, written from the standard, confirms them.
#[test]
fn golden_bytes() {
    let seal = |encrypt, direction| {
        let mut body = *b"body of a frame";
        let tag = session(encrypt).seal(direction, 5, b"head", &mut body);
        (u64::from_be_bytes(tag), body)
    };
    assert_eq!(mission().fingerprint(), 0x95fb_836d);
    assert_eq!(&**mission().to_text(), "scenecast-key 2 000102030405060708090a0b0c0d0e0f 95fb836d\n");
    assert_eq!(u64::from_be_bytes(key().hello_tag(&[b"hello", b"", b"\x01\x02"])), 0x2e61_b3cc_25e3_228a);
    assert_eq!(seal(false, Direction::Down), (0x578f_056c_0ae3_b9d6, *b"body of a frame"));
    assert_eq!(seal(false, Direction::Up), (0xdcab_318e_f936_3a6c, *b"body of a frame"));
    let hidden = [0x88, 0x75, 0xd6, 0x14, 0x9b, 0x5f, 0x3b, 0xb7, 0x92, 0xb9, 0x49, 0xa5, 0xf7, 0xd4, 0x85];
    assert_eq!(seal(true, Direction::Down), (0x6fbc_42cb_ebdd_8b79, hidden));
}

#[test]
fn debug_output_hides_the_secret() {
    let said = format!("{:?} {:?} {:?}", mission(), key(), session(true));
    assert_eq!(said, format!("MissionKey({:08x}) LinkKey SessionKey {{ encrypt: true, .. }}", mission().fingerprint()));
}

#[test]
fn every_input_of_a_session_changes_its_key() {
    let [s, v] = NONCES;
    let mut tags = BTreeSet::new();
    let other = MissionKey::from_bytes([7; 16]).vehicle(1);
    for key in [key(), other] {
        for (mission, vehicle, s, v) in
            [(MISSION, 1, s, v), (MISSION + 1, 1, s, v), (MISSION, 2, s, v), (MISSION, 1, v, s), (MISSION, 1, s, v + 1)]
        {
            for encrypt in [false, true] {
                tags.insert(key.session(mission, vehicle, s, v, encrypt).seal(Direction::Down, 0, &[], &mut []));
            }
        }
    }
    assert_eq!(tags.len(), 20);
}

#[test]
fn no_plain_session_opens_an_encrypted_frame() {
    let mut body = *b"body";
    let tag = session(true).seal(Direction::Up, 1, b"head", &mut body);
    assert!(!session(false).open(Direction::Up, 1, b"head", &mut body, &tag));
    let mut body = *b"body";
    let tag = session(false).seal(Direction::Up, 1, b"head", &mut body);
    assert!(!session(true).open(Direction::Up, 1, b"head", &mut body, &tag));
}

#[test]
fn a_tag_of_another_length_is_a_wrong_one() {
    for encrypt in [false, true] {
        let mut body = *b"body";
        let tag = session(encrypt).seal(Direction::Up, 1, b"head", &mut body);
        for wrong in [&tag[..0], &tag[..7], &[&tag[..], &[0]].concat()] {
            let mut received = body;
            assert!(!session(encrypt).open(Direction::Up, 1, b"head", &mut received, wrong));
            assert_eq!(received, if encrypt { [0; 4] } else { body });
        }
        assert!(session(encrypt).open(Direction::Up, 1, b"head", &mut body, &tag));
    }
}

/// Of a million random forgeries none succeeds, in either kind of session or as a hello.
#[test]
fn random_forgeries_are_refused() {
    let (sessions, key) = ([session(false), session(true)], key());
    // SplitMix64 (Steele, Lea and Flood, 2014).
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    };
    let mut opened = 0;
    for i in 0..1_000_000u64 {
        let (mut body, tag) = ([random().to_be_bytes(), random().to_be_bytes()].concat(), random().to_be_bytes());
        opened += u32::from(match i % 3 {
            2 => key.verify_hello(&[b"head", &body], &tag),
            kind => sessions[kind as usize].open(Direction::Down, i / 3 % 8, b"head", &mut body, &tag),
        });
    }
    assert_eq!(opened, 0);
}

proptest! {
    #[test]
    fn a_sealed_frame_opens(
        encrypt: bool, direction in direction(), number: u64, head in vec(any::<u8>(), 0..40), body in vec(any::<u8>(), 0..300),
    ) {
        let mut sealed = body.clone();
        let tag = session(encrypt).seal(direction, number, &head, &mut sealed);
        prop_assert!(encrypt || sealed == body);
        prop_assert!(!encrypt || body.len() < 8 || sealed != body);
        prop_assert!(session(encrypt).open(direction, number, &head, &mut sealed, &tag));
        prop_assert_eq!(sealed, body);
    }

    #[test]
    fn a_boundary_between_head_and_body_that_moved_is_refused(
        encrypt: bool, frame in vec(any::<u8>(), 1..60), a in 0usize..60, b in 0usize..60,
    ) {
        let (a, b) = (a % (frame.len() + 1), b % (frame.len() + 1));
        prop_assume!(a != b);
        let mut sealed = frame.clone();
        let (head, body) = sealed.split_at_mut(a);
        let tag = session(encrypt).seal(Direction::Up, 1, head, body);
        let (head, body) = sealed.split_at_mut(b);
        prop_assert!(!session(encrypt).open(Direction::Up, 1, head, body, &tag));
    }

    /// Flips every bit in turn: of head, body, tag, number, direction, both nonces, mission and vehicle.
    #[test]
    fn a_flipped_bit_is_refused(encrypt: bool, head in vec(any::<u8>(), 0..12), body in vec(any::<u8>(), 0..40), number: u64) {
        let mut sealed = body.clone();
        let tag = session(encrypt).seal(Direction::Down, number, &head, &mut sealed);
        let open = |key: &SessionKey, direction, number, head: &[u8], body: &[u8], tag: &[u8]| {
            let mut body = body.to_vec();
            let opened = key.open(direction, number, head, &mut body, tag);
            assert!(opened || !encrypt || body.iter().all(|&b| b == 0));
            opened
        };
        let ours = session(encrypt);
        prop_assert!(open(&ours, Direction::Down, number, &head, &sealed, &tag));
        prop_assert!(!open(&ours, Direction::Up, number, &head, &sealed, &tag));
        for bit in 0..head.len() * 8 {
            let mut head = head.clone();
            flip(&mut head, bit);
            prop_assert!(!open(&ours, Direction::Down, number, &head, &sealed, &tag));
        }
        for bit in 0..sealed.len() * 8 {
            let mut sealed = sealed.clone();
            flip(&mut sealed, bit);
            prop_assert!(!open(&ours, Direction::Down, number, &head, &sealed, &tag));
        }
        for bit in 0..64 {
            let mut wrong = tag;
            flip(&mut wrong, bit);
            prop_assert!(!open(&ours, Direction::Down, number, &head, &sealed, &wrong));
            prop_assert!(!open(&ours, Direction::Down, number ^ 1 << bit, &head, &sealed, &tag));
            let [s, v] = NONCES;
            for key in [
                key().session(MISSION, 1, s ^ 1 << bit, v, encrypt),
                key().session(MISSION, 1, s, v ^ 1 << bit, encrypt),
                key().session(MISSION ^ 1 << (bit % 32), 1, s, v, encrypt),
                key().session(MISSION, 1 ^ 1 << (bit % 8), s, v, encrypt),
            ] {
                prop_assert!(!open(&key, Direction::Down, number, &head, &sealed, &tag));
            }
        }
    }

    #[test]
    fn a_hello_verifies_until_a_bit_or_a_boundary_differs(
        a in vec(any::<u8>(), 1..20), b in vec(any::<u8>(), 0..20), bit in 0usize..160,
    ) {
        let tag = key().hello_tag(&[&a, &b]);
        prop_assert!(key().verify_hello(&[&a, &b], &tag));
        prop_assert!(!key().verify_hello(&[&[&a[..], &b].concat()], &tag));
        prop_assert!(!key().verify_hello(&[&a, &b, &[]], &tag));
        let mut wrong = tag;
        flip(&mut wrong, bit % 64);
        prop_assert!(!key().verify_hello(&[&a, &b], &wrong));
        let mut other = a.clone();
        flip(&mut other, bit % (a.len() * 8));
        prop_assert!(!key().verify_hello(&[&other, &b], &tag));
    }
}
