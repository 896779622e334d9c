//! Arbitrary bytes as every format of the wire and the key file, except the map.

use super::raw::{self, Covered, Script};
use scenecast_protocol::directive::{InForceDigests, InForcePart, REPORTED_SLOTS, Series, SlotState, VersionedSlot};
use scenecast_protocol::link::{Admission, Flight, LinkWindow, SlotInbox};

use scenecast_protocol::map::{
    ClassChunk, ClassEntry, ClassReplica, LabelTree, LayerChunk, LayerDescriptor, LayerReplica, LayerSet, TextPart,
    TreeReplica,
};
use scenecast_protocol::object::{MAX_OBJECT, ObjectReceiver, Part, Received};
use scenecast_protocol::seal::{Direction, HeldKey, MissionKey};
use scenecast_protocol::time::{ClockMap, Instant};
use scenecast_protocol::wire::{
    AckStatement, Address, Envelope, Frame, FrameBuilder, Header, Introduction, MAX_WINDOW, MissionId, PoseDetails,
    Reader, Seal, SessionId, Stamp, VehicleStatus,
};
use std::time::Duration;

const MISSION: MissionId = MissionId(7);

/// A decoded header can be encoded and reads the same; bytes that verify under one seal verify under no other.
pub fn frame(data: &[u8]) {
    let key = MissionKey::from_bytes([9; 16]).vehicle(1);
    let session = key.session(MISSION.0, 1, 2, 3, data.len().is_multiple_of(2));
    let Ok(envelope) = Envelope::decode(data, |_| true) else { return };
    let header = &envelope.header;
    assert!((1..=MAX_WINDOW).contains(&u64::from(header.base)) && header.from != header.to);
    let plain = [Seal::Crc(MISSION, 0), run(u64::from(header.number))].iter().any(|seal| envelope.open(seal).is_some());
    let hello = envelope.open(&Seal::Hello(&key, MISSION, 0, 0)).is_some();
    let tagged = envelope.open(&Seal::Session(&session, Direction::Up, u64::from(header.number))).is_some();
    assert!(u8::from(plain) + u8::from(hello) + u8::from(tagged) <= 1);
    assert!(!(plain && header.keyed));
    reads_back(header);
}

fn reads_back(header: &Header) {
    let mut bytes = raw::head(header);
    raw::close_with_crc(&mut bytes, MISSION, Covered::Hello(0));
    bytes.resize(bytes.len() + 8, 0);
    let again = Envelope::decode(&bytes, |_| true).expect("a header that was written");
    assert_eq!(&again.header, header);
}

/// The losses of a statement ascend and read back; both ends accept any statement and any window of frames.
pub fn ack(data: &[u8]) {
    let mut reader = Reader::new(data);
    let Ok(statement) = AckStatement::decode(&mut reader) else { return };
    let low = u64::from(statement.horizon.low());
    assert!(
        low < 1 << statement.horizon.bits() && statement.lost.is_sorted() && statement.lost.len() <= 8 * data.len()
    );
    let mut bytes = Vec::new();
    assert!(statement.encode(usize::MAX, &mut bytes) && bytes.len() <= data.len());
    assert_eq!(AckStatement::decode(&mut Reader::new(&bytes)), Ok(statement.clone()));
    let mut flight = Flight::default();
    (0..low % 2500).for_each(|number| flight.push(number));
    let fates = flight.handle_statement(&statement, Some(1));
    assert!(fates.iter().is_sorted_by_key(|(number, _)| number) && flight.horizon() < flight.next_number());
    hear(Script(reader.rest()));
}

/// Any frame numbers may come in, and a statement on them is made.
fn hear(mut script: Script<'_>) {
    let mut window = LinkWindow::default();
    while !script.is_over() {
        let (number, base, what) = (script.u16(), script.u16() % 2048 + 1, script.u8());
        if window.accept(number.into(), base).is_ok() && what & 1 != 0 {
            window.hold_back(number.into());
        }
        if what & 2 != 0 {
            window.handle_persisted();
        }
        if what & 4 != 0 {
            let room = usize::from(what >> 3) + 2;
            let statement = window.statement(room, what & 8 != 0);
            let mut bytes = Vec::new();
            assert!(statement.is_none_or(|s| s.encode(room, &mut bytes) && bytes.len() <= room));
        }
    }
}

/// The CRC of a frame from the run 5 to the run 6.
fn run(number: u64) -> Seal<'static> {
    let [to, from] = [6, 5].map(SessionId::from_random);
    Seal::Run { mission: MISSION, to, from, number }
}

fn header() -> Header {
    Header::numbered(Address::vehicle(1).expect("a vehicle"), Address::SURFACE, 1, 1)
}

