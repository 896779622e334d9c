//! Coding and decoding of whole changes.

use super::header::{Body, ChunkHeader};
use super::patch::Lattice;
use super::{Codec, DecodeError, MapChunk, decode, encode, restored_png};
use crate::bytes::BitWriter;
use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect};
use proptest::prelude::*;
use std::collections::BTreeSet;

const CODECS: [Codec; 3] = [Codec::Auto, Codec::Png, Codec::Context];

/// A patchy grid: blobs of labels on a square at any position.
fn grid(labels: u8, density: u8) -> impl Strategy<Value = Vec<(i32, i32, u8)>> {
    let blob = (0..40i32, 0..40i32, 1..9i32, 1..9i32, 0..=labels);
    let cell = (0..40i32, 0..40i32, 0..=labels);
    (prop::collection::vec(blob, 0..8), prop::collection::vec(cell, 0..usize::from(density) + 1)).prop_map(
        |(blobs, cells)| {
            let mut out = Vec::new();
            for (x, y, w, h, label) in blobs {
                out.extend((0..w * h).map(|i| (x + i % w, y + i / w, label)));
            }
            out.extend(cells);
            out
        },
    )
}

fn place(origin: (i32, i32), cells: &[(i32, i32, u8)], onto: &mut LabelGrid) {
    for &(x, y, label) in cells {
        if let (Some(x), Some(y)) = (origin.0.checked_add(x), origin.1.checked_add(y)) {
            onto.set(Cell::new(x, y), label);
        }
    }
}

fn origins() -> impl Strategy<Value = (i32, i32)> {
    prop_oneof![
        Just((0, 0)),
        Just((-20, -20)),
        (-3000..3000i32, -3000..3000i32),
        Just((i32::MAX - 30, i32::MIN)),
        Just((i32::MIN, i32::MAX - 39)),
    ]
}

/// Base, target and the cells that differ.
fn change() -> impl Strategy<Value = (LabelGrid, LabelGrid, Vec<Cell>)> {
    (origins(), prop_oneof![Just(3u8), Just(12), Just(254)], 0..200u8)
        .prop_flat_map(|(origin, labels, density)| (Just(origin), grid(labels, 20), grid(labels, density)))
        .prop_map(|(origin, before, after)| {
            let (mut base, mut target) = (LabelGrid::default(), LabelGrid::default());
            place(origin, &before, &mut base);
            place(origin, &before, &mut target);
            place(origin, &after, &mut target);
            let cells: BTreeSet<Cell> = base.iter().chain(target.iter()).map(|(cell, _)| cell).collect();
            let dirty = cells.into_iter().filter(|&c| base.get(c) != target.get(c)).collect();
            (base, target, dirty)
        })
}

