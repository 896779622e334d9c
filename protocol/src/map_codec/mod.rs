//! Label-map coding: changes of the map against a base that both ends hold, in chunks that fit into a frame.
//!
//! A chunk covers one compact patch. It has the new labels of the cells that change, and leaves every other cell of the
//! patch as it is. It decodes alone, given the base. See [`encode`] and [`decode`].

mod chunk;
#[allow(clippy::indexing_slicing)] // Tables whose sizes the layouts of its contexts give.
mod context;
mod file;
#[allow(clippy::indexing_slicing)] // Columns and rows of its own square.
mod grow;
mod header;
#[allow(clippy::indexing_slicing)] // Cells of its own patch.
mod patch;
mod png;
#[allow(clippy::indexing_slicing)]
mod raster;
#[allow(clippy::indexing_slicing)] // Cells of a row that it has counted.
mod series;

pub(crate) use chunk::encode_quickly;
pub use chunk::{ChunkPatch, Codec, decode, encode, encode_every, patch, trace};
pub use context::{Decision, training};
pub use file::{ChunkFile, ChunkFileError};
pub use patch::{DecodeError, MapChunk, Stride};
pub use png::restored_png;
pub use raster::{Deflate, LabelRaster, RasterPngError};
pub use series::encode_all;

/// The most cells of a patch; bounds the allocation in decoding a chunk.
pub const MAX_PATCH_CELLS: usize = 1 << 16;
/// The most cells along one side of a patch.
pub const MAX_PATCH_SIDE: usize = 1 << 10;

#[cfg(test)]
mod tests;
