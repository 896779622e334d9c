//! The headers, the status and the keys that the examples share.

use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint};
use scenecast_protocol::directive::Series;
use scenecast_protocol::directive::{
    Constraints, RefusalReason, SLOTS, Slot, SlotId, SlotReport, SlotState, VersionedSlot,
};
use scenecast_protocol::seal::{LinkKey, MissionKey, SessionKey};
use scenecast_protocol::wire::{
    AckForm, AckStatement, Address, Backlog, CellEdge, Chunk, ChunkKind, Envelope, EquipmentFaults, FrameBuilder,
    Header, Introduction, MissionId, ModeReason, PlannedPath, Seal, SessionId, Stamp, UtcHours, VehicleMode,
    VehicleStatus,
};
use std::time::Duration;

pub(crate) const MISSION: MissionId = MissionId(0x5CE7_0001);
pub(crate) const SURFACE_SESSION: u16 = 0xBEEF;
pub(crate) const VEHICLE_SESSION: u16 = 0x1234;
pub(crate) const SURFACE_NONCE: u64 = 0x0102_0304_0506_0708;
pub(crate) const VEHICLE_NONCE: u64 = 0x1112_1314_1516_1718;
pub(crate) const CALL_SESSION: u16 = 0xC0DE;
pub(crate) const CALL_NONCE: u64 = 0x2122_2324_2526_2728;

pub(crate) fn auv() -> Address {
    Address::vehicle(1).expect("an address")
}

pub(crate) fn header(from: Address, number: u64) -> Header {
    let to = if from == Address::SURFACE { auv() } else { Address::SURFACE };
    Header::numbered(from, to, number, 1)
}

pub(crate) fn clock(clock_ms: u32, one_way_ms: Option<u64>) -> Option<Stamp> {
    Some(Stamp::Surface { clock_ms, one_way: one_way_ms.map(Duration::from_millis) })
}

pub(crate) fn vehicle_stamp(clock_ms: u32, last_received: u8, held_ms: u64) -> Stamp {
    Stamp::Vehicle { clock_ms, last_received, held: Duration::from_millis(held_ms) }
}

pub(crate) fn all_up_to(horizon: u64, lost: Vec<u16>) -> Option<AckStatement> {
    Some(AckStatement::new(horizon, lost, AckForm::Near))
}

/// The CRC of a numbered frame of an end.
pub(crate) fn crc(of: Address, number: u64) -> Seal<'static> {
    let [surface, vehicle] = [SURFACE_SESSION, VEHICLE_SESSION].map(SessionId::from_random);
    let (from, to) = if of == Address::SURFACE { (surface, vehicle) } else { (vehicle, surface) };
    Seal::Run { mission: MISSION, to, from, number }
}

/// The introduction in the hello of the surface, or of the vehicle.
pub(crate) fn introduction(of_surface: bool) -> [(ChunkKind, Vec<u8>); 1] {
    let series = of_surface.then(|| Series::from_random(0x0A0B_0C0D_0E0F));
    let clock = UtcHours::from_unix(Duration::from_secs(3600 * 498_000));
    let introduction =
        Introduction { cell_edge: CellEdge::from_metres(0.25), series, clock, ..Introduction::default() };
    [(ChunkKind::Introduction, introduction.encode(Introduction::MAX_BYTES))]
}

pub(crate) fn hold() -> Vec<u8> {
    VersionedSlot::encode(1, &Slot::Constraints(Constraints { hold: true, abort: false }))
}

pub(crate) fn status() -> VehicleStatus {
    let mut slots = [SlotReport::default(); SLOTS];
    slots[SlotId::Utility.index()] = SlotReport { version_low: 7, state: SlotState::Applied };
    slots[SlotId::Fix.index()] = SlotReport { version_low: 2, state: SlotState::Refused(RefusalReason::Malformed) };
    VehicleStatus {
        mode: VehicleMode::Hold,
        autopilot_silent: false,
        reason: ModeReason::Order,
        position: MapPoint::new(1.5, -0.1),
        depth_m: 18.0,
        heading_deg: 90.0,
        sigma_m: 1.25,
        fix_age_s: Some(8.0),
        waypoint: None,
        path: PlannedPath::default(),
        registration: None,
        faults: EquipmentFaults::default(),
        intent: None,
        trail: Vec::new(),
        explored_cells: 4000,
        epoch: 1,
        labels: 9,
        base_digest: 0xBEEF,
        budget_bps: 10_000,
        refused_frames: 3,
        backlog: Backlog { map_bytes: 448, other_bytes: 15 },
        slots,
        in_force: None,
        placement: None,
        disk: None,
    }
}