/// A body has at most as many chunks as bytes, and sound chunks can be written into a frame again.
pub fn chunks(data: &[u8]) {
    let mut bytes = raw::head(&header());
    bytes.extend_from_slice(data);
    let Seal::Run { to, from, number, .. } = run(1) else { return };
    raw::close_with_crc(&mut bytes, MISSION, Covered::Run(to, from, number));
    let envelope = Envelope::decode(&bytes, |_| true).expect("a sound header");
    let frame = envelope.open(&run(1)).expect("a right CRC");
    let payload: usize = frame.chunks().map(|c| c.payload.len() + 1).sum();
    assert!(payload <= data.len());
    if frame.chunks().are_sound() {
        write_again(&frame);
    }
}

fn write_again(frame: &Frame<'_>) {
    let mut builder = FrameBuilder::new(&header(), 1 << 17);
    let short: Vec<_> = frame.chunks().filter(|c| c.payload.len() <= 1000).collect();
    assert!(short.iter().all(|c| builder.push(c.kind, c.payload)));
    let bytes = builder.finish(&run(1), true);
    let envelope = Envelope::decode(&bytes, |_| true).expect("a header that was written");
    let again = envelope.open(&run(1)).expect("a frame that was written");
    assert!(again.chunks().are_sound() && again.chunks().eq(short));
}

/// A stamp reads back, and any clock can be tracked from any time.
pub fn stamp(data: &[u8]) {
    let mut script = Script(data);
    let (clock_ms, a, b, c) =
        (u32::from_be_bytes([0, script.u8(), script.u8(), script.u8()]), script.u8(), script.u8(), script.u8());
    let millis = |a, b| Duration::from_millis(u16::from_be_bytes([a, b]).into());
    let surface = Stamp::Surface { clock_ms, one_way: Some(millis(a, b)).filter(|d| d.as_millis() < 65_535) };
    let vehicle = Stamp::Vehicle { clock_ms, last_received: a, held: millis(b, c) };
    reads_back(&Header { stamp: Some(vehicle), ..header() });
    reads_back(&Header { from: Address::SURFACE, to: header().from, stamp: Some(surface), ..header() });
    let mut moment = || Instant::from_micros(u64::from(script.u16()) << 32 | u64::from(script.u16()) << 8);
    let (now, at, ago) = (moment(), moment(), moment());
    let mut map = ClockMap::default();
    map.measure(clock_ms, Duration::from(ago), now);
    assert!(map.to_theirs(at) < 1 << 24);
    let _ = map.to_ours(clock_ms, at);
}

/// A decoded introduction reads back; bytes after it are of a later version.
pub fn introduction(data: &[u8]) {
    let Ok(introduction) = Introduction::decode(data) else { return };
    let bytes = introduction.encode(Introduction::MAX_BYTES);
    assert!(bytes.len() <= Introduction::MAX_BYTES && data.get(..3) == bytes.get(..3));
    assert_eq!(Introduction::decode(&bytes), Ok(introduction));
    assert!(introduction.cell_edge.metres().is_none_or(|edge| edge > 0.0 && edge.is_finite()));
}

/// A decoded pose or report can be encoded and reads the same.
pub fn status(data: &[u8]) {
    if let Ok(details) = PoseDetails::decode(data) {
        assert!(details.encode() == data || data[0] & 0x0F != 0);
    }
    let (mut pose, mut report) = (VehicleStatus::default(), VehicleStatus::default());
    if pose.read_pose(data).is_ok() {
        assert_eq!(pose.encode_pose(usize::MAX), data);
    } else {
        assert_eq!(pose, VehicleStatus::default());
    }
    if report.read_report(data).is_ok() {
        let mut again = VehicleStatus::default();
        again.read_report(&report.encode_report(99, 0).expect("room").0).expect("a report that was written");
        assert_eq!(again, report);
    } else {
        assert_eq!(report, VehicleStatus::default());
    }
}

/// A decoded part of a name can be encoded and reads the same; an entry whose digest fits is sound.
fn class_chunk(data: &[u8]) {
    let Some(chunk) = ClassChunk::decode(data) else { return };
    assert_eq!(chunk.encode(), data);
    let digest = TextPart::digest_of(chunk.part.bytes);
    let part = TextPart { digest, first: 0, is_last: true, ..chunk.part };
    let fitting = ClassChunk { part, ..chunk }.encode();
    for chunk in [data, &fitting] {
        let mut replica = ClassReplica::default();
        let is_complete = replica.handle_chunk(chunk);
        assert_eq!(is_complete == Some(true), replica.iter().count() == 1);
        assert!(replica.iter().all(|e| ClassEntry::from_bytes(e.label(), &e.to_bytes()).as_ref() == Some(e)));
    }
}