fn check_chunk(chunk: &MapChunk, room: usize, base: &LabelGrid, target: &LabelGrid, seed: Cell) {
    assert!(chunk.bytes.len() <= room);
    assert_eq!(decode(base, &chunk.bytes).as_ref(), Ok(&chunk.changes));
    assert!(chunk.changes.iter().any(|&(cell, _)| cell == seed));
    assert!(chunk.changes.iter().all(|&(cell, label)| target.get(cell) == label && base.get(cell) != label));
    let cells: BTreeSet<Cell> = chunk.changes.iter().map(|&(cell, _)| cell).collect();
    assert_eq!(cells.len(), chunk.changes.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn chunks_have_exactly_the_wanted_changes(
        (base, target, dirty) in change(), room in 5..1000usize, pick: prop::sample::Index, salt in 0..4i32,
    ) {
        prop_assume!(!dirty.is_empty());
        let seed = dirty[pick.index(dirty.len())];
        let wanted = |cell: Cell| cell == seed || salt == 0 || cell.x.wrapping_mul(7).wrapping_add(cell.y) % 4 != salt;
        for codec in CODECS {
            if let Some(chunk) = encode(codec, &base, &target, seed, room, &wanted) {
                check_chunk(&chunk, room, &base, &target, seed);
                prop_assert!(chunk.changes.iter().all(|&(cell, _)| wanted(cell)));
            } else {
                prop_assert!(room < 24, "a single cell must fit {room} bytes");
            }
        }
    }

    #[test]
    fn chunks_one_after_another_make_the_maps_equal(
        (base, target, dirty) in change(), room in 24..300usize,
    ) {
        for codec in CODECS {
            let mut replica = base.clone();
            let mut left: BTreeSet<Cell> = dirty.iter().copied().collect();
            while let Some(&seed) = left.first() {
                let chunk = encode(codec, &replica, &target, seed, room, &|_| true).expect("one cell fits");
                for (cell, label) in decode(&replica, &chunk.bytes).expect("own chunk") {
                    replica.set(cell, label);
                    prop_assert!(left.remove(&cell));
                }
            }
            prop_assert_eq!(&replica, &target);
        }
    }

    #[test]
    fn arbitrary_bytes_are_read_or_refused_without_panic(
        (base, _, _) in change(), bytes in prop::collection::vec(any::<u8>(), 0..80),
    ) {
        let _ = decode(&base, &bytes);
        let _ = restored_png(&bytes);
    }

    #[test]
    fn any_body_after_a_valid_header_never_panics(
        (base, _, _) in change(), context: bool, x in -30..30i32, y in -30..30i32,
        width in 1..60u32, height in 1..60u32, body in prop::collection::vec(any::<u8>(), 0..120),
    ) {
        let patch = Rect { x, y, width, height };
        let head = ChunkHeader::new(Lattice::whole(&base), if context { Body::Context } else { Body::Png }, patch);
        let mut bits = BitWriter::default();
        head.write(&mut bits);
        body.iter().for_each(|&byte| bits.put(u64::from(byte), 8));
        let mut bytes = bits.into_bytes();
        head.seal(&mut bytes);
        match decode(&base, &bytes) {
            Ok(changes) => prop_assert!(changes.iter().all(|&(cell, label)| patch.contains(cell)
                && label <= MAX_LABEL && base.get(cell) != label)),
            Err(error) => prop_assert!(!matches!(error, DecodeError::BaseMismatch | DecodeError::BadGeometry)),
        }
        let _ = restored_png(&bytes);
    }

    #[test]
    fn mutated_chunks_are_read_or_refused_without_panic(
        (base, target, dirty) in change(), room in 24..400usize,
        bits in prop::collection::vec(any::<prop::sample::Index>(), 1..6), cut: prop::sample::Index,
    ) {
        prop_assume!(!dirty.is_empty());
        for codec in CODECS {
            let Some(chunk) = encode(codec, &base, &target, dirty[0], room, &|_| true) else { continue };
            let mut bytes = chunk.bytes.clone();
            for bit in &bits {
                let bit = bit.index(bytes.len() * 8);
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            let _ = decode(&base, &bytes);
            let _ = decode(&base, &chunk.bytes[..cut.index(chunk.bytes.len())]);
        }
    }

    #[test]
    fn a_byte_too_many_is_refused((base, target, dirty) in change(), extra: u8) {
        prop_assume!(!dirty.is_empty());
        for codec in CODECS {
            let Some(mut chunk) = encode(codec, &base, &target, dirty[0], 200, &|_| true) else { continue };
            chunk.bytes.push(extra);
            prop_assert!(decode(&base, &chunk.bytes).is_err());
        }
    }

    #[test]
    fn the_png_of_a_chunk_shows_its_changes((base, target, dirty) in change(), room in 24..900usize) {
        prop_assume!(!dirty.is_empty());
        let chunk = encode(Codec::Png, &base, &target, dirty[0], room, &|_| true).expect("one cell fits");
        let file = restored_png(&chunk.bytes).expect("own chunk");
        let rect = Rect::around(chunk.changes.iter().map(|&(cell, _)| cell)).expect("changes");
        let limits = png::Limits { bytes: 1 << 20 };
        let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(&file), limits);
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("valid head");
        let mut pixels = vec![0; reader.output_buffer_size().expect("bounded")];
        let info = reader.next_frame(&mut pixels).expect("valid image");
        prop_assert_eq!((info.width, info.height), (rect.width, rect.height));
        let decoded: Vec<(Cell, u8)> = rect.cells().zip(pixels.chunks(3)).filter(|(_, p)| p[0] != 0)
            .map(|(cell, p)| (cell, if p[0] == 255 { 0 } else { p[0] })).collect();
        prop_assert_eq!(decoded, chunk.changes);
    }
}

#[test]
fn a_wrong_base_is_nearly_always_refused() {
    let base: LabelGrid = (0..400).map(|i| (Cell::new(i % 20, i / 20), (i / 60) as u8 + 1)).collect();
    let mut target = base.clone();
    for i in 0..40 {
        target.set(Cell::new(i % 8 + 6, i / 8 + 6), 9);
    }
    for codec in CODECS {
        let chunk = encode(codec, &base, &target, Cell::new(7, 7), 200, &|_| true).expect("fits");
        let wrong_bases = (0..2000u32).map(|i| {
            let mut wrong = base.clone();
            for j in 0..1 + i % 3 {
                let spot = i.wrapping_mul(2_654_435_761).rotate_left(7 * j);
                let cell = Cell::new(6 + (spot % 8) as i32, 6 + (spot / 8 % 5) as i32);
                wrong.set(cell, (wrong.get(cell) % 50 + (spot / 40 % 150) as u8) + 1);
            }
            wrong
        });
        let taken = wrong_bases.filter(|wrong| decode(wrong, &chunk.bytes) != Err(DecodeError::BaseMismatch)).count();
        assert!(taken <= 2000 / 200, "{codec}: {taken} wrong bases of 2000 got past the check");
    }
}

#[test]
fn an_unwanted_seed_yields_no_chunk() {
    let target: LabelGrid = [(Cell::new(3, 3), 4), (Cell::new(9, 9), 5)].into_iter().collect();
    let base = LabelGrid::default();
    assert_eq!(encode(Codec::Auto, &base, &target, Cell::new(4, 4), 100, &|_| true), None);
    assert_eq!(encode(Codec::Auto, &base, &target, Cell::new(3, 3), 100, &|cell| cell.x != 3), None);
    assert_eq!(encode(Codec::Auto, &base, &target, Cell::new(3, 3), 3, &|_| true), None);
}

/// Blocks of labels around the origin, and the same with a patch of new labels and a few isolated flips.
fn golden_change() -> (LabelGrid, LabelGrid) {
    let label = |x: i32, y: i32| ((x.rem_euclid(40) / 8) * 3 + y.rem_euclid(33) / 11) as u8;
    let cells = (-40..40).flat_map(|y| (-40..40).map(move |x| Cell::new(x, y)));
    let base: LabelGrid = cells.map(|cell| (cell, label(cell.x, cell.y))).filter(|&(_, label)| label != 0).collect();
    let mut target = base.clone();
    for i in 0..60 {
        target.set(Cell::new(i % 10 - 3, i / 10 + 2), if i % 7 == 0 { 4 } else { 9 });
    }
    for (x, y, label) in [(-9, -7, 2), (5, -6, 11), (14, 9, 0), (-12, 13, 254)] {
        target.set(Cell::new(x, y), label);
    }
    (base, target)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Decodes golden bytes and compares the changes.
fn reads_back(codec: Codec, golden: &str) {
    let (base, target) = golden_change();
    let chunk = encode(codec, &base, &target, Cell::new(0, 4), 100, &|_| true).expect("fits");
    let bytes: Vec<u8> =
        (0..golden.len() / 2).map(|i| u8::from_str_radix(&golden[2 * i..2 * i + 2], 16).expect("hex")).collect();
    assert_eq!(decode(&base, &bytes).as_ref(), Ok(&chunk.changes));
}

#[test]
fn png_chunks_with_golden_bytes_still_read() {
    // The bytes are not compared, because they depend on the deflate library.
    reads_back(Codec::Png, PNG);
}

#[test]
fn context_chunks_keep_their_golden_bytes() {
    let (base, target) = golden_change();
    let chunk = encode(Codec::Context, &base, &target, Cell::new(0, 4), 100, &|_| true).expect("fits");
    assert_eq!(hex(&chunk.bytes), CONTEXT);
    reads_back(Codec::Context, CONTEXT);
}

const PNG: &str =
    "074f2b4a51b0636060606062201670330c4fc0c20906400a530e2ac189550eae11bb3e883c363998461cfac0f2147aea3f4d82ea1f6e2900";
const CONTEXT: &str = "874f2b4a59bce3d07bebcd50013776ba6876533b72cef4e0a30bcaa61322797bac8c8404bf3c6a80";
