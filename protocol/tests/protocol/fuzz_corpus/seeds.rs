//! The initial corpora: the traffic of two ends, and chunks of three maps.

use super::targets::base;
use super::targets::link::{FuzzEnd, Setup, Surface, layers};
use super::targets::raw;
use scenecast_protocol::directive::{InForceDigests, InForcePart, PerSlot, Slot, SlotId, Utility, VersionedSlot};
use scenecast_protocol::map::{Cell, LabelGrid, MapSource, TextPart};
use scenecast_protocol::map_codec::{Codec, encode};
use scenecast_protocol::object::ObjectSender;
use scenecast_protocol::seal::MissionKey;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{AckForm, AckStatement, ChunkKind, Envelope, MissionId, Seal, SessionId, WIRE_VERSION};
use std::time::Duration;

/// Corpus, name of the file, content.
type Seed = (&'static str, String, Vec<u8>);

/// Every file that is generated, not found by a fuzzer.
pub fn all() -> Vec<Seed> {
    let mut seeds = [frames(), contents(), objects(), scripts(), golden(), map_chunks(), in_force()].concat();
    seeds.iter_mut().for_each(|(_, _, data)| data.truncate(2000));
    seeds
}

/// Names of setups: how frames are sealed, and how the medium is shared.
const SETUPS: [(&str, u8); 6] =
    [("plain", 0), ("surface-keyed", 1), ("keyed", 2), ("encrypted", 3), ("pool", 8), ("polled", 12)];

/// The frames of both ends over a lossless channel, with their senders.
fn traffic(setup: u8) -> Vec<(&'static str, Vec<u8>)> {
    let mut now = Instant::from_secs_f64(1000.0);
    let setup = Setup::new(setup);
    let mut vehicle = setup.vehicle(MapSource::new(Codec::Png), now);
    let mut surface: Surface = setup.surface(now);
    layers().into_iter().for_each(|layer| assert!(vehicle.add_layer(layer)));
    (1..3).for_each(|what| vehicle.act(what, 3, now));
    let mut said = Vec::new();
    for round in 0..12 {
        vehicle.act(0, 20 + round, now);
        vehicle.act(6, 20 + round, now);
        surface.act(round, round + 9, now);
        said.extend(turn(&mut surface, &mut vehicle, &mut now).into_iter().map(|bytes| ("down", bytes)));
        said.extend(turn(&mut vehicle, &mut surface, &mut now).into_iter().map(|bytes| ("up", bytes)));
    }
    said
}

fn turn(from: &mut impl FuzzEnd, to: &mut impl FuzzEnd, now: &mut Instant) -> Vec<Vec<u8>> {
    *now = *now + Duration::from_millis(1500);
    from.poll(4, *now);
    let mut said = Vec::new();
    while let Some(transmit) = from.poll_transmit(*now) {
        to.handle_frame(&transmit.bytes, *now);
        from.handle_transmit_outcome(*now);
        said.push(transmit.bytes);
    }
    to.drain(*now);
    said
}

/// The first frames of each end in each setup.
fn frames() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (name, setup) in SETUPS {
        for way in ["down", "up"] {
            let frames = traffic(setup).into_iter().filter(|(w, _)| *w == way).take(4).enumerate();
            seeds.extend(frames.map(|(i, (_, bytes))| ("frame", format!("{name}-{way}-{i}"), bytes)));
        }
    }
    seeds
}

/// Bodies, statements, statuses and slots in plain frames.
fn contents() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (i, (way, bytes)) in traffic(0x10).into_iter().enumerate().take(60) {
        let envelope = Envelope::decode(&bytes, |_| true).expect("a frame");
        if let Some(ack) = &envelope.header.ack {
            let mut statement = Vec::new();
            ack.encode(100, &mut statement);
            seeds.push(("ack", format!("{way}-{i}"), statement));
        }
        let end = Seal::bytes(false, envelope.header.kind());
        let body = bytes[raw::head(&envelope.header).len()..bytes.len() - end].to_vec();
        for (kind, payload) in chunks(&body) {
            let framed = [&[payload.len() as u8], &payload[..]].concat();
            match kind {
                ChunkKind::LabelClass | ChunkKind::LabelTree => {}
                ChunkKind::Details => seeds.push(("status", format!("details-{i}"), payload)),
                ChunkKind::Pose => seeds.push(("status", format!("pose-{i}"), payload)),
                ChunkKind::Report => seeds.push(("status", format!("report-{i}"), payload)),
                ChunkKind::Slot => seeds.push(("slot", format!("slot-{i}"), framed)),
                ChunkKind::Layer => seeds.push(("layer_chunk", format!("talk-{i}"), payload)),
                ChunkKind::InForce | ChunkKind::Inquiry => seeds.push(("in_force", format!("{way}-{i}"), framed)),
                ChunkKind::Map
                | ChunkKind::Object
                | ChunkKind::Introduction
                | ChunkKind::Caller
                | ChunkKind::NextKey => {}
            }
        }
        seeds.push(("chunks", format!("{way}-{i}"), body));
    }
    few(seeds)
}

