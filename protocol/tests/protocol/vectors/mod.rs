//! The test vectors in `protocol/vectors` are what the code writes and reads.

mod files;
mod maps;
mod parts;
mod samples;
mod transfers;

use crate::examples::vectors::{FrameVector, Frames, Hex, content, listener};
use crc::{CRC_32_ISO_HDLC, Crc};
use files::{assert_capture, assert_file, named};
use samples::{
    CALL_NONCE, CALL_SESSION, MISSION, SURFACE_NONCE, SURFACE_SESSION, VEHICLE_SESSION, all_up_to, answer_of_vehicle,
    answered, auv, call, clock, crc, first_of_surface, frame, header, here, hold, introduction, key, map_payload,
    mission_key, session, surface_hello, vehicle_hello,
};
use scenecast_protocol::seal::{Direction, MissionKey, VehicleKey};
use scenecast_protocol::wire::{Address, ChunkKind, Header, MissionId, Seal, SessionId, WIRE_VERSION};

const DOCUMENT: &str = include_str!("../../../WIRE.md");

#[test]
fn frames_are_those_of_the_vectors() {
    let key: [u8; 16] = std::array::from_fn(|i| i as u8);
    let key = Hex(key.to_vec());
    let mission = format!("{:08x}", MISSION.0);
    let mut listener = listener(&mission, &key);
    let mut vectors = Vec::new();
    for (name, bytes) in [with_a_crc(), with_a_tag(), refused()].concat() {
        let says = content(&mut listener, &bytes);
        assert_eq!(says.is_none(), name.starts_with("refused: "), "{name}");
        vectors.push(FrameVector { name: name.to_owned(), bytes: Hex(bytes), says });
    }
    assert_capture("frames.pcap", vectors.iter().map(|vector| vector.bytes.0.as_slice()));
    assert_file("frames.json", &Frames { mission, key, frames: vectors });
}