/// A tree that is read has one encoding, and every label one group at each cut; parts are taken or refused.
fn label_tree(data: &[u8]) {
    let _ = TreeReplica::default().handle_chunk(1, data);
    let Some(tree) = LabelTree::from_bytes(data) else { return };
    assert_eq!(tree.to_bytes(), data);
    for label in 1..=254 {
        let group = tree.group_of(label, 2);
        assert_eq!(tree.group_of(group, 2), group);
        let other = tree.weighed_as(label, 100);
        assert!(other == label || label > 100 && other <= 100);
    }
}

/// A decoded layer chunk can be encoded and reads the same; it is applied or refused, with levels in range.
pub fn layer_chunk(data: &[u8]) {
    class_chunk(data);
    label_tree(data);
    let Some(chunk) = LayerChunk::decode(data) else { return };
    assert_eq!(chunk.encode(), data);
    let layers = LayerSet::default();
    match (chunk, layers.get(chunk.id())) {
        (LayerChunk::Patch(_, patch), Some(layer)) => {
            let mut replica = LayerReplica::new(layer.clone());
            let taken = replica.apply(1, patch, Instant::ZERO);
            assert!(taken || replica.levels().shown().is_empty());
            assert!(replica.levels().shown().iter().all(|(_, level)| layer.bounds(level).is_some()));
        }
        (LayerChunk::Descriptor(_, part), _) => {
            // A digest rarely fits by chance: the bytes may be a descriptor without it.
            LayerDescriptor::from_bytes(part.bytes).iter().for_each(announced);
        }
        _ => {}
    }
}

/// The levels of a layer follow each other, and each holds its middle.
fn announced(layer: &LayerDescriptor) {
    assert!(layer.is_sound());
    for level in 1..=layer.levels {
        let (low, high) = layer.bounds(level).expect("a level");
        assert!(low <= high && low.is_finite() && high.is_finite());
        assert!(layer.level((low + high) / 2.0, 0) <= layer.levels);
    }
}

/// A decoded slot can be encoded and reads the same; no version is admitted twice.
pub fn slot(data: &[u8]) {
    let mut inbox = SlotInbox::default();
    let mut script = Script(data);
    while !script.is_over() {
        let Ok(slot) = VersionedSlot::decode(script.bytes()) else { continue };
        if let Some(content) = &slot.content {
            let bytes = VersionedSlot::encode(slot.version, content);
            assert_eq!(VersionedSlot::decode(&bytes).as_ref(), Ok(&slot));
        }
        let series = Series::from_random(u64::from(slot.version >> 13));
        if inbox.admit(series, &slot, true) == Admission::New {
            inbox.decide(slot.id, SlotState::Applied);
        }
        assert_ne!(inbox.admit(series, &slot, true), Admission::New);
        inbox = SlotInbox::restore(inbox.state().clone());
        assert!(inbox.state().records.len() <= 16);
    }
}

/// Parts of a content in force and inquiries read the same again; what they make is a slot with that digest.
pub fn in_force(data: &[u8]) {
    let mut script = Script(data);
    while !script.is_over() {
        let bytes = script.bytes();
        if let Some(part) = InForcePart::decode(bytes) {
            assert_eq!(part.encode(), bytes);
        }
        if let Ok(digests) = InForceDigests::decode(bytes) {
            assert_eq!(InForceDigests::decode(&digests.encode()), Ok(digests));
            assert!(REPORTED_SLOTS.into_iter().all(|id| digests.summary().has(id) == (digests.get(id) != Some(&0))));
        }
    }
}

/// Any parts are handled within bounds.
pub fn object(data: &[u8]) {
    let mut receiver = ObjectReceiver::default();
    let mut script = Script(data);
    while !script.is_over() {
        let bytes = script.bytes();
        let Ok(part) = Part::decode(bytes) else { continue };
        assert_eq!(part.encode(), bytes);
        match receiver.handle_part(&part) {
            Received::Complete(_, bytes) => assert!((1..=MAX_OBJECT).contains(&bytes.len())),
            Received::Progress(id, held, total) => {
                assert!(held <= total && total <= MAX_OBJECT + 64);
                assert!(receiver.head(id, 3).is_none_or(|head| head.len() == 3));
            }
            Received::Nothing => {}
        }
    }
    assert!(format!("{receiver:?}").len() < 4 << 20);
}

/// A parsed key can be written and reads the same; an error names an existing line.
pub fn key_text(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match HeldKey::parse(&text) {
        Ok(key) => {
            let written = match &key {
                HeldKey::Mission(key) => key.to_text(),
                HeldKey::Vehicle(key) => key.to_text(),
            };
            let again = HeldKey::parse(&written).expect("a key that was written");
            assert_eq!(again.fingerprint(), key.fingerprint());
        }
        Err(e) => assert!(e.to_string().len() < 200),
    }
}
