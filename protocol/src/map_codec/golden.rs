//! Chunks whose bytes must not change.

use super::{Codec, decode, encode};
use crate::grid::{Cell, LabelGrid};

/// Blocks of labels around the origin, and the same with a patch of new labels and a few isolated flips.
fn change() -> (LabelGrid, LabelGrid) {
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
    let (base, target) = change();
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
    let (base, target) = change();
    let chunk = encode(Codec::Context, &base, &target, Cell::new(0, 4), 100, &|_| true).expect("fits");
    assert_eq!(hex(&chunk.bytes), CONTEXT);
    reads_back(Codec::Context, CONTEXT);
}

const PNG: &str =
    "074f2b4a51b0636060606062201670330c4fc0c20906400a530e2ac189550eae11bb3e883c363998461cfac0f2147aea3f4d82ea1f6e2900";
const CONTEXT: &str = "874f2b4a59bce3d07bebcd50013776ba6876533b72cef4e0a30bcaa61322797bac8c8404bf3c6a80";