/// Names and bytes of frames.
type Rows = Vec<(&'static str, Vec<u8>)>;

fn with_a_crc() -> Rows {
    let hello_crc = |session: u16| Seal::Crc(MISSION, session);
    let slot = [(ChunkKind::Slot, hold())];
    let grant = Header {
        base: 2,
        turn: Some(48),
        stamp: clock(55_100, Some(667)),
        ack: all_up_to(3, vec![1]),
        ..header(Address::SURFACE, 3)
    };
    let map = Header { base: 2, remaining: 1, ..header(auv(), 2) };
    let empty = Header { turn: Some(20), ..header(auv(), 3) };
    let far = Header::numbered(auv(), Address::SURFACE, 300, 200);
    vec![
        ("hello of the surface", frame(surface_hello(false), 64, true, hello_crc(0), &introduction(true))),
        (
            "hello of the vehicle",
            frame(vehicle_hello(false), 64, true, hello_crc(SURFACE_SESSION), &introduction(false)),
        ),
        (
            "first numbered frame of the surface",
            frame(first_of_surface(false), 64, true, crc(Address::SURFACE, 1), &slot),
        ),
        ("grant with an ack statement", frame(grant, 64, true, crc(Address::SURFACE, 3), &[])),
        ("answer of the vehicle", frame(answer_of_vehicle(false), 64, true, crc(auv(), 1), &answered())),
        ("map frame in the middle of a turn", frame(map, 48, false, crc(auv(), 2), &[(ChunkKind::Map, map_payload())])),
        ("frame without content", frame(empty, 64, true, crc(auv(), 3), &[])),
        ("frame with a base of two bytes", frame(far, 64, true, crc(auv(), 300), &[])),
        ("call", frame(call(false), 64, true, hello_crc(0), &[])),
        ("here", frame(here(false), 64, true, hello_crc(CALL_SESSION), &[])),
    ]
}

fn with_a_tag() -> Rows {
    let key = key();
    let hello = |session: u16, nonce: u64| Seal::Hello(&key, MISSION, session, nonce);
    let (plain, secret) = (session(false), session(true));
    let slot = [(ChunkKind::Slot, hold())];
    let down = |key| frame(first_of_surface(true), 64, true, Seal::Session(key, Direction::Down, 1), &slot);
    let up = |key| frame(answer_of_vehicle(true), 64, true, Seal::Session(key, Direction::Up, 1), &answered());
    vec![
        ("keyed hello of the surface", frame(surface_hello(true), 64, true, hello(0, 0), &introduction(true))),
        (
            "keyed hello of the vehicle",
            frame(vehicle_hello(true), 64, true, hello(SURFACE_SESSION, SURFACE_NONCE), &introduction(false)),
        ),
        ("keyed numbered frame of the surface", down(&plain)),
        ("keyed numbered frame of the vehicle", up(&plain)),
        ("encrypted numbered frame of the surface", down(&secret)),
        ("encrypted numbered frame of the vehicle", up(&secret)),
        ("keyed call", frame(call(true), 64, true, Seal::Hello(&mission_key().calls(), MISSION, 0, 0), &[])),
        ("keyed here", frame(here(true), 64, true, hello(CALL_SESSION, CALL_NONCE), &[])),
    ]
}

/// Frames that no receiver of the runs above accepts.
fn refused() -> Rows {
    let order = frame(first_of_surface(false), 64, true, crc(Address::SURFACE, 1), &[(ChunkKind::Slot, hold())]);
    let mut damaged = order.clone();
    damaged[13] ^= 1;
    // Sealed again: the CRC is right.
    let changed = |at: usize, bits: u8| {
        let mut bytes = order[..order.len() - 4].to_vec();
        bytes[at] ^= bits;
        let check = crc(Address::SURFACE, 1).crc(&[&bytes]).expect("a CRC");
        bytes.into_iter().chain(check).collect::<Vec<u8>>()
    };
    let [to, from] = [SURFACE_SESSION, VEHICLE_SESSION ^ 1].map(SessionId::from_random);
    let of_another_run = Seal::Run { mission: MISSION, to, from, number: 1 };
    let forged = Seal::Session(&session(false), Direction::Up, 1);
    let mut no_session = frame(surface_hello(false), 64, true, Seal::Crc(MISSION, 0), &introduction(true));
    no_session.truncate(no_session.len() - 3);
    no_session[2..4].fill(0);
    let check = Seal::Crc(MISSION, 0).crc(&[&no_session]).expect("a CRC");
    no_session.extend(check);
    vec![
        (
            "refused: hello of another mission",
            frame(surface_hello(false), 64, true, Seal::Crc(MissionId(7), 0), &introduction(true)),
        ),
        ("refused: hello of run 0", no_session),
        ("refused: numbered frame of an earlier version", changed(0, 0b1000_0000)),
        ("refused: a bit of the slot differs", damaged),
        ("refused: base 1 in a byte of its own", changed(0, 0b10_0000)),
        ("refused: of vehicle 0", changed(1, 1)),
        ("refused: cut short", order[..10].to_vec()),
        ("refused: a chunk ends after the frame", changed(9, 1)),
        (
            "refused: sealed by a run that is not known",
            frame(answer_of_vehicle(false), 64, true, of_another_run, &answered()),
        ),
        (
            "refused: the tag of the other direction",
            frame(first_of_surface(true), 64, true, forged, &[(ChunkKind::Slot, hold())]),
        ),
    ]
}

#[test]
fn keys_are_those_of_the_vectors() {
    let sealed = |encrypt: bool, direction: Direction| {
        let mut body = *b"body of a frame";
        let tag = session(encrypt).seal(direction, 5, b"head", &mut body);
        (tag.to_vec(), body.to_vec())
    };
    let next = VehicleKey::derive(&MissionKey::from_bytes([0x5A; 16]), 1);
    let [link, calls] = next.offer(&key());
    let text = |text: &str| text.trim().as_bytes().to_vec();
    assert_file(
        "keys.json",
        &named(vec![
            ("fingerprint", mission_key().fingerprint().to_be_bytes().to_vec()),
            ("line of the key file, as ASCII", text(&mission_key().to_text())),
            ("line of the key file of vehicle 1, as ASCII", text(&VehicleKey::derive(&mission_key(), 1).to_text())),
            ("hello tag of the parts \"hello\", \"\" and 0102", key().hello_tag(&[b"hello", b"", &[1, 2]]).to_vec()),
            ("tag, e = 0, down", sealed(false, Direction::Down).0),
            ("tag, e = 0, up", sealed(false, Direction::Up).0),
            ("ciphertext, e = 1, down", sealed(true, Direction::Down).1),
            ("tag, e = 1, down", sealed(true, Direction::Down).0),
            ("part 0 of the offer of a next key, M = sixteen bytes 5A", link),
            ("part 1 of it", calls),
        ]),
    );
}

/// Each frame that the document explains is one of the vectors.
#[test]
fn frames_of_the_document_are_vectors() {
    let vectors: Vec<Vec<u8>> = with_a_crc().into_iter().map(|(_, bytes)| bytes).collect();
    let section =
        DOCUMENT.split("## 11 Examples").nth(1).and_then(|rest| rest.split("## 12").next()).expect("section 11");
    let blocks: Vec<Vec<u8>> = section.split("```").skip(1).step_by(2).map(bytes_of).collect();
    assert!(blocks.len() == 4 && blocks.iter().all(|block| vectors.contains(block)), "{blocks:02X?}");
}

/// The lines of a block that are digits alone.
fn bytes_of(block: &str) -> Vec<u8> {
    let pairs = |line: &str| {
        line.split_whitespace().map(|pair| u8::from_str_radix(pair, 16).ok().filter(|_| pair.len() == 2)).collect()
    };
    block.lines().filter_map(pairs).flat_map(|bytes: Vec<u8>| bytes).collect()
}

#[test]
fn the_table_of_the_context_coder_is_that_of_the_document() {
    let table = include_bytes!("../../../src/map_codec/context/prior.bin");
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(table);
    let said = format!("{} {:03} bytes, CRC-32 (as in PNG) {crc:08X}.", table.len() / 1000, table.len() % 1000);
    let appendix = DOCUMENT.split("## Appendix A").nth(1).expect("appendix A");
    assert!(appendix.contains(&said), "{said}");
}

#[test]
fn the_document_has_the_wire_version_of_the_code() {
    assert!(DOCUMENT.starts_with(&format!("# The wire of scenecast, version {WIRE_VERSION}\n")));
}
