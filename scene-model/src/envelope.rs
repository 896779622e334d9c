//! The envelope of stored files: a magic, a version, a length and a CRC around the content.
//!
//! ```text
//!  0        8         12         20                     20 + n    24 + n
//!  | magic  | version | length n | content              | CRC-32  |
//! ```
//!
//! All numbers are little-endian. The CRC (CRC-32/ISO-HDLC) covers all bytes before it.

const HEADER: usize = 20;
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// One kind of stored file.
///
/// ```
/// use scene_model::envelope::{Envelope, EnvelopeError};
///
/// const SURVEY: Envelope = Envelope { magic: *b"MYSURVEY", version: 1 };
///
/// let mut bytes = SURVEY.seal(b"content");
/// assert_eq!(SURVEY.open(&bytes), Ok(&b"content"[..]));
/// bytes[22] ^= 1;
/// assert_eq!(SURVEY.open(&bytes), Err(EnvelopeError::Damaged));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Envelope {
    /// The first eight bytes of the file.
    pub magic: [u8; 8],
    /// The version to write, and the only one that is accepted.
    pub version: u32,
}

/// The bytes are of another kind, of another version, or damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvelopeError {
    /// The bytes begin with another magic.
    #[error("a file of another kind")]
    Foreign,
    /// The magic is right, but the version differs.
    #[error("version {found}, this program reads version {wanted}")]
    Version {
        /// The version of the bytes.
        found: u32,
        /// The version that is accepted.
        wanted: u32,
    },
    /// The length or the checksum is wrong.
    #[error("cut off or damaged")]
    Damaged,
}

impl Envelope {
    /// Returns the content in its envelope.
    #[must_use]
    pub fn seal(&self, content: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + content.len() + 4);
        bytes.extend(self.magic);
        bytes.extend(self.version.to_le_bytes());
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(content);
        bytes.extend(CRC.checksum(&bytes).to_le_bytes());
        bytes
    }

    /// Returns the content of bytes that [`Envelope::seal`] returned.
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
    fn only_intact_bytes_of_the_right_kind_are_opened() {
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
