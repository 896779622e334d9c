//! Sizes of the chunks of one change.

use super::Coding;
use crate::Zopfli;
use scenecast_core::UserError;
use scenecast_protocol::map_codec::{ChunkFile, ChunkFileError, LabelRaster};
use serde::Serialize;

/// Sizes of one change or of several.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Sizes {
    /// Bytes of all chunks, their heads included.
    pub(super) bytes: usize,
    /// Number of frames that the chunks fill in order; no chunk is split.
    pub(super) frames: usize,
    pub(super) cells_changed: usize,
    pub(super) codec: String,
    /// `None`: not compared with PNG files.
    #[serde(flatten)]
    pub(super) png: Option<PngSizes>,
}

/// Sizes of the PNG files that the chunks are compared with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PngSizes {
    /// Bytes of the whole map as the best PNG.
    pub(super) png_full_bytes: usize,
    /// Bytes of the change as the best PNG: delta image or dirty box.
    pub(super) png_delta_bytes: usize,
}

impl PngSizes {
    /// Compresses with zopfli, which takes most of the time of an encoding.
    pub fn measure(base: &LabelRaster, target: &LabelRaster) -> Self {
        Self {
            png_full_bytes: target.smallest_png(&mut Zopfli),
            png_delta_bytes: target.smallest_delta_png(base, &mut Zopfli),
        }
    }
}

impl Sizes {
    pub fn add(&mut self, other: &Self) {
        self.bytes += other.bytes;
        self.frames += other.frames;
        self.cells_changed += other.cells_changed;
        if let Some(png) = other.png {
            let sum = self.png.get_or_insert_default();
            sum.png_full_bytes += png.png_full_bytes;
            sum.png_delta_bytes += png.png_delta_bytes;
        }
    }
}

/// The chunks from `base` to `target`, and how many cells they change.
pub fn encode(coding: &Coding, base: &LabelRaster, target: &LabelRaster) -> Result<(ChunkFile, usize), UserError> {
    ChunkFile::encode(coding.codec, base, target, coding.frame_bytes.into()).map_err(refused)
}

/// A coding error is wrong input: the files were read without error before.
pub fn refused(error: ChunkFileError) -> UserError {
    UserError::Input(error.to_string())
}

/// Sizes of an encoded change, beside those of PNG files.
pub fn sizes(coding: &Coding, file: &ChunkFile, cells_changed: usize, png: Option<PngSizes>) -> Sizes {
    Sizes {
        bytes: file.chunks.iter().map(Vec::len).sum(),
        frames: frames(file.chunks.iter().map(Vec::len), coding.frame_bytes.into()),
        cells_changed,
        codec: coding.codec.to_string(),
        png,
    }
}

fn frames(chunks: impl Iterator<Item = usize>, room: usize) -> usize {
    let (mut frames, mut left) = (0, 0);
    for chunk in chunks {
        if chunk > left {
            (frames, left) = (frames + 1, room);
        }
        left -= chunk.min(left);
    }
    frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_share_a_frame_while_they_fit() {
        assert_eq!(frames([60, 40, 1, 99, 100].into_iter(), 100), 3);
        assert_eq!(frames([].into_iter(), 100), 0);
    }
}
