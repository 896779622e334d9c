//! Records of the journal.

/// Kind of file, without its version.
const KIND: &[u8; 6] = b"scVJRN";
/// Magic bytes and version of a record.
const MAGIC: &[u8; 8] = b"scVJRN06";
const HEAD: usize = 21;
const TAIL: usize = 4;

/// Length of each file of the journal, bytes. All of it is written when the file is created, so
/// that later records need no free space.
pub(super) const FILE_BYTES: usize = 16 * 1024;
/// Maximum length of a state, bytes.
pub(super) const MAX_BODY_BYTES: usize = FILE_BYTES - HEAD - TAIL;

static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// The reason that a file of the journal, or the journal, is not as a run or a power cut leaves it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Damage {
    #[error("it is missing, and other files show that there was one")]
    Missing,
    #[error("it is {bytes} bytes long instead of {FILE_BYTES}")]
    Length { bytes: usize },
    #[error("its content is damaged")]
    Content,
    #[error("it is of another version of scenecast")]
    Version,
    #[error("it is older than its copy")]
    Older,
    #[error("it cannot be read: {0}")]
    Unreadable(String),
}

/// The content of one file of the journal.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum RecordContent {
    Absent,
    Sound(Record),
    /// A file of the right length without a readable record. A power cut while it was written leaves this too.
    Torn,
    /// No power cut leaves this.
    Damaged(Damage),
}

impl RecordContent {
    pub(super) fn record(&self) -> Option<&Record> {
        match self {
            Self::Sound(record) => Some(record),
            Self::Absent | Self::Torn | Self::Damaged(_) => None,
        }
    }
}

/// A record as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Record {
    /// One more than that of the record before it, across files and runs.
    pub(super) sequence: u64,
    pub(super) body: Vec<u8>,
}

/// The bytes of a file: one record, and zeros up to the length of the file. `None` if the state is too long.
///
/// ```text
/// bytes 0-7     "scVJRN06"
/// byte  8       number of the file: 0 for vehicle.journal, 1 for its copy
/// bytes 9-16    sequence number, big-endian
/// bytes 17-20   n, length of the body, big-endian
/// then n        body
/// then 4        CRC-32/ISCSI of everything before, big-endian
/// to 16384      zero
/// ```
pub(super) fn encode(number: u8, record: &Record) -> Option<Vec<u8>> {
    let Record { sequence, body } = record;
    let length = u32::try_from(body.len()).ok().filter(|_| body.len() <= MAX_BODY_BYTES)?;
    let mut bytes = [&MAGIC[..], &[number], &sequence.to_be_bytes(), &length.to_be_bytes(), body].concat();
    let crc = CRC.checksum(&bytes);
    bytes.extend_from_slice(&crc.to_be_bytes());
    bytes.resize(FILE_BYTES, 0);
    Some(bytes)
}

/// Reads the file with this number.
///
/// A record counts only at its place, in a file of the exact length and of its own number. So a truncated, extended or
/// shifted file, and one in the place of another, is never read as an older state.
pub(super) fn read(number: u8, bytes: &[u8]) -> RecordContent {
    if bytes.len() != FILE_BYTES {
        return RecordContent::Damaged(Damage::Length { bytes: bytes.len() });
    }
    match decode(number, bytes) {
        Some(record) => RecordContent::Sound(record),
        // Every version up to now has two digits.
        None if is_other_version(bytes) => RecordContent::Damaged(Damage::Version),
        None => RecordContent::Torn,
    }
}

fn is_other_version(bytes: &[u8]) -> bool {
    let version = bytes.strip_prefix(KIND).and_then(|rest| rest.first_chunk::<2>());
    version.is_some_and(|v| v.iter().all(u8::is_ascii_digit)) && !bytes.starts_with(MAGIC)
}

fn decode(number: u8, bytes: &[u8]) -> Option<Record> {
    let rest = bytes.strip_prefix(MAGIC)?.strip_prefix(&[number])?;
    let (sequence, rest) = rest.split_first_chunk::<8>()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let length = u32::from_be_bytes(*length) as usize;
    let (body, rest) = rest.split_at_checked(length)?;
    let (crc, _) = rest.split_first_chunk::<TAIL>()?;
    let covered = bytes.get(..HEAD + length)?;
    let sound = CRC.checksum(covered) == u32::from_be_bytes(*crc);
    sound.then(|| Record { sequence: u64::from_be_bytes(*sequence), body: body.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(sequence: u64, body: &[u8]) -> Record {
        Record { sequence, body: body.to_vec() }
    }

    #[test]
    fn the_layout_is_as_documented() {
        let bytes = encode(1, &record(0x0102, b"abc")).unwrap();
        assert_eq!(bytes.len(), FILE_BYTES);
        assert_eq!(bytes[..24], *b"scVJRN06\x01\0\0\0\0\0\0\x01\x02\0\0\0\x03abc");
        assert_eq!(bytes[24..28], CRC.checksum(&bytes[..24]).to_be_bytes());
        assert!(bytes[28..].iter().all(|&b| b == 0));
        assert_eq!(read(1, &bytes), RecordContent::Sound(record(0x0102, b"abc")));
        assert_eq!(read(0, &bytes), RecordContent::Torn, "the copy in the place of the journal");
    }

    #[test]
    fn a_state_fills_at_most_the_file() {
        assert_eq!(encode(0, &record(1, &[7; MAX_BODY_BYTES])).map(|bytes| bytes.len()), Some(FILE_BYTES));
        assert_eq!(encode(0, &record(1, &[7; MAX_BODY_BYTES + 1])), None);
    }

    #[test]
    fn a_record_with_a_changed_bit_is_not_read() {
        let bytes = encode(0, &record(7, &[3; 500])).unwrap();
        for (at, bit) in (0..HEAD + 500 + TAIL).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            assert!(!matches!(read(0, &damaged), RecordContent::Sound(_)), "byte {at}, bit {bit}");
        }
    }

    #[test]
    fn other_files_are_no_journal() {
        assert_eq!(read(0, b""), RecordContent::Damaged(Damage::Length { bytes: 0 }));
        assert_eq!(read(0, &[0; FILE_BYTES]), RecordContent::Torn);
        for version in [b'3', b'9'] {
            let mut other = encode(0, &record(1, b"state")).unwrap();
            other[7] = version;
            let crc = CRC.checksum(&other[..26]).to_be_bytes();
            other[26..30].copy_from_slice(&crc);
            assert_eq!(read(0, &other), RecordContent::Damaged(Damage::Version));
        }
    }
}
