//! The bytes in `WIRE.md` are those that the code writes and reads.

use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint, WorldPoint};
use scenecast_protocol::directive::{
    Band, Budget, CellBand, Change, Constraints, ExemplarRequest, ExemplarRequests, Fence, Figure, Fix, Limits,
    PlannerKind, Polygon, Reaction, RefusalReason, SLOTS, Settings, Slot, SlotId, SlotReport, SlotState, Utility,
    VersionedSlot,
};
use scenecast_protocol::map::{
    Cell, DescriptorPart, LabelGrid, LayerChunk, LayerDescriptor, LayerId, LayerMask, LayerSet,
};
use scenecast_protocol::map_codec;
use scenecast_protocol::schedule::{BackgroundOrder, BackgroundStream, Shares};
use scenecast_protocol::seal::{Direction, MissionKey, SessionKey};
use scenecast_protocol::wire::{
    AckStatement, Address, Backlog, Chunk, ChunkKind, Envelope, FrameBuilder, FrameKind, Header, MissionId, ModeReason,
    Placement, PlannedPath, Reader, Seal, SessionId, Stamp, VehicleMode, VehicleStatus, WIRE_VERSION, unwrap_number,
};
use std::collections::BTreeMap;
use std::time::Duration;

const DOCUMENT: &str = include_str!("../WIRE.md");
const MISSION: MissionId = MissionId(0x5CE7_0001);
const SURFACE_SESSION: u16 = 0xBEEF;
const VEHICLE_SESSION: u16 = 0x1234;
const SURFACE_NONCE: u64 = 0x0102_0304_0506_0708;
const VEHICLE_NONCE: u64 = 0x1112_1314_1516_1718;
const CALL_SESSION: u16 = 0xC0DE;
const CALL_NONCE: u64 = 0x2122_2324_2526_2728;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02X}")).collect::<Vec<_>>().join(" ")
}

/// Bytes from pairs of digits; `None` if the text has anything else.
fn pairs(text: &str) -> Option<Vec<u8>> {
    text.split_whitespace().map(|p| u8::from_str_radix(p, 16).ok().filter(|_| p.len() == 2)).collect()
}

fn section(from: &str, to: &str) -> &'static str {
    let at = DOCUMENT.find(from).expect(from);
    let rest = &DOCUMENT[at..];
    &rest[..rest.find(to).expect(to)]
}

/// The rows of a table: the first column, and the part in backticks of the second.
fn rows(section: &'static str) -> BTreeMap<&'static str, &'static str> {
    let row = |line: &'static str| {
        let (what, bytes) = line.strip_prefix("| ")?.strip_suffix("` |")?.rsplit_once(" | `")?;
        Some((what, bytes))
    };
    section.lines().filter_map(row).collect()
}

