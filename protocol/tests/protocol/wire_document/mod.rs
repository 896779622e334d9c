//! The bytes in `WIRE.md` are those that the code writes and reads.

mod document;
mod parts;
mod samples;

use crc::{CRC_32_ISO_HDLC, Crc};
use document::{DOCUMENT, assert_same, frames, hex, rows, section};
use samples::{
    CALL_NONCE, CALL_SESSION, MISSION, SURFACE_NONCE, SURFACE_SESSION, all_up_to, answer_of_vehicle, answered, auv,
    call, clock, crc, first_of_surface, frame, header, here, hold, introduction, key, map_payload, mission_key,
    session, surface_hello, vehicle_hello,
};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::{self, Codec, encode_all};
use scenecast_protocol::seal::{Direction, MissionKey, VehicleKey};
use scenecast_protocol::wire::{Address, ChunkKind, Header, Seal, WIRE_VERSION};

#[test]
fn frames_with_a_crc_are_those_of_the_document() {
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
    let empty = Header { turn: Some(40), ..header(auv(), 2) };
    let expected = vec![
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
        ("frame without content", frame(empty, 64, true, crc(auv(), 2), &[])),
        ("call", frame(call(false), 64, true, hello_crc(0), &[])),
        ("here", frame(here(false), 64, true, hello_crc(CALL_SESSION), &[])),
    ];
    assert_same(frames(section("### 11.2", "### 11.3")), expected);
}

#[test]
fn frames_with_a_tag_are_those_of_the_document() {
    let key = key();
    let hello = |session: u16, nonce: u64| Seal::Hello(&key, MISSION, session, nonce);
    let (plain, secret) = (session(false), session(true));
    let slot = [(ChunkKind::Slot, hold())];
    let down = |key| frame(first_of_surface(true), 64, true, Seal::Session(key, Direction::Down, 1), &slot);
    let up = |key| frame(answer_of_vehicle(true), 64, true, Seal::Session(key, Direction::Up, 1), &answered());
    let expected = vec![
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
    ];
    assert_same(frames(section("### 11.3", "## 12")), expected);
}

#[test]
fn golden_values_of_the_keys_are_those_of_the_document() {
    let found = rows(section("### 12.6", "## 13"));
    let compact = |bytes: &[u8]| hex(bytes).replace(' ', "").to_lowercase();
    let sealed = |encrypt: bool, direction: Direction| {
        let mut body = *b"body of a frame";
        let tag = session(encrypt).seal(direction, 5, b"head", &mut body);
        (compact(&tag), compact(&body))
    };
    let next = VehicleKey::derive(&MissionKey::from_bytes([0x5A; 16]), 1);
    let [link, calls] = next.offer(&key());
    let expected = [
        ("part 0 of the offer of a next key, M = sixteen bytes 5A", compact(&link)),
        ("part 1 of it", compact(&calls)),
        ("fingerprint", format!("{:08x}", mission_key().fingerprint())),
        ("key file", mission_key().to_text().trim().to_owned()),
        ("key file of vehicle 1", VehicleKey::derive(&mission_key(), 1).to_text().trim().to_owned()),
        ("hello tag of these three parts", compact(&key().hello_tag(&[b"hello", b"", &[1, 2]]))),
        ("tag, e = 0, down", sealed(false, Direction::Down).0),
        ("tag, e = 0, up", sealed(false, Direction::Up).0),
        ("ciphertext, e = 1, down", sealed(true, Direction::Down).1),
        ("tag, e = 1, down", sealed(true, Direction::Down).0),
    ];
    for (name, bytes) in expected {
        assert_eq!(found.get(name), Some(&bytes.as_str()), "{name}");
    }
}

#[test]
fn the_table_of_the_context_coder_is_that_of_the_document() {
    let table = include_bytes!("../../../src/map_codec/context/prior.bin");
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(table);
    let said = format!("{} {:03} bytes, CRC-32 (as in PNG) {crc:08X}.", table.len() / 1000, table.len() % 1000);
    assert!(section("## Appendix A", "### A.1").contains(&said), "{said}");
}

/// Labels of rows from y = 0 up.
fn grid(rows: &[&[u8]]) -> LabelGrid {
    let cells = rows.iter().zip(0..).flat_map(|(row, y)| row.iter().zip(0..).map(move |(&l, x)| (Cell::new(x, y), l)));
    cells.filter(|(_, label)| *label > 0).collect()
}

fn chunk(base: &LabelGrid, target: &LabelGrid) -> Vec<u8> {
    let mut chunks = encode_all(Codec::Context, base, target, 1000).expect("room for a chunk");
    assert_eq!(chunks.len(), 1);
    chunks.remove(0).bytes
}

#[test]
fn the_example_of_a_context_body_is_that_of_the_document() {
    let plain: &[u8] = &[1, 1, 1, 1, 1, 1, 0, 0];
    let base = grid(&[plain; 6]);
    let target = grid(&[plain, plain, &[1, 1, 1, 1, 3, 1, 1, 0], &[1, 1, 0, 1, 3, 1, 9, 0], plain, plain]);
    let found = rows(section("### A.6", "Then low ="));
    assert_eq!(found["chunk"], hex(&chunk(&base, &target)));
}

/// A hash of FFFFFFFF marks an empty place too (A.4).
#[test]
fn a_context_with_the_key_of_an_empty_place_reads_back() {
    let base = grid(&[&[105, 65, 168, 0, 0, 0], &[52, 0, 0, 0, 0, 0], &[0; 6]]);
    let target = grid(&[&[105, 65, 168, 0, 0, 0], &[52, 52, 0, 0, 0, 7], &[9, 8, 0, 0, 3, 1]]);
    let bytes = chunk(&base, &target);
    assert_eq!(hex(&bytes), "80 00 22 88 40 00 79 6A 3F 05 3C 2D D0");
    let mut read = base;
    for (cell, label) in map_codec::decode(&read.clone(), &bytes).unwrap() {
        read.set(cell, label);
    }
    assert_eq!(read, target);
}

#[test]
fn the_document_has_the_wire_version_of_the_code() {
    assert!(DOCUMENT.starts_with(&format!("# The wire of scenecast, version {WIRE_VERSION}\n")));
}
