//! The bytes of a message: the header of RTPS for plain CDR, and CDR.
//!
//! ```text
//!  byte 0   1         2   3        4 ...
//! +-------+---------+------------+------------------------------------------+
//! | 0     | 0 or 1  | options    | fields in order, each aligned to its size |
//! +-------+---------+------------+------------------------------------------+
//!           byte order: 1 little-endian, 0 big-endian; alignment counts from byte 4
//! ```
//!
//! Source: OMG DDSI-RTPS 2.5, section 10; OMG CORBA 3.3 part 2, section 9.3.

use crate::message::Message;
use byteorder::{BigEndian, LittleEndian};

/// The header that [`encode`] writes.
const HEADER: [u8; 4] = [0, 1, 0, 0];
/// Bytes after the last field at most: DDS pads to a multiple of 4.
const MAX_PADDING: usize = 3;

/// The bytes are not a message of the expected type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    #[error("{0} bytes are fewer than the 4 of the header")]
    NoHeader(usize),
    #[error("the encoding {0:02x} {1:02x} is not plain CDR (00 00 or 00 01)")]
    Encoding(u8, u8),
    #[error("{0}")]
    Body(String),
    #[error("{0} bytes follow the last field")]
    Trailing(usize),
}

/// The little-endian CDR of a message, with its header of 4 bytes.
pub fn encode<M: Message>(message: &M) -> Vec<u8> {
    let mut bytes = HEADER.to_vec();
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, message).expect("a Vec takes any bytes");
    bytes
}

/// Reads a message from CDR of either byte order.
///
/// No length is trusted: strings and bytes are checked against the remaining bytes before they are copied, and sequences grow
/// with the elements that were read.
pub fn decode<M: Message>(bytes: &[u8]) -> Result<M, CdrError> {
    let (header, body) = bytes.split_first_chunk::<4>().ok_or(CdrError::NoHeader(bytes.len()))?;
    let read = match header[..2] {
        [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        _ => return Err(CdrError::Encoding(header[0], header[1])),
    };
    let (message, used) = read.map_err(|e| CdrError::Body(e.to_string()))?;
    match body.len().saturating_sub(used) {
        0..=MAX_PADDING => Ok(message),
        trailing => Err(CdrError::Trailing(trailing)),
    }
}
