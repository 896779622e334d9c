//! The fuzz corpus and chunks whose bytes must not change.

use super::fuzz_check::{base, check};
use super::{Codec, decode, encode};
use crate::map::{Cell, LabelGrid};

/// The base with a patch of new labels and a few lone flips.
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

#[test]
fn the_corpus_is_read_or_refused_without_panic() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/map_chunk/corpus");
    let files = std::fs::read_dir(folder).expect("corpus").map(|entry| entry.expect("entry").path());
    let data: Vec<Vec<u8>> = files.map(|path| std::fs::read(path).expect("corpus file")).collect();
    assert!(data.len() >= 10);
    data.iter().for_each(|data| check(data));
    let accepted = data.iter().filter(|data| decode(&base(data[0]), &data[1..]).is_ok()).count();
    assert!(accepted >= 6, "only {accepted} chunks of the corpus still decode");
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What the bytes say about the change of base 2, read back.
fn reads_back(codec: Codec, golden: &str) {
    let (base, target) = change(2);
    let chunk = encode(codec, &base, &target, Cell::new(0, 4), 100, &|_| true).expect("fits");
    let bytes: Vec<u8> =
        (0..golden.len() / 2).map(|i| u8::from_str_radix(&golden[2 * i..2 * i + 2], 16).expect("hex")).collect();
    assert_eq!(decode(&base, &bytes).as_ref(), Ok(&chunk.changes));
}

#[test]
fn png_chunks_with_golden_bytes_still_read() {
    // Not compared with what is written today: that depends on the deflate library.
    reads_back(Codec::Png, PNG);
}

#[test]
fn context_chunks_keep_their_golden_bytes() {
    let (base, target) = change(2);
    let chunk = encode(Codec::Context, &base, &target, Cell::new(0, 4), 100, &|_| true).expect("fits");
    assert_eq!(hex(&chunk.bytes), CONTEXT);
    reads_back(Codec::Context, CONTEXT);
}

const PNG: &str =
    "0e9e5694a360636060606062201670330c4fc0c20906400a530e2ac189550eae11bb3e883c363998461cfac0f2147aea3f4d82ea1f6e2900";
const CONTEXT: &str = "8e9e5694bc79c7a0f7d79aa0026eed74d0eca676e59de9c14617954c2644f2f7591908097e78d5";

#[test]
#[ignore = "writes the corpus anew"]
fn write_the_corpus() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/map_chunk/corpus");
    for choice in 0..3u8 {
        let (base, target) = change(choice);
        for codec in [Codec::Png, Codec::Context] {
            for room in [30, 100] {
                let chunk = encode(codec, &base, &target, Cell::new(0, 4), room, &|_| true).expect("fits");
                let data: Vec<u8> = std::iter::once(choice).chain(chunk.bytes).collect();
                let write = |name: String, data: &[u8]| std::fs::write(folder.join(name), data).expect("write");
                write(format!("{codec}-{choice}-{room}"), &data);
                let mut broken = data.clone();
                broken[data.len() / 2] ^= 0x10;
                write(format!("{codec}-{choice}-{room}-broken"), &broken);
            }
        }
    }
}
