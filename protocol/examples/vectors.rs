//! The test vectors in `protocol/vectors`, compared with what this implementation reads from them. Another implementation can
//! begin with the same files; `protocol/vectors/README.md` explains them.
//!
//! `cargo run -p scenecast-protocol --example vectors`

use scenecast_protocol::map::{Cell, LabelGrid, MapDigest, Replica, StateReplica};
use scenecast_protocol::map_codec::{Decision, decode, trace};
use scenecast_protocol::object::{ObjectReceiver, Part, Received};
use scenecast_protocol::seal::{HeldKey, MissionKey};
use scenecast_protocol::wire::{ChunkKind, Frame, Listener, Stamp};
use scenecast_protocol::{Instant, MissionId};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::PathBuf;

/// Bytes, which the JSON files hold as hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hex(pub Vec<u8>);

/// Values with a name: parts of frames, keys.
#[derive(Debug, Serialize, Deserialize)]
pub struct Named {
    pub name: String,
    pub bytes: Hex,
}

/// Frames of one mission, in the order in which they are on air.
#[derive(Debug, Serialize, Deserialize)]
pub struct Frames {
    pub mission: String,
    pub key: Hex,
    pub frames: Vec<FrameVector>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct FrameVector {
    pub name: String,
    pub bytes: Hex,
    /// What the frame says; `None` of one that a receiver refuses.
    pub says: Option<Content>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Content {
    pub from: u8,
    pub to: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    pub number: u64,
    pub base: u16,
    pub remaining: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<StampVector>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nonce: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ack: Option<AckVector>,
    pub chunks: Vec<ChunkVector>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum StampVector {
    Vehicle { clock_ms: u32, last_received: u8, held_ms: u64 },
    Surface { clock_ms: u32, one_way_ms: Option<u64> },
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct AckVector {
    pub horizon_bits: u32,
    pub horizon_low: u16,
    /// Distances of the lost frames below the horizon, ascending.
    pub lost: Vec<u16>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct ChunkVector {
    pub kind: String,
    pub payload: Hex,
}

/// Chunks of the map, each with the map before and after it.
#[derive(Debug, Serialize, Deserialize)]
pub struct MapChunks {
    pub chunks: Vec<MapVector>,
    /// The decisions of the first chunk, if it has the body `context`.
    pub trace: Vec<DecisionVector>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct MapVector {
    pub name: String,
    pub chunk: Hex,
    pub base: GridVector,
    pub result: GridVector,
}

/// Labels, row by row, the southern row first, each from west to east; 0 is a cell without a label.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GridVector {
    pub x: i32,
    pub y: i32,
    pub rows: Vec<String>,
}

#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DecisionVector {
    pub cell: [i32; 2],
    pub kind: String,
    pub direct: Vec<usize>,
    pub keyed: Vec<[u64; 2]>,
    pub sets: Vec<usize>,
    pub curve: usize,
    pub one: u32,
    pub yes: bool,
}

/// Frames of both ends on a channel that loses some of them.
#[derive(Debug, Serialize, Deserialize)]
pub struct Sequence {
    pub mission: String,
    pub frames: Vec<HeardFrame>,
    /// The map of the vehicle, which is shown after the last frame.
    pub map: GridVector,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct HeardFrame {
    pub bytes: Hex,
    /// Whether it does not arrive.
    pub lost: bool,
    /// Digests of the base and of the map that is shown, after a numbered frame of the vehicle that arrives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digests: Option<[u16; 2]>,
}

/// Objects, each in parts of which some arrive.
#[derive(Debug, Serialize, Deserialize)]
pub struct Objects {
    pub objects: Vec<ObjectVector>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct ObjectVector {
    pub name: String,
    pub bytes: Hex,
    pub parts: Vec<PartVector>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct PartVector {
    pub payload: Hex,
    pub lost: bool,
    /// Whether the object is whole after it.
    pub whole: bool,
}

/// Public because `tests/protocol/examples.rs` includes this file and runs it as a test.
pub fn main() {
    let frames: Frames = read("frames.json");
    check_frames(&frames);
    println!("{:5} frames", frames.frames.len());
    for file in ["context.json", "png.json"] {
        let map: MapChunks = read(file);
        check_map_chunks(&map);
        println!("{:5} chunks, {} decisions, of {file}", map.chunks.len(), map.trace.len());
    }
    let sequence: Sequence = read("sequence.json");
    check_sequence(&sequence);
    println!("{:5} frames of a sequence", sequence.frames.len());
    let objects: Objects = read("objects.json");
    objects.objects.iter().for_each(check_object);
    println!("{:5} objects", objects.objects.len());
}

/// The folder of the vectors.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vectors")
}

#[allow(clippy::disallowed_methods, reason = "vectors are files")]
fn read<T: DeserializeOwned>(name: &str) -> T {
    let text = std::fs::read_to_string(folder().join(name)).expect(name);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn check_frames(vectors: &Frames) {
    let mut listener = listener(&vectors.mission, &vectors.key);
    for vector in &vectors.frames {
        assert_eq!(content(&mut listener, &vector.bytes.0), vector.says, "{}", vector.name);
    }
}

/// Hears a mission whose key has these bytes.
pub fn listener(mission: &str, key: &Hex) -> Listener {
    let key = <[u8; 16]>::try_from(key.0.as_slice()).expect("16 bytes");
    Listener::new(mission_id(mission), vec![HeldKey::Mission(MissionKey::from_bytes(key))])
}

fn mission_id(digits: &str) -> MissionId {
    MissionId(u32::from_str_radix(digits, 16).expect("a mission id"))
}

/// What a frame says, if it is sound.
pub fn content(listener: &mut Listener, bytes: &[u8]) -> Option<Content> {
    let frame = listener.hear(bytes).ok()?.frame.filter(|frame| frame.chunks().are_sound())?;
    let header = &frame.header;
    let stamp = header.stamp.map(|stamp| match stamp {
        Stamp::Surface { clock_ms, one_way } => {
            StampVector::Surface { clock_ms, one_way_ms: one_way.map(|time| time.as_millis() as u64) }
        }
        Stamp::Vehicle { clock_ms, last_received, held } => {
            StampVector::Vehicle { clock_ms, last_received, held_ms: held.as_millis() as u64 }
        }
    });
    let ack = header.ack.clone().map(|ack| AckVector {
        horizon_bits: ack.horizon.bits(),
        horizon_low: ack.horizon.low(),
        lost: ack.lost,
    });
    let chunk =
        |kind: ChunkKind, payload: &[u8]| ChunkVector { kind: format!("{kind:?}"), payload: Hex(payload.to_vec()) };
    Some(Content {
        from: header.from.number(),
        to: header.to.number(),
        session: header.session.map(|session| format!("{:04x}", session.get())),
        number: frame.number,
        base: header.base,
        remaining: header.remaining,
        turn: header.turn,
        stamp,
        nonce: header.nonce.map(|nonce| format!("{nonce:016x}")),
        ack,
        chunks: frame.chunks().map(|c| chunk(c.kind, c.payload)).collect(),
    })
}

fn check_map_chunks(vectors: &MapChunks) {
    for MapVector { name, chunk, base, result } in &vectors.chunks {
        let base = base.to_grid();
        let changes = decode(&base, &chunk.0).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut read = base;
        for (cell, label) in changes {
            read.set(cell, label);
        }
        assert_eq!(read, result.to_grid(), "{name}");
    }
    let first = &vectors.chunks[0];
    let decisions = trace(&first.base.to_grid(), &first.chunk.0).expect("a sound chunk");
    assert_eq!(decisions.iter().map(DecisionVector::of).collect::<Vec<_>>(), vectors.trace, "{}", first.name);
}

/// Hears the sequence and builds the map from the frames that arrive.
fn check_sequence(vectors: &Sequence) {
    let mut listener = Listener::new(mission_id(&vectors.mission), Vec::new());
    let mut replica = Replica::default();
    for (i, frame) in vectors.frames.iter().enumerate().filter(|(_, frame)| !frame.lost) {
        let heard = listener.hear(&frame.bytes.0).expect("a frame").frame.expect("a sound frame");
        let digests = take_map(&mut replica, &heard);
        assert_eq!(digests, frame.digests, "frame {i}");
    }
    assert_eq!(replica.shown(), &vectors.map.to_grid());
}

/// Takes over the map chunks of a frame of the vehicle; the digests of the base and of the map after it.
pub fn take_map(replica: &mut Replica, frame: &Frame<'_>) -> Option<[u16; 2]> {
    if !frame.header.from.is_vehicle() || frame.header.kind().is_hello() {
        return None;
    }
    replica.advance_base(frame.number - u64::from(frame.header.base));
    for chunk in frame.chunks().filter(|chunk| chunk.kind == ChunkKind::Map) {
        assert!(replica.apply(frame.number, chunk.payload, Instant::ZERO));
    }
    Some([replica.base_digest(), digest(replica.shown())])
}

fn digest(map: &LabelGrid) -> u16 {
    let mut digest = MapDigest::default();
    map.iter().for_each(|(cell, label)| digest.change(cell, 0, label));
    digest.value()
}

fn check_object(vector: &ObjectVector) {
    let mut receiver = ObjectReceiver::default();
    for part in vector.parts.iter().filter(|part| !part.lost) {
        let received = receiver.handle_part(&Part::decode(&part.payload.0).expect("a sound part"));
        let whole = matches!(&received, Received::Complete(_, object) if *object == vector.bytes.0);
        assert_eq!(whole, part.whole, "{}", vector.name);
    }
}

impl GridVector {
    /// The labels in the rectangle around them.
    pub fn of(grid: &LabelGrid) -> Self {
        let Some(bounds) = grid.bounds() else { return Self { x: 0, y: 0, rows: Vec::new() } };
        let row = |y: i32| {
            let labels = (0..bounds.width as i32).map(|x| grid.get(Cell::new(bounds.x + x, y)).to_string());
            labels.collect::<Vec<_>>().join(" ")
        };
        Self { x: bounds.x, y: bounds.y, rows: (0..bounds.height as i32).map(|y| row(bounds.y + y)).collect() }
    }

    pub fn to_grid(&self) -> LabelGrid {
        let mut grid = LabelGrid::default();
        for (row, y) in self.rows.iter().zip(self.y..) {
            for (label, x) in row.split(' ').zip(self.x..) {
                grid.set(Cell::new(x, y), label.parse().expect("a label"));
            }
        }
        grid
    }
}

impl DecisionVector {
    pub fn of(decision: &Decision) -> Self {
        Self {
            cell: [decision.cell.x, decision.cell.y],
            kind: decision.kind.to_owned(),
            direct: decision.direct.clone(),
            keyed: decision.keyed.iter().map(|&(key, start)| [u64::from(key), start as u64]).collect(),
            sets: decision.sets.clone(),
            curve: decision.curve,
            one: decision.one,
            yes: decision.is_yes,
        }
    }
}

impl Serialize for Hex {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.0.iter().map(|byte| format!("{byte:02x}")).collect::<String>())
    }
}

impl<'de> Deserialize<'de> for Hex {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        let digit = |at: usize| text.get(at..=at)?.chars().next()?.to_digit(16);
        let byte = |at: usize| Some((digit(at)? << 4 | digit(at + 1)?) as u8);
        let bytes: Option<_> = (0..text.len()).step_by(2).map(byte).collect();
        bytes.map(Self).ok_or_else(|| D::Error::custom("an even number of hexadecimal digits is expected"))
    }
}
