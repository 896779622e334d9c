//! The map codec without a link: a growing map in chunks of at most 64 bytes, by each coder, then decoded.
//!
//! `cargo run -p scenecast-protocol --example map_series`

use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::{Codec, decode, encode_all};

const ROOM: usize = 64;

/// Public because `tests/protocol/examples.rs` includes this file and runs it as a test.
pub fn main() {
    println!("Bytes in chunks of at most {ROOM} bytes, for each hundred cells that change:\n");
    let names = [Codec::Png, Codec::Context, Codec::Auto].map(|codec| format!("{:>13}", codec.to_string()));
    println!("step   changed cells   {}", names.join("   "));
    let mut base = LabelGrid::default();
    for step in 1..=5 {
        let target = surveyed(step);
        let changed = target.iter().filter(|&(cell, label)| base.get(cell) != label).count();
        let columns = [Codec::Png, Codec::Context, Codec::Auto].map(|codec| {
            let chunks = encode_all(codec, &base, &target, ROOM).expect("room for a cell");
            let bytes: usize = chunks.iter().map(|chunk| chunk.bytes.len()).sum();
            assert_eq!(applied(&base, chunks.iter().map(|chunk| chunk.bytes.as_slice())), target);
            format!("{bytes:5} ({:5.1})", 100.0 * bytes as f64 / changed as f64)
        });
        println!("{step:4}   {changed:13}   {}", columns.join("   "));
        base = target;
    }
    println!("\nEvery chunk decodes alone against the map of the step before, in any order.");
}

/// The map after some steps of a survey, which goes over the first legs a second time and corrects them.
fn surveyed(step: i32) -> LabelGrid {
    let label = |x: i32, y: i32| {
        let (x, y, shift) = (f64::from(x), f64::from(y), f64::from(step / 5));
        (((x * 0.11 + 0.2 * shift).sin() + (y * 0.19).cos() + 2.0) * 1.3) as u8 + 1
    };
    let rows = 12 * step.min(4);
    (0..rows).flat_map(|y| (0..80).map(move |x| (Cell::new(x, y), label(x, y)))).collect()
}

/// The base with all changes of the chunks.
fn applied<'a>(base: &LabelGrid, chunks: impl Iterator<Item = &'a [u8]>) -> LabelGrid {
    let mut map = base.clone();
    for chunk in chunks {
        for (cell, label) in decode(base, chunk).expect("a chunk against its base") {
            map.set(cell, label);
        }
    }
    map
}
