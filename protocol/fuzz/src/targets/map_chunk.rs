//! Bytes as a map chunk; the first byte chooses the base, the others are the chunk.

use scenecast_protocol::map::{Cell, LabelGrid, MAX_LABEL};
use scenecast_protocol::map_codec::{ChunkFile, MAX_PATCH_CELLS, decode, restored_png};

/// Decoding refuses the bytes or returns a plausible change.
pub fn map_chunk(data: &[u8]) {
    let Some((&choice, chunk)) = data.split_first() else { return };
    let base = base(choice);
    if let Ok(changes) = decode(&base, chunk) {
        assert!(changes.len() <= MAX_PATCH_CELLS);
        assert!(changes.iter().all(|&(cell, label)| label <= MAX_LABEL && base.get(cell) != label));
        assert!(changes.is_sorted_by_key(|&(cell, _)| (cell.y, cell.x)));
    }
    let _ = restored_png(chunk);
    let _ = ChunkFile::from_bytes(chunk);
}

/// An empty map, stripes, or blocks around the origin.
pub fn base(choice: u8) -> LabelGrid {
    let label = |x: i32, y: i32| match choice % 3 {
        0 => 0,
        1 => (y.rem_euclid(30) / 5) as u8,
        _ => ((x.rem_euclid(40) / 8) * 3 + y.rem_euclid(33) / 11) as u8,
    };
    let cells = (-40..40).flat_map(|y| (-40..40).map(move |x| Cell::new(x, y)));
    cells.map(|cell| (cell, label(cell.x, cell.y))).filter(|&(_, label)| label != 0).collect()
}
