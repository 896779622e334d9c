//! Objects larger than a frame: sent in byte ranges, repaired by what is missing.

mod receiver;
mod sender;

pub use receiver::{ObjectReceiver, Received};
pub use sender::ObjectSender;

pub type SymbolRun = std::ops::Range<usize>;
use crate::wire::{Reader, Truncated};

/// Largest object in bytes.
pub const MAX_OBJECT: usize = 16 * 1024;

/// Names an object within the sender's session; wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u8);

/// A range of an object's bytes.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---------------+-------------------------------+----------------
/// | object        | length of the object, 1..=16384 | offset
/// +---------------+-------------------------------+----------------
///   offset, 2 bytes | data ...
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part<'a> {
    /// Which object.
    pub id: ObjectId,
    /// Length of the whole object in bytes.
    pub total: u16,
    /// Where `data` begins.
    pub offset: u16,
    /// The bytes.
    pub data: &'a [u8],
}

impl<'a> Part<'a> {
    /// Bytes before the data.
    pub const HEADER: usize = 5;

    /// The bytes on the wire.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(Self::HEADER + self.data.len());
        out.push(self.id.0);
        out.extend_from_slice(&self.total.to_be_bytes());
        out.extend_from_slice(&self.offset.to_be_bytes());
        out.extend_from_slice(self.data);
        out
    }

    /// Reads a part; the range lies within an object of at most [`MAX_OBJECT`] bytes.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, Truncated> {
        let mut r = Reader::new(bytes);
        let part = Self { id: ObjectId(r.u8()?), total: r.u16()?, offset: r.u16()?, data: r.rest() };
        let end = usize::from(part.offset) + part.data.len();
        let sound = usize::from(part.total) <= MAX_OBJECT && end <= usize::from(part.total) && !part.data.is_empty();
        if sound { Ok(part) } else { Err(Truncated) }
    }
}