/// Objects of several sizes in parts of several sizes: in order, backwards, and the later half with repairs.
fn objects() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (len, room) in [(1, 20), (90, 24), (300, 50), (900, 200), (16_000, 250)] {
        let mut sender = ObjectSender::default();
        sender.set_loss(0.3);
        sender.push((0..len).map(|i| (i * 7) as u8).collect());
        let mut parts = Vec::new();
        while let Some((id, run, bytes)) = sender.next_part(room).filter(|_| parts.len() < 30) {
            sender.mark_in_flight(id, &run);
            parts.push([&[bytes.len() as u8], &bytes[..]].concat());
        }
        let half = parts.split_off(parts.len() / 2);
        let mut seed = |name: &str, data| seeds.push(("object", format!("{len}-bytes-{name}"), data));
        seed("in-order", [parts.concat(), half.concat()].concat());
        seed("backwards", half.iter().rev().chain(parts.iter().rev()).flatten().copied().collect());
        seed("later-half", half.concat());
    }
    seeds
}

/// A content in force in parts of several sizes, and inquiries.
fn in_force() -> Vec<Seed> {
    let weights = (1..=60).map(|label| (label, 50)).collect();
    let slot = Slot::Utility(Utility { weights, ..Utility::default() });
    let digests = InForceDigests::of(&PerSlot::from_fn(|id| (id == SlotId::Utility).then(|| slot.clone())));
    let content = VersionedSlot::encode(0, &slot).split_off(3);
    let framed = |payload: Vec<u8>| [&[payload.len() as u8], &payload[..]].concat();
    let mut seeds = vec![
        ("in_force", "inquiry-for-all".to_owned(), framed(InForceDigests::default().encode())),
        ("in_force", "inquiry-for-others".to_owned(), framed(digests.encode())),
    ];
    for room in [10, 40, 200] {
        let part = |(index, bytes): (usize, &[u8])| {
            let first = index * room;
            let (digest, is_last) =
                (digests.get(SlotId::Utility).copied().unwrap_or(0), first + bytes.len() == content.len());
            let part = TextPart { digest, first: first as u16, is_last, bytes };
            framed(InForcePart { id: SlotId::Utility, part }.encode())
        };
        seeds.push(("in_force", format!("parts-of-{room}"), content.chunks(room).enumerate().flat_map(part).collect()));
    }
    seeds
}

/// At most twelve seeds of each corpus.
fn few(mut seeds: Vec<Seed>) -> Vec<Seed> {
    let mut kept: Vec<&str> = Vec::new();
    seeds.retain(|(target, _, data)| {
        let keep = !data.is_empty() && kept.iter().filter(|t| t == &target).count() < 12;
        kept.extend(keep.then_some(*target));
        keep
    });
    seeds
}

fn chunks(body: &[u8]) -> Vec<(ChunkKind, Vec<u8>)> {
    const UP: u8 = 0x80;
    let mut bytes = vec![WIRE_VERSION << 5, UP | 1, 1, 1];
    bytes.extend_from_slice(body);
    let [to, from] = [6, 5].map(SessionId::from_random);
    raw::close_with_crc(&mut bytes, MissionId(7), raw::Covered::Run(to, from, 1));
    let envelope = Envelope::decode(&bytes, |_| true).expect("a sound header");
    let frame = envelope.open(&Seal::Run { mission: MissionId(7), to, from, number: 1 }).expect("a right CRC");
    frame.chunks().map(|c| (c.kind, c.payload.to_vec())).collect()
}

