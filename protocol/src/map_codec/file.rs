//! A file of chunks that turn one map into another.

use super::{Codec, DecodeError, LabelRaster, decode, encode_all};
use crate::grid::Rect;
use crc::{CRC_32_ISO_HDLC, Crc};

/// The chunks of one change, in order, and the size of the map that they apply to.
///
/// ```text
///      +--------+------------+-----------+------------+----------+-----------+------------------+---------+
///      | "SCMC" | version u8 | width u32 | height u32 | base u32 | count u32 | count x          | sum u32 |
///      |        |            |           |            |          |           | (length u16, ..) |         |
///      +--------+------------+-----------+------------+----------+-----------+------------------+---------+
/// ```
/// Little-endian; version 1. base: CRC-32 (as in PNG) of the base's labels, row by row, zeros if there is no base;
/// sum: CRC-32 of everything before. A map has 1 to 2^26 cells.
///
/// ```
/// use scenecast_protocol::map_codec::{ChunkFile, Codec, LabelRaster};
///
/// let base = LabelRaster::uniform(40, 30, 1);
/// let mut target = base.clone();
/// target.set(5, 6, 2);
/// let (file, changed) = ChunkFile::encode(Codec::Auto, &base, &target, 100)?;
/// assert_eq!(changed, 1);
/// let read = ChunkFile::from_bytes(&file.to_bytes())?;
/// assert_eq!(read.apply(Some(&base))?, target);
/// # Ok::<(), scenecast_protocol::map_codec::ChunkFileError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkFile {
    /// Width of the map in cells.
    pub width: u32,
    /// Height of the map in cells.
    pub height: u32,
    /// CRC-32 of the base's labels.
    pub base: u32,
    /// The bytes of each chunk, in the order of application.
    pub chunks: Vec<Vec<u8>>,
}

/// Why a file of chunks cannot be made or used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChunkFileError {
    /// It does not begin with the magic.
    #[error("not a file of map chunks")]
    NotChunks,
    /// It was written by another version.
    #[error("file version {0}; this program reads version {VERSION}")]
    Version(u8),
    /// It ends early or has bytes after the last chunk.
    #[error("the file of map chunks is cut off or has bytes after its end")]
    Length,
    /// The checksum at the end does not match.
    #[error("the file of map chunks is damaged: its sum is wrong")]
    Damaged,
    /// The map has no cell, or more than 2^26.
    #[error("a map of {0} x {1} cells; 1 to {MAX_CELLS} cells are allowed")]
    CellCount(u32, u32),
    /// The base is not the encoder's.
    #[error("the chunks need the base map that they were made with")]
    OtherBase,
    /// Base and target, or base and file, differ in size.
    #[error("the base map is {base_width} x {base_height}, the other {width} x {height}")]
    Size {
        /// Width of the base in cells.
        base_width: usize,
        /// Height of the base in cells.
        base_height: usize,
        /// Width of the other map in cells.
        width: usize,
        /// Height of the other map in cells.
        height: usize,
    },
    /// Not even one cell fits into the room.
    #[error("a chunk of {0} bytes holds no cell")]
    Room(usize),
    /// A chunk does not decode against the base.
    #[error("chunk {index}: {error}")]
    Chunk {
        /// Index of the chunk, from 0.
        index: usize,
        /// The reason of the refusal.
        error: DecodeError,
    },
    /// A chunk changes cells outside the map.
    #[error("chunk {0} changes cells outside the map")]
    Outside(usize),
}

const MAGIC: [u8; 4] = *b"SCMC";
const VERSION: u8 = 1;
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
/// Cells of the largest map that a file may describe.
const MAX_CELLS: u64 = 1 << 26;

impl ChunkFile {
    /// The chunks of at most `room` bytes that turn `base` into `target`, and the number of cells that they change.
    pub fn encode(
        codec: Codec,
        base: &LabelRaster,
        target: &LabelRaster,
        room: usize,
    ) -> Result<(Self, usize), ChunkFileError> {
        same_size(base, target.width, target.height)?;
        let size = allowed_size(target.width as u32, target.height as u32)?;
        let chunks = encode_all(codec, &base.to_grid(), &target.to_grid(), room.min(usize::from(u16::MAX)));
        let chunks = chunks.ok_or(ChunkFileError::Room(room))?;
        let changed = chunks.iter().map(|chunk| chunk.changes.len()).sum();
        let chunks = chunks.into_iter().map(|chunk| chunk.bytes).collect();
        Ok((Self { width: size.0, height: size.1, base: CRC.checksum(&base.labels), chunks }, changed))
    }

