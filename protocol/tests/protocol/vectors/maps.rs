//! Chunks of the map, with the base and the result of each.

use super::files::{assert_file, is_update};
use crate::examples::vectors::{DecisionVector, GridVector, Hex, MapChunks, MapVector, folder};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::{Codec, Stride, decode, encode_all, encode_every, trace};

/// A base and what a chunk makes of it.
type Change = (LabelGrid, LabelGrid);

#[test]
fn context_chunks_are_those_of_the_vectors() {
    let chunk = |name: &str, (base, target): Change, room: usize| {
        let chunks = encode_all(Codec::Context, &base, &target, room).expect("room for a cell");
        vector(name, &base, chunks.into_iter().next().expect("a chunk").bytes)
    };
    let (base, target) = scattered();
    let differs = |cell: &Cell| Stride::Four.on_lattice(*cell).is_some() && base.get(*cell) != target.get(*cell);
    let seed = base.iter().map(|(cell, _)| cell).find(differs).expect("a cell that differs");
    let every_fourth = encode_every(Stride::Four, Codec::Context, &base, &target, seed, 60, &|_| true);
    let chunks = vec![
        chunk("a patch of 5 x 2 cells in one label", corrected(), 1000),
        chunk("a first patch", (LabelGrid::default(), striped(12, 5, 0)), 1000),
        chunk("a last row that is short", (LabelGrid::default(), striped(30, 30, 1)), 24),
        chunk("cells that lose their label", (striped(12, 12, 0), striped(12, 7, 0)), 1000),
        chunk(
            "labels that are not in use",
            (striped(10, 10, 0), with(striped(10, 10, 0), &[(4, 4, 200), (5, 4, 254)])),
            1000,
        ),
        chunk("a change of more than a thousand decisions", (base.clone(), target.clone()), 1000),
        chunk("the key of an empty place, FFFFFFFF, comes up", with_empty_key(), 1000),
        vector("every fourth cell", &base, every_fourth.expect("a chunk").bytes),
        chunk("far from the origin", (LabelGrid::default(), moved(&striped(6, 6, 0), -40_000, 70_000)), 1000),
        chunk("one cell", (striped(10, 10, 0), with(striped(10, 10, 0), &[(9, 9, 1)])), 1000),
    ];
    let decisions = |at: usize| {
        let MapVector { chunk, base, .. } = &chunks[at];
        trace(&base.to_grid(), &chunk.0).expect("a sound chunk")
    };
    assert!(decisions(5).len() > 1000, "{}", decisions(5).len());
    assert!(decisions(6).iter().any(|decision| decision.keyed.iter().any(|&(key, _)| key == u32::MAX)));
    let trace = decisions(0).iter().map(DecisionVector::of).collect();
    assert_file("context.json", &MapChunks { chunks, trace });
}

/// The bytes of these chunks depend on the deflate library, so those of the file are kept.
#[test]
#[allow(clippy::disallowed_methods, reason = "vectors are files")]
fn png_chunks_of_the_vectors_read() {
    let changes: [(&str, Change); 4] = [
        ("two cells on an empty map", (LabelGrid::default(), with(LabelGrid::default(), &[(-1, 2, 7), (0, 2, 1)]))),
        ("a patch of 5 x 2 cells in one label", corrected()),
        ("cells that lose their label", (striped(12, 12, 0), striped(12, 7, 0))),
        ("a large patch", scattered()),
    ];
    let written = std::fs::read_to_string(folder().join("png.json")).unwrap_or_default();
    let held: Option<MapChunks> = serde_json::from_str(&written).ok().filter(|_| !is_update());
    let vectors = changes.into_iter().enumerate().map(|(i, (name, (base, target)))| {
        let bytes = held
            .as_ref()
            .map(|held| held.chunks[i].chunk.0.clone())
            .unwrap_or_else(|| encode_all(Codec::Png, &base, &target, 1000).expect("room for a cell").remove(0).bytes);
        assert!(bytes[0] < 0x80, "{name} has the body png");
        vector(name, &base, bytes)
    });
    assert_file("png.json", &MapChunks { chunks: vectors.collect(), trace: Vec::new() });
}

fn vector(name: &str, base: &LabelGrid, chunk: Vec<u8>) -> MapVector {
    let mut result = base.clone();
    for (cell, label) in decode(base, &chunk).unwrap_or_else(|error| panic!("{name}: {error}")) {
        result.set(cell, label);
    }
    assert_ne!(&result, base, "{name}");
    MapVector { name: name.to_owned(), chunk: Hex(chunk), base: GridVector::of(base), result: GridVector::of(&result) }
}

/// Steps of four columns and three rows with the labels 1 to 3; `phase` shifts them by rows.
fn striped(width: i32, height: i32, phase: i32) -> LabelGrid {
    let label = |x: i32, y: i32| ((x / 4 + (y + phase) / 3) % 3 + 1) as u8;
    (0..height).flat_map(|y| (0..width).map(move |x| (Cell::new(x, y), label(x, y)))).collect()
}

fn with(mut grid: LabelGrid, cells: &[(i32, i32, u8)]) -> LabelGrid {
    cells.iter().for_each(|&(x, y, label)| {
        grid.set(Cell::new(x, y), label);
    });
    grid
}

fn moved(grid: &LabelGrid, x: i32, y: i32) -> LabelGrid {
    grid.iter().map(|(cell, label)| (Cell::new(cell.x + x, cell.y + y), label)).collect()
}

/// Bands, and the same with a third of all labels drawn again.
fn scattered() -> Change {
    let (base, mut state) = (striped(40, 40, 0), 1u64);
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        state >> 60
    };
    let target = base.iter().map(|(cell, label)| (cell, if draw() < 5 { draw() as u8 + 1 } else { label })).collect();
    (base, target)
}

/// Six by six cells of label 1, of which some change, and cells beside them.
fn corrected() -> Change {
    let base = rows(&["1 1 1 1 1 1"; 6]);
    (base.clone(), with(base, &[(4, 2, 3), (6, 2, 1), (2, 3, 0), (4, 3, 3), (6, 3, 9)]))
}

fn with_empty_key() -> Change {
    let base = rows(&["105 65 168 0 0 0", "52 0 0 0 0 0", "0 0 0 0 0 0"]);
    (base, rows(&["105 65 168 0 0 0", "52 52 0 0 0 7", "9 8 0 0 3 1"]))
}

fn rows(rows: &[&str]) -> LabelGrid {
    GridVector { x: 0, y: 0, rows: rows.iter().map(|&row| row.to_owned()).collect() }.to_grid()
}