/// Scripts that repeat the frames of the true peer, with disturbances in between.
fn scripts() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (name, setup) in SETUPS {
        for (target, way) in [("vehicle_link", "down"), ("surface_link", "up")] {
            let said = traffic(0).into_iter().filter(|(w, _)| *w == way).skip(2);
            let bodies: Vec<Vec<u8>> =
                said.map(|(_, bytes)| body_of(&bytes)).filter(|b| !b.is_empty()).take(8).collect();
            for (kind, between) in [("turns", TURN), ("restart", RESTART), ("storm", STORM)] {
                let steps = bodies.iter().flat_map(|body| [&numbered(body), between].concat());
                seeds.push((target, format!("{name}-{kind}"), std::iter::once(setup).chain(steps).collect()));
            }
            let forged = bodies.iter().flat_map(|body| [&numbered(body), &forged(body), TURN].concat());
            seeds.push((target, format!("{name}-forgery"), std::iter::once(setup).chain(forged).collect()));
        }
    }
    seeds
}

/// A quarter second passes, the modem polls, the end transmits.
const TURN: &[u8] = &[8, 5, 12, 4, 14, 30];
/// The peer sends a hello of a new run, receives the answer, and the host changes its state.
const RESTART: &[u8] = &[5, 1, 7, 3, 20, 0, 1, 1, 14, 30, 13, 0, 9, 8, 20];
/// Repeats, strays, noise, unusual statements and numbers, a long silence.
const STORM: &[u8] =
    &[7, 1, 6, 0, 1, 0, 2, 0x20, 0, 0, 3, 1, 2, 3, 2, 0x3B, 0, 2, 0x10, 1, 0, 9, 0, 1, 1, 0, 9, 7, 15, 0, 11, 0];

/// A step with a frame that acknowledges all frames, grants or wishes a turn, and carries `body`.
fn numbered(body: &[u8]) -> Vec<u8> {
    [&[1, 0x08, 40, 0, body.len() as u8], body].concat()
}

/// As `numbered`, with the CRC of a mission without a key.
fn forged(body: &[u8]) -> Vec<u8> {
    [&[6, 0x10, 40, 0, body.len() as u8], body].concat()
}

fn body_of(bytes: &[u8]) -> Vec<u8> {
    let envelope = Envelope::decode(bytes, |_| true).expect("a frame");
    bytes[raw::head(&envelope.header).len()..bytes.len() - Seal::bytes(false, envelope.header.kind())].to_vec()
}