/// The frames of section 11: the bold name, and the lines of digits in the block after it.
fn frames(section: &'static str) -> BTreeMap<&'static str, Vec<u8>> {
    let mut frames = BTreeMap::new();
    let (mut name, mut is_open) = ("", false);
    for line in section.lines() {
        if let Some(rest) = line.strip_prefix("**") {
            name = rest.split("**").next().unwrap_or_default();
        } else if line.starts_with("```") {
            is_open = line != "```";
        } else if let Some(bytes) = pairs(line).filter(|_| is_open) {
            frames.entry(name).or_insert_with(Vec::new).extend(bytes);
        }
    }
    frames
}

/// Fails with all differences at once, so that a change of the wire can be copied into the document.
fn assert_same(found: BTreeMap<&str, Vec<u8>>, expected: Vec<(&str, Vec<u8>)>) {
    let mut problems: Vec<String> = expected
        .iter()
        .filter(|(name, bytes)| found.get(name) != Some(bytes))
        .map(|(name, bytes)| format!("{name}:\n{}", hex(bytes)))
        .collect();
    let checked = |name: &&&str| expected.iter().all(|(n, _)| n != *name);
    problems.extend(found.keys().filter(checked).map(|name| format!("nobody checks: {name}")));
    assert!(problems.is_empty(), "WIRE.md is not what the code says:\n{}", problems.join("\n"));
}

fn auv() -> Address {
    Address::vehicle(1).expect("an address")
}

fn header(from: Address, number: u16) -> Header {
    let (to, session) = match from {
        Address::SURFACE => (auv(), SURFACE_SESSION),
        _ => (Address::SURFACE, VEHICLE_SESSION),
    };
    Header {
        from,
        to,
        session: SessionId::from_random(session),
        number,
        base: 1,
        remaining: 0,
        turn: None,
        stamp: None,
        nonce: None,
        ack: None,
        kind: FrameKind::Numbered,
        keyed: false,
    }
}

fn clock(clock_ms: u32, one_way_ms: Option<u64>) -> Option<Stamp> {
    Some(Stamp::Surface { clock_ms, one_way: one_way_ms.map(Duration::from_millis) })
}

fn heard(clock_ms: u32, heard: u8, held_ms: u64) -> Stamp {
    Stamp::Vehicle { clock_ms, heard, held: Duration::from_millis(held_ms) }
}

fn all_up_to(horizon_low: u16, lost: Vec<u16>) -> Option<AckStatement> {
    Some(AckStatement { horizon_low, lost })
}

fn hold() -> Vec<u8> {
    VersionedSlot::encode(0xABCD, 1, &Slot::Constraints(Constraints { hold: true, abort: false }))
}

fn status() -> VehicleStatus {
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
        explored_cells: 4000,
        epoch: 1,
        labels: 9,
        base_digest: 0xBEEF,
        budget_bps: 10_000,
        refused_frames: 3,
        backlog: Backlog { map_bytes: 448, other_bytes: 15 },
        slots,
        placement: None,
    }
}

/// A point in whole metres.
fn place(east_m: i32, north_m: i32) -> DecimetrePoint {
    DecimetrePoint::new(10 * east_m, 10 * north_m)
}

/// The report and the pose of the vehicle's answer.
fn answered() -> [(ChunkKind, Vec<u8>); 2] {
    let mut slots = [SlotReport::default(); SLOTS];
    slots[SlotId::Constraints.index()] = SlotReport { version_low: 1, state: SlotState::Applied };
    let status = VehicleStatus { base_digest: 0, slots, refused_frames: 0, backlog: Backlog::default(), ..status() };
    [(ChunkKind::Report, status.encode_report(99, 0).unwrap().0), (ChunkKind::Pose, status.encode_pose(99))]
}

fn map_payload() -> Vec<u8> {
    let rows = rows(section("### 11.1", "### 11.2"));
    let row = rows.iter().find(|(what, _)| what.starts_with("payload of a map chunk")).expect("the row");
    pairs(row.1).expect("digits")
}

fn key() -> MissionKey {
    MissionKey::from_bytes(std::array::from_fn(|i| i as u8))
}

fn session(encrypt: bool) -> SessionKey {
    key().session(MISSION.0, 1, SURFACE_NONCE, VEHICLE_NONCE, encrypt)
}

/// Writes a frame and checks that it reads the same.
fn frame(header: Header, size: usize, short: bool, seal: Seal<'_>, chunks: &[(ChunkKind, Vec<u8>)]) -> Vec<u8> {
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
        assert!(opened.is_none(), "bit {at} of {}", hex(&bytes));
    }
    bytes
}

fn surface_hello(keyed: bool) -> Header {
    Header {
        turn: Some(48),
        stamp: clock(50_000, None),
        nonce: keyed.then_some(SURFACE_NONCE),
        kind: FrameKind::Hello,
        keyed,
        ..header(Address::SURFACE, 0)
    }
}

fn vehicle_hello(keyed: bool) -> Header {
    Header { nonce: keyed.then_some(VEHICLE_NONCE), kind: FrameKind::Hello, keyed, ..header(auv(), 0) }
}