    /// Applies the chunks to `base`; without one, to an unexplored map.
    pub fn apply(&self, base: Option<&LabelRaster>) -> Result<LabelRaster, ChunkFileError> {
        let (width, height) = (self.width as usize, self.height as usize);
        if let Some(base) = base {
            same_size(base, width, height)?;
        }
        let nothing = LabelRaster::uniform(width, height, 0);
        let base = base.unwrap_or(&nothing);
        if CRC.checksum(&base.labels) != self.base {
            return Err(ChunkFileError::OtherBase);
        }
        let base = base.to_grid();
        let bounds = Rect { x: 0, y: 0, width: self.width, height: self.height };
        let mut map = base.clone();
        for (index, chunk) in self.chunks.iter().enumerate() {
            let changes = decode(&base, chunk).map_err(|error| ChunkFileError::Chunk { index, error })?;
            if !changes.iter().all(|&(cell, _)| bounds.contains(cell)) {
                return Err(ChunkFileError::Outside(index));
            }
            for (cell, label) in changes {
                map.set(cell, label);
            }
        }
        Ok(LabelRaster::from_grid(&map, width, height))
    }

    /// Encodes the file with its checksum at the end.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::from(MAGIC);
        out.push(VERSION);
        for number in [self.width, self.height, self.base, self.chunks.len() as u32] {
            out.extend(number.to_le_bytes());
        }
        for chunk in &self.chunks {
            out.extend((chunk.len() as u16).to_le_bytes());
            out.extend(chunk);
        }
        out.extend(CRC.checksum(&out).to_le_bytes());
        out
    }

    /// Decodes a file; its chunks are not decoded yet.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ChunkFileError> {
        let (magic, rest) = bytes.split_first_chunk::<4>().ok_or(ChunkFileError::NotChunks)?;
        if *magic != MAGIC {
            return Err(ChunkFileError::NotChunks);
        }
        let (&version, rest) = rest.split_first().ok_or(ChunkFileError::Length)?;
        if version != VERSION {
            return Err(ChunkFileError::Version(version));
        }
        let mut reader = FileReader(rest);
        let (width, height) = allowed_size(reader.number()?, reader.number()?)?;
        let (base, count) = (reader.number()?, reader.number()?);
        let chunks = (0..count).map(|_| reader.chunk()).collect::<Result<_, _>>()?;
        let sum = reader.number()?;
        if !reader.0.is_empty() {
            return Err(ChunkFileError::Length);
        }
        let summed = bytes.get(..bytes.len() - 4).unwrap_or_default();
        if CRC.checksum(summed) == sum {
            Ok(Self { width, height, base, chunks })
        } else {
            Err(ChunkFileError::Damaged)
        }
    }
}

struct FileReader<'a>(&'a [u8]);

impl FileReader<'_> {
    fn number(&mut self) -> Result<u32, ChunkFileError> {
        let (number, rest) = self.0.split_first_chunk().ok_or(ChunkFileError::Length)?;
        self.0 = rest;
        Ok(u32::from_le_bytes(*number))
    }

    fn chunk(&mut self) -> Result<Vec<u8>, ChunkFileError> {
        let (length, rest) = self.0.split_first_chunk().ok_or(ChunkFileError::Length)?;
        let length = usize::from(u16::from_le_bytes(*length));
        let (chunk, rest) = rest.split_at_checked(length).ok_or(ChunkFileError::Length)?;
        self.0 = rest;
        Ok(chunk.to_vec())
    }
}

fn allowed_size(width: u32, height: u32) -> Result<(u32, u32), ChunkFileError> {
    let cells = u64::from(width) * u64::from(height);
    if (1..=MAX_CELLS).contains(&cells) { Ok((width, height)) } else { Err(ChunkFileError::CellCount(width, height)) }
}

fn same_size(base: &LabelRaster, width: usize, height: usize) -> Result<(), ChunkFileError> {
    let (base_width, base_height) = (base.width, base.height);
    if (base_width, base_height) == (width, height) {
        Ok(())
    } else {
        Err(ChunkFileError::Size { base_width, base_height, width, height })
    }
}
