//! What is kept in files: a magic, a version, a length and a CRC around the content.
//!
//! ```text
//!  0        8         12         20                     20 + n    24 + n
//!  | magic  | version | length n | content              | CRC-32  |
//! ```
//! All numbers are little-endian; the CRC (ISO HDLC) covers everything before it.

const HEADER: usize = 20;
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// One kind of kept bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Envelope {
    /// How its bytes begin.
    pub magic: [u8; 8],
    /// The version that is written, and the only one that is read.
    pub version: u32,
}

/// Why bytes are not of a kind, or not whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EnvelopeError {
    /// They begin otherwise.
    #[error("a file of another kind")]
    Foreign,
    /// Right kind, other version.
    #[error("version {found}, this program reads version {wanted}")]
    Version {
        /// Version of the bytes.
        found: u32,
        /// Version that is read.
        wanted: u32,
    },
    /// The length or the checksum is wrong.
    #[error("cut off or damaged")]
    Damaged,
}

impl Envelope {
    /// Closes content.
    pub fn seal(&self, content: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + content.len() + 4);
        bytes.extend(self.magic);
        bytes.extend(self.version.to_le_bytes());
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(content);
        bytes.extend(CRC.checksum(&bytes).to_le_bytes());
        bytes
    }

    /// The content of bytes that [`Envelope::seal`] closed.
    pub fn open<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], EnvelopeError> {
        let rest = bytes.strip_prefix(&self.magic).ok_or(EnvelopeError::Foreign)?;
        let (version, rest) = rest.split_first_chunk::<4>().ok_or(EnvelopeError::Damaged)?;
        let found = u32::from_le_bytes(*version);
        if found != self.version {
            return Err(EnvelopeError::Version { found, wanted: self.version });
        }
        let (length, rest) = rest.split_first_chunk::<8>().ok_or(EnvelopeError::Damaged)?;
        let (content, sum) = rest.split_last_chunk::<4>().ok_or(EnvelopeError::Damaged)?;
        let covered = &bytes[..bytes.len() - sum.len()];
        let is_whole = u64::from_le_bytes(*length) == content.len() as u64;
        let is_sound = is_whole && u32::from_le_bytes(*sum) == CRC.checksum(covered);
        is_sound.then_some(content).ok_or(EnvelopeError::Damaged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: Envelope = Envelope { magic: *b"SCNTESTS", version: 3 };

    #[test]
    fn content_comes_back_and_everything_else_is_refused_by_name() {
        let bytes = KIND.seal(b"content");
        assert_eq!(KIND.open(&bytes), Ok(&b"content"[..]));
        assert_eq!(KIND.open(b"PNG"), Err(EnvelopeError::Foreign));
        let newer = Envelope { version: 4, ..KIND }.seal(b"content");
        assert_eq!(KIND.open(&newer), Err(EnvelopeError::Version { found: 4, wanted: 3 }));
        for length in 8..bytes.len() {
            assert_eq!(KIND.open(&bytes[..length]), Err(EnvelopeError::Damaged), "{length} bytes");
        }
        for at in 12..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert_eq!(KIND.open(&damaged), Err(EnvelopeError::Damaged), "byte {at}");
        }
    }
}