fn call(keyed: bool) -> Header {
    Header {
        to: Address::EVERYBODY,
        session: SessionId::from_random(CALL_SESSION),
        turn: Some(8),
        nonce: keyed.then_some(CALL_NONCE),
        kind: FrameKind::Hello,
        keyed,
        ..header(Address::SURFACE, 0)
    }
}

fn here(keyed: bool) -> Header {
    Header { session: SessionId::from_random(CALL_SESSION), nonce: keyed.then_some(CALL_NONCE), ..vehicle_hello(keyed) }
}

fn first_of_surface(keyed: bool) -> Header {
    let (turn, stamp) = (Some(48), clock(55_000, Some(667)));
    Header { remaining: 5, turn, stamp, keyed, ..header(Address::SURFACE, 1) }
}

fn answer_of_vehicle(keyed: bool) -> Header {
    let (turn, stamp, ack) = (Some(4), Some(heard(7_200, 2, 200)), all_up_to(2, vec![]));
    Header { turn, stamp, ack, keyed, ..header(auv(), 1) }
}

#[test]
fn parts_of_a_frame_are_those_of_the_document() {
    let found = rows(section("### 11.1", "### 11.2"));
    let mut found: BTreeMap<&str, Vec<u8>> =
        found.into_iter().map(|(what, bytes)| (what, pairs(bytes).expect("digits"))).collect();
    // Formats inside of the map codec have tests there.
    found.retain(|what, _| {
        !what.starts_with("head of a map chunk's payload") && !what.starts_with("the same, a payload")
    });
    let map = found.keys().find(|what| what.starts_with("payload of a map chunk")).copied().expect("the row");
    let changes = map_codec::decode(&LabelGrid::default(), &found[map]).expect("a sound chunk");
    assert_eq!(changes, [(Cell::new(-1, 2), 7), (Cell::new(0, 2), 1)]);
    found.remove(map);

    let in_frame = |header: Header, from: usize, to: usize| {
        frame(header, 2000, true, Seal::Crc(MISSION, 0), &[])[from..to].to_vec()
    };
    let base = |base: u16, bytes: usize| in_frame(Header { base, ..header(auv(), 9) }, 6, 6 + bytes);
    let stamp = |from: Address, stamp: Stamp, bytes: usize| {
        in_frame(Header { stamp: Some(stamp), ..header(from, 9) }, 8, 8 + bytes)
    };
    let statement = |horizon_low: u16, lost: Vec<u16>| {
        let (statement, mut bytes) = (AckStatement { horizon_low, lost }, Vec::new());
        assert!(statement.encode(99, &mut bytes));
        assert_eq!(AckStatement::decode(&mut Reader::new(&bytes)), Ok(statement));
        bytes
    };
    let head = |payload: usize, head: usize, is_full: bool| {
        let size = if is_full { 8 + head + payload + 4 } else { 1024 };
        let chunk = [(ChunkKind::Map, vec![9; payload])];
        frame(header(auv(), 9), size, true, Seal::Crc(MISSION, 0), &chunk)[8..8 + head].to_vec()
    };
    let slot = |version: u16, content: Slot| {
        let bytes = VersionedSlot::encode(0xABCD, version, &content);
        let read = VersionedSlot { id: content.id(), series: 0xABCD, version, content: Some(content) };
        assert_eq!(VersionedSlot::decode(&bytes), Ok(read));
        bytes
    };
    let pose = |waypoint: Option<(f64, f64)>, path: &[(f64, f64)], continues: bool| {
        let point = |(x_m, y_m)| MapPoint { x_m, y_m };
        let path = PlannedPath { points: path.iter().copied().map(point).collect(), continues };
        let bytes = VehicleStatus { waypoint: waypoint.map(point), path, ..status() }.encode_pose(99);
        assert_eq!(VehicleStatus::default().read_pose(&bytes), Ok(()));
        bytes
    };
    let utility =
        Utility { epoch: 1, exploration: 20, curiosity: 0, weights: [(3, 80), (5, -20)].into_iter().collect() };
    let budget = Budget { bits_per_s: 400, shares: Shares([10, 5, 5, 50, 20]), background: BackgroundOrder::default() };
    let curious = BackgroundOrder::new(&[
        BackgroundStream::Layer(LayerId::CURIOSITY),
        BackgroundStream::Finer,
        BackgroundStream::Layer(LayerId::DEPTH),
        BackgroundStream::Exemplars,
        BackgroundStream::Layer(LayerId::CONFIDENCE),
    ]);
    let curious = Budget { background: curious.unwrap(), ..budget };
    let last = BackgroundStream::Layer(LayerId::new(15).unwrap());
    let long = Budget { background: BackgroundOrder::new(&[BackgroundStream::Finer, last]).unwrap(), ..budget };
    let fix = Fix { position: WorldPoint::new(-12.3, 400.0), sigma_m: 1.5, age_s: 0.82 };
    let requests = ExemplarRequests {
        epoch: 1,
        wanted: vec![
            ExemplarRequest { label: 3, serial: 2, size: 0, picture: 0 },
            ExemplarRequest { label: 5, serial: 1, size: 1, picture: 9 },
        ],
    };
    let layer = |chunk: LayerChunk<'_>| {
        let bytes = chunk.encode();
        assert_eq!(LayerChunk::decode(&bytes), Some(chunk));
        bytes
    };
    let built_in = LayerSet::default();
    let [confidence, curiosity] = [LayerId::CONFIDENCE, LayerId::CURIOSITY].map(|id| built_in.get(id).unwrap());
    let depth = LayerDescriptor::depth_around(75.5, 0.5);
    assert_eq!((depth.bounds(1), confidence.bounds(4)), (Some((12.0, 12.5)), Some((0.75, 1.0))));
    let part = |descriptor: &LayerDescriptor, from: usize, to: usize| {
        let bytes = descriptor.to_bytes();
        let part = DescriptorPart {
            digest: descriptor.digest(),
            first: from as u8,
            is_last: to == bytes.len(),
            bytes: &bytes[from..to],
        };
        layer(LayerChunk::Descriptor(built_in.id(&descriptor.name).unwrap(), part))
    };
    let whole = |descriptor: &LayerDescriptor| part(descriptor, 0, descriptor.to_bytes().len());
    let digest = 0x27A6 ^ confidence.digest();
    let settings = Settings {
        planner: Change::To(PlannerKind::Horizon),
        cells: Change::To(CellBand::Coarse),
        layers: Change::To(LayerMask::from_iter([LayerId::DEPTH])),
        alpha: Change::To(Figure::new(0.01).unwrap()),
        gamma: Change::Configured,
        frames_per_s: Change::To(Figure::new(0.25).unwrap()),
        ..Settings::default()
    };
    let limits = Limits {
        depth: Some(Band { low_dm: 50, high_dm: 400 }),
        distance_m: Some(3000),
        silence_s: Some(600),
        on_silence: Some(Reaction::Return),
        ..Limits::default()
    };
    let outline = |vertices: &[(i32, i32)]| Polygon(vertices.iter().map(|&(x, y)| place(x, y)).collect());
    let fence = Fence {
        fence: Some(outline(&[(0, 0), (40, 0), (40, 30), (0, 30)])),
        keep_outs: vec![outline(&[(10, 10), (15, 10), (10, 18)])],
        return_point: Some(place(2, 3)),
    };
    let expected = vec![
        ("base 127", base(127, 1)),
        ("base 128", base(128, 2)),
        ("base 2048", base(2048, 2)),
        (
            "stamp of the surface: clock 66 051 ms, one way 667 ms",
            stamp(Address::SURFACE, clock(66_051, Some(667)).expect("a stamp"), 5),
        ),
        (
            "stamp of the surface: clock 1 ms, one way not known",
            stamp(Address::SURFACE, clock(1, None).expect("a stamp"), 5),
        ),
        (
            "stamp of a vehicle: clock 16 777 215 ms, frame 9 heard 258 ms before",
            stamp(auv(), heard(16_777_215, 9, 258), 6),
        ),
        ("statement: horizon low ABC, no loss", statement(0xABC, vec![])),
        ("statement: horizon 7, lost 6 and 3 (distances 1 and 4), a bitmap", statement(7, vec![1, 4])),
        (
            "statement: horizon 30, lost 10 and 5 (distances 20 and 25), a Rice code with k = 2",
            statement(30, vec![20, 25]),
        ),
        ("head of a map chunk that fills the rest of a full frame", head(200, 1, true)),
        ("head of a map chunk of 26 bytes", head(26, 1, false)),
        ("head of a map chunk of 27 bytes", head(27, 2, false)),
        ("head of a map chunk of 300 bytes", head(300, 2, false)),
        ("layer chunk: confidence announced, quarters of 0 to 1", whole(confidence)),
        ("layer chunk: depth announced, steps of 0.5 m, level 1 from 12 m on", whole(&depth)),
        ("the same in two chunks, the first", part(&depth, 0, 10)),
        ("the second", part(&depth, 10, 19)),
        ("layer chunk: curiosity announced, whole bits", whole(curiosity)),
        ("head of a layer chunk: a patch of confidence", layer(LayerChunk::Patch(LayerId::CONFIDENCE, &[]))),
        (
            "layer chunk: the digest of confidence, of levels with the digest 27A6",
            layer(LayerChunk::Digest(LayerId::CONFIDENCE, digest)),
        ),
        (
            "pose: hold by order, x 1.5 m, y -0.1 m, depth 18 m, heading 90 degrees, sigma 1.25 m, fix 8 s ago, 4000 cells",
            pose(None, &[], false),
        ),
        ("the same with a waypoint at (1, -2) m", pose(Some((1.0, -2.0)), &[], false)),
        (
            "the same with a path from there to (2.4, -3.4) and (-0.6, -3.4) m",
            pose(Some((1.0, -2.0)), &[(2.4, -3.4), (-0.6, -3.4)], false),
        ),
        ("the same with an empty path that continues", pose(Some((1.0, -2.0)), &[], true)),
        (
            "the first pose with an autopilot that does not answer",
            VehicleStatus { autopilot_silent: true, ..status() }.encode_pose(99),
        ),
        (
            "report: epoch 1, 9 labels, digest BEEF, budget 10 000 bit/s (2500 x 2^2), 3 frames refused, 448 bytes of labels (14 x 2^5) \
             and 15 of all else wait, utility version 7 applied, fix version 2 refused (2)",
            status().encode_report(99, 0).unwrap().0,
        ),
        (
            "the same with a placement: version 2, 12.5 m east, -0.1 m north",
            VehicleStatus {
                placement: Some(Placement { version: 2, origin: WorldPoint::new(12.5, -0.1) }),
                ..status()
            }
            .encode_report(99, 0)
            .unwrap()
            .0,
        ),
        (
            "slot: series ABCD, version 4, utility: epoch 1, unseen 20, perplexity 0, label 3: 80, label 5: -20",
            slot(4, Slot::Utility(utility)),
        ),
        ("slot: series ABCD, version 1, constraints: hold", hold()),
        (
            "slot: series ABCD, version 2, settings: planner horizon, coarse cells, depth alone, alpha 0.01, gamma as \
             configured, 0.25 frames a second",
            slot(2, Slot::Settings(settings)),
        ),
        (
            "slot: series ABCD, version 2, constraints: abort",
            slot(2, Slot::Constraints(Constraints { hold: false, abort: true })),
        ),
        (
            "slot: series ABCD, version 6, limits: depth 5 to 40 m, 3000 m, silence 600 s, on silence return",
            slot(6, Slot::Limits(limits)),
        ),
        (
            "slot: series ABCD, version 7, fence: (0, 0), (40, 0), (40, 30), (0, 30) m, keep-out (10, 10), (15, 10), \
             (10, 18) m, return point (2, 3) m",
            slot(7, Slot::Fence(fence)),
        ),
        (
            "slot: series ABCD, version 3, budget: 400 bit/s, shares 10, 5, 5, 50, 20, spare capacity to finer cells, depth, \
             exemplars, confidence",
            slot(3, Slot::Budget(budget)),
        ),
        (
            "slot: series ABCD, version 3, the same budget, spare capacity to curiosity, finer cells, depth, exemplars, \
             confidence",
            slot(3, Slot::Budget(curious)),
        ),
        (
            "slot: series ABCD, version 3, the same budget, spare capacity to finer cells and layer 15",
            slot(3, Slot::Budget(long)),
        ),
        (
            "slot: series ABCD, version 2, settings: layers 2 and 15 alone",
            slot(2, Slot::Settings(Settings { layers: Change::To(LayerMask(0x8004)), ..Settings::default() })),
        ),
        (
            "slot: series ABCD, version 1, requests: epoch 1, label 3, request 2; label 5, request 1, picture 9 with an edge of \
             128 pixels",
            slot(1, Slot::Requests(requests)),
        ),
        ("slot: series ABCD, version 9, fix: x -12.3 m, y 400 m, sigma 1.5 m, age 0.82 s", slot(9, Slot::Fix(fix))),
    ];
    assert_same(found, expected);
    assert_eq!((unwrap_number(3, 65_530), unwrap_number(65_530, 65_540)), (65_539, 65_530));
}