/// Bytes in the unit tests and in the description of the wire.
fn golden() -> Vec<Seed> {
    let losses = |lost: Vec<u16>| {
        let mut bytes = Vec::new();
        AckStatement::new(2000, lost, AckForm::Near).encode(300, &mut bytes);
        bytes
    };
    let key = MissionKey::from_bytes(*b"0123456789abcdef").to_text();
    let text = |text: &str| text.as_bytes().to_vec();
    let seed = |target, name: &str, data| (target, name.to_owned(), data);
    vec![
        seed("ack", "none-lost", losses(vec![])),
        seed("ack", "two-lost", losses(vec![1, 4])),
        seed("ack", "a-tenth-lost", losses((0..60).map(|i| i * 10).collect())),
        seed("ack", "a-few-far-apart", losses(vec![0, 700, 1900])),
        seed("ack", "then-frames", [losses(vec![2]), vec![0, 1, 0, 0, 5, 0, 3, 0, 1, 6, 0, 9, 0, 4, 2]].concat()),
        seed("introduction", "surface", vec![0x00, 0x09, 0xC4, 0, 0, 0, 0, 0xAB, 0xCD]),
        seed("introduction", "vehicle", vec![0x00, 0x09, 0xC4]),
        seed("introduction", "later-version", vec![0x00, 0x09, 0xC4, 0, 0, 0, 0, 0xAB, 0xCD, 1, 2, 3]),
        seed("introduction", "cut-series", vec![0x00, 0x09, 0xC4, 0, 0, 0, 0, 0xAB]),
        seed("stamp", "surface", vec![1, 2, 3, 0x02, 0x9B, 0]),
        seed("stamp", "not-known", vec![0, 0, 1, 0xFF, 0xFF, 0]),
        seed("stamp", "vehicle", vec![0xFF, 0xFF, 0xFF, 9, 1, 2, 0, 0, 1, 1, 0, 0, 2, 2]),
        seed("stamp", "late", [0xFF; 18].to_vec()),
        seed("layer_chunk", "digest", vec![0x41, 0x27, 0xA6]),
        seed("layer_chunk", "without-a-patch", vec![1]),
        seed("layer_chunk", "curiosity", vec![2, 0x07, 0xF0, 0x40]),
        seed("layer_chunk", "unknown", vec![14, 0x07, 0xF0, 0x40]),
        seed("layer_chunk", "first-part", vec![0x80, 0xBE, 0xEF, 0, 0x44, 0, 0xFE, 0, 0, 0, 5, 0xFF]),
        seed("layer_chunk", "last-part", vec![0x80, 0xBE, 0xEF, 0x8E, b'e', b'p', b't', b'h', b'm']),
        seed("status", "golden-intent", vec![2, 5]),
        seed("status", "golden-trail", vec![0x25, 0x09, 0x3B, 0x20, 0xC8, 0x80]),
        seed("status", "golden-pose", vec![0x20, 0, 0, 15, 0xFF, 0xFF, 0xFF, 0, 180, 64, 5, 8, 0, 0x0F, 0xA0]),
        seed(
            "status",
            "golden-pose-with-a-path",
            vec![
                0x31, 0, 0, 15, 0xFF, 0xFF, 0xFF, 0, 180, 64, 5, 8, 0, 0x0F, 0xA0, 0, 0, 10, 0xFF, 0xFF, 0xEC, 0xA3,
                0x1D, 0x94, 0x40, 0,
            ],
        ),
        seed("slot", "utility", vec![12, 0x00, 0xAB, 0xCD, 0, 4, 1, 20, 0, 3, 80, 5, 0xEC]),
        seed("slot", "requests", vec![10, 0x80, 0xAB, 0xCD, 0, 4, 1, 3, 1, 5, 2]),
        seed("slot", "budget", vec![13, 0x60, 0xAB, 0xCD, 0, 4, 0, 0x27, 0x10, 10, 5, 5, 50, 20]),
        seed(
            "slot",
            "settings-of-two-series",
            vec![9, 0x40, 0, 1, 0, 4, 0x92, 0x10, 0x28, 0x64, 7, 0x40, 0, 2, 0, 1, 0x04, 0],
        ),
        seed("key_text", "key", text(&key)),
        seed("key_text", "commented", text(&format!("# reef\r\n\r\n  {}# end", *key))),
        seed("key_text", "twice", text(&format!("{}{}", *key, *key))),
        seed("key_text", "wrong-digit", text(&key.replace("key 1 3", "key 1 4"))),
        seed("key_text", "other-version", text("scenecast-key 2 00 00")),
    ]
}

/// Chunks of one change of each base, whole and broken.
fn map_chunks() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for choice in 0..3u8 {
        let (base, target) = change(choice);
        for (codec, room) in [(Codec::Png, 30), (Codec::Png, 100), (Codec::Context, 30), (Codec::Context, 100)] {
            let chunk = encode(codec, &base, &target, Cell::new(0, 4), room, &|_| true).expect("fits");
            let data: Vec<u8> = std::iter::once(choice).chain(chunk.bytes).collect();
            let mut broken = data.clone();
            broken[data.len() / 2] ^= 0x10;
            let name = format!("{codec}-{choice}-{room}");
            seeds.push(("map_chunk", format!("{name}-broken"), broken));
            seeds.push(("map_chunk", name, data));
        }
    }
    seeds
}

/// A base with a patch of new labels and a few isolated flips.
fn change(choice: u8) -> (LabelGrid, LabelGrid) {
    let base = base(choice);
    let mut target = base.clone();
    for i in 0..60 {
        target.set(Cell::new(i % 10 - 3, i / 10 + 2), if i % 7 == 0 { 4 } else { 9 });
    }
    for (x, y, label) in [(-9, -7, 2), (5, -6, 11), (14, 9, 0), (-12, 13, 254)] {
        target.set(Cell::new(x, y), label);
    }
    (base, target)
}