/// A point in whole metres.
pub(crate) fn place(east_m: i32, north_m: i32) -> DecimetrePoint {
    DecimetrePoint::new(10 * east_m, 10 * north_m)
}

/// The report and the pose of the vehicle's answer.
pub(crate) fn answered() -> [(ChunkKind, Vec<u8>); 2] {
    let mut slots = [SlotReport::default(); SLOTS];
    slots[SlotId::Constraints.index()] = SlotReport { version_low: 1, state: SlotState::Applied };
    let status = VehicleStatus { base_digest: 0, slots, refused_frames: 0, backlog: Backlog::default(), ..status() };
    [(ChunkKind::Report, status.encode_report(99, 0).unwrap().0), (ChunkKind::Pose, status.encode_pose(99))]
}

/// A map chunk with the body `png` on an empty map: label 7 at (-1, 2), label 1 at (0, 2).
pub(crate) fn map_payload() -> Vec<u8> {
    vec![0x07, 0xF0, 0x40, 0x86, 0xA2, 0x63, 0x28, 0x04, 0x00]
}

pub(crate) fn mission_key() -> MissionKey {
    MissionKey::from_bytes(std::array::from_fn(|i| i as u8))
}

/// The key of vehicle 1.
pub(crate) fn key() -> LinkKey {
    mission_key().vehicle(1)
}

pub(crate) fn session(encrypt: bool) -> SessionKey {
    key().session(MISSION.0, 1, SURFACE_NONCE, VEHICLE_NONCE, encrypt)
}

/// Writes a frame and checks that it reads the same.
pub(crate) fn frame(
    header: Header,
    size: usize,
    short: bool,
    seal: Seal<'_>,
    chunks: &[(ChunkKind, Vec<u8>)],
) -> Vec<u8> {
    let mut builder = FrameBuilder::new(&Header { remaining: 0, ..header.clone() }, size);
    for (kind, payload) in chunks {
        assert!(builder.push(*kind, payload));
    }
    builder.set_remaining(header.remaining);
    let bytes = builder.finish(&seal, short);
    let envelope = Envelope::decode(&bytes, |to| to == header.to).expect("readable");
    let read = envelope.open(&seal).expect("sound");
    assert_eq!(read.header, header);
    assert!(read.chunks().are_sound());
    let expected: Vec<Chunk<'_>> = chunks.iter().map(|(kind, payload)| Chunk { kind: *kind, payload }).collect();
    assert_eq!(read.chunks().collect::<Vec<_>>(), expected);
    for at in 0..bytes.len() * 8 {
        let mut other = bytes.clone();
        other[at / 8] ^= 1 << (at % 8);
        let opened = Envelope::decode(&other, |to| to == header.to).ok().and_then(|e| e.open(&seal));
        assert!(opened.is_none(), "bit {at} of {bytes:02X?}");
    }
    bytes
}

pub(crate) fn surface_hello(keyed: bool) -> Header {
    Header {
        turn: Some(48),
        stamp: clock(50_000, None),
        nonce: keyed.then_some(SURFACE_NONCE),
        ..hello(Address::SURFACE, SURFACE_SESSION, keyed)
    }
}

fn hello(from: Address, session: u16, keyed: bool) -> Header {
    Header { session: Some(SessionId::from_random(session)), keyed, ..header(from, 0) }
}

pub(crate) fn vehicle_hello(keyed: bool) -> Header {
    Header { nonce: keyed.then_some(VEHICLE_NONCE), ..hello(auv(), VEHICLE_SESSION, keyed) }
}

pub(crate) fn call(keyed: bool) -> Header {
    Header {
        to: Address::EVERYBODY,
        turn: Some(8),
        nonce: keyed.then_some(CALL_NONCE),
        ..hello(Address::SURFACE, CALL_SESSION, keyed)
    }
}

pub(crate) fn here(keyed: bool) -> Header {
    Header {
        session: Some(SessionId::from_random(CALL_SESSION)),
        nonce: keyed.then_some(CALL_NONCE),
        ..vehicle_hello(keyed)
    }
}

pub(crate) fn first_of_surface(keyed: bool) -> Header {
    let (turn, stamp) = (Some(48), clock(55_000, Some(667)));
    Header { remaining: 5, turn, stamp, keyed, ..header(Address::SURFACE, 1) }
}

pub(crate) fn answer_of_vehicle(keyed: bool) -> Header {
    let (turn, stamp) = (Some(4), Some(vehicle_stamp(7_200, 2, 200)));
    let ack = Some(AckStatement::new(2, vec![], AckForm::InTurn));
    Header { turn, stamp, ack, keyed, ..header(auv(), 1) }
}