#[test]
fn frames_with_a_crc_are_those_of_the_document() {
    let crc = |session: u16| Seal::Crc(MISSION, session);
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
        ("hello of the surface", frame(surface_hello(false), 64, true, crc(0), &[])),
        ("hello of the vehicle", frame(vehicle_hello(false), 64, true, crc(SURFACE_SESSION), &[])),
        ("first numbered frame of the surface", frame(first_of_surface(false), 64, true, crc(VEHICLE_SESSION), &slot)),
        ("grant with an ack statement", frame(grant, 64, true, crc(VEHICLE_SESSION), &[])),
        ("answer of the vehicle", frame(answer_of_vehicle(false), 64, true, crc(SURFACE_SESSION), &answered())),
        (
            "map frame in the middle of a turn",
            frame(map, 48, false, crc(SURFACE_SESSION), &[(ChunkKind::Map, map_payload())]),
        ),
        ("frame without content", frame(empty, 64, true, crc(SURFACE_SESSION), &[])),
        ("call", frame(call(false), 64, true, crc(0), &[])),
        ("here", frame(here(false), 64, true, crc(CALL_SESSION), &[])),
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
        ("keyed hello of the surface", frame(surface_hello(true), 64, true, hello(0, 0), &[])),
        (
            "keyed hello of the vehicle",
            frame(vehicle_hello(true), 64, true, hello(SURFACE_SESSION, SURFACE_NONCE), &[]),
        ),
        ("keyed numbered frame of the surface", down(&plain)),
        ("keyed numbered frame of the vehicle", up(&plain)),
        ("encrypted numbered frame of the surface", down(&secret)),
        ("encrypted numbered frame of the vehicle", up(&secret)),
        ("keyed call", frame(call(true), 64, true, hello(0, 0), &[])),
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
    let expected = [
        ("fingerprint", format!("{:08x}", key().fingerprint())),
        ("key file", key().to_text().trim().to_owned()),
        ("hello tag of these three parts", compact(&key().hello_tag(&[b"hello", b"", &[1, 2]]))),
        ("tag, e = 0, down", sealed(false, Direction::Down).0),
        ("tag, e = 0, up", sealed(false, Direction::Up).0),
        ("ciphertext, e = 1, down", sealed(true, Direction::Down).1),
        ("tag, e = 1, down", sealed(true, Direction::Down).0),
    ];
    for (what, bytes) in expected {
        assert_eq!(found.get(what), Some(&bytes.as_str()), "{what}");
    }
}

#[test]
fn the_document_has_the_wire_version_of_the_code() {
    assert!(DOCUMENT.starts_with(&format!("# The wire of scenecast, version {WIRE_VERSION}\n")));
}
