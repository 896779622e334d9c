//! Records of the journal: the present layout, and the one of earlier builds, which is only read.

/// Kind of file, without its version.
const KIND: &[u8; 6] = b"scVJRN";
/// Magic bytes and version of a record.
const MAGIC: &[u8; 8] = b"scVJRN04";
/// Those of the version before, which differs in the body only.
const MAGIC_OF_EIGHT_SLOTS: &[u8; 8] = b"scVJRN03";
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
    /// A record of this build.
    Sound(Record),
    /// The last record of a file of an earlier build.
    Earlier(Record),
    /// A file of the right length without a readable record. A power cut while it was written leaves this too.
    Torn,
    /// No power cut leaves this.
    Damaged(Damage),
}

impl RecordContent {
    pub(super) fn record(&self) -> Option<&Record> {
        match self {
            Self::Sound(record) | Self::Earlier(record) => Some(record),
            Self::Absent | Self::Torn | Self::Damaged(_) => None,
        }
    }
}

/// The layout of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BodyLayout {
    /// Version 2: eight slots, and no lost orders.
    WithoutLostOrders,
    /// Version 3: eight slots.
    EightSlots,
    Present,
}

/// A record as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Record {
    /// One more than that of the record before it, across files and runs.
    pub(super) sequence: u64,
    pub(super) layout: BodyLayout,
    pub(super) body: Vec<u8>,
}

/// The bytes of a file: one record, and zeros up to the length of the file. `None` if the state is too long.
///
/// ```text
/// bytes 0-7     "scVJRN04"
/// byte  8       number of the file: 0 for vehicle.journal, 1 for its copy
/// bytes 9-16    sequence number, big-endian
/// bytes 17-20   n, length of the body, big-endian
/// then n        body
/// then 4        CRC-32/ISCSI of everything before, big-endian
/// to 16384      zero
/// ```
pub(super) fn encode(number: u8, record: &Record) -> Option<Vec<u8>> {
    let Record { sequence, body, .. } = record;
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
    if bytes.starts_with(earlier::MAGIC) {
        return earlier::read(bytes).map_or(RecordContent::Damaged(Damage::Content), RecordContent::Earlier);
    }
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
    version.is_some_and(|v| v.iter().all(u8::is_ascii_digit) && body_layout(bytes).is_none())
}

/// The layout of the body in a file of a fixed length.
fn body_layout(bytes: &[u8]) -> Option<BodyLayout> {
    let layouts = [(MAGIC, BodyLayout::Present), (MAGIC_OF_EIGHT_SLOTS, BodyLayout::EightSlots)];
    layouts.into_iter().find(|(magic, _)| bytes.starts_with(*magic)).map(|(_, layout)| layout)
}

fn decode(number: u8, bytes: &[u8]) -> Option<Record> {
    let layout = body_layout(bytes)?;
    let rest = bytes.get(MAGIC.len()..)?.strip_prefix(&[number])?;
    let (sequence, rest) = rest.split_first_chunk::<8>()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let length = u32::from_be_bytes(*length) as usize;
    let (body, rest) = rest.split_at_checked(length)?;
    let (crc, _) = rest.split_first_chunk::<TAIL>()?;
    let covered = bytes.get(..HEAD + length)?;
    let sound = CRC.checksum(covered) == u32::from_be_bytes(*crc);
    sound.then(|| Record { sequence: u64::from_be_bytes(*sequence), layout, body: body.to_vec() })
}

/// The layout of earlier builds: a growing file of records at multiples of 4096 bytes, the last of which is valid.
pub(super) mod earlier {
    use super::{BodyLayout, CRC, Record, TAIL};

    pub(super) const MAGIC: &[u8; 8] = b"scVJRN02";
    const HEAD: usize = 20;
    const BLOCK: usize = 4096;

    fn decode(bytes: &[u8]) -> Option<Record> {
        let (sequence, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
        let (length, rest) = rest.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let (body, rest) = rest.split_at_checked(length)?;
        let (crc, _) = rest.split_first_chunk::<TAIL>()?;
        let covered = bytes.get(..HEAD + length)?;
        let sound = CRC.checksum(covered) == u32::from_be_bytes(*crc);
        let layout = BodyLayout::WithoutLostOrders;
        sound.then(|| Record { sequence: u64::from_be_bytes(*sequence), layout, body: body.to_vec() })
    }

    /// The last whole record; `None` if there is none, or if an unreadable one precedes an intact one.
    pub(super) fn read(bytes: &[u8]) -> Option<Record> {
        let at = |offset: usize| bytes.get(offset..).and_then(decode);
        let mut last = at(0)?;
        let mut offset = 0;
        loop {
            offset += (HEAD + last.body.len() + TAIL).next_multiple_of(BLOCK);
            match at(offset).filter(|next| last.sequence.checked_add(1) == Some(next.sequence)) {
                Some(next) => last = next,
                None => break,
            }
        }
        let follows = |offset: usize| at(offset).is_some_and(|r| r.sequence > last.sequence);
        (!(offset..bytes.len()).step_by(BLOCK).any(follows)).then_some(last)
    }

    /// The bytes of a record, in whole blocks, as earlier builds wrote them.
    #[cfg(test)]
    pub(in super::super) fn encode(sequence: u64, body: &[u8]) -> Vec<u8> {
        let length = (body.len() as u32).to_be_bytes();
        let mut bytes = [&MAGIC[..], &sequence.to_be_bytes(), &length, body].concat();
        let crc = CRC.checksum(&bytes);
        bytes.extend_from_slice(&crc.to_be_bytes());
        bytes.resize(bytes.len().next_multiple_of(BLOCK), 0);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(sequence: u64, body: &[u8]) -> Record {
        Record { sequence, layout: BodyLayout::Present, body: body.to_vec() }
    }

    #[test]
    fn a_record_of_the_version_before_is_read() {
        let mut bytes = encode(1, &record(0x0102, b"abc")).unwrap();
        bytes[7] = b'3';
        let crc = CRC.checksum(&bytes[..24]).to_be_bytes();
        bytes[24..28].copy_from_slice(&crc);
        let before = Record { layout: BodyLayout::EightSlots, ..record(0x0102, b"abc") };
        assert_eq!(read(1, &bytes), RecordContent::Sound(before));
    }

    #[test]
    fn the_layout_is_as_documented() {
        let bytes = encode(1, &record(0x0102, b"abc")).unwrap();
        assert_eq!(bytes.len(), FILE_BYTES);
        assert_eq!(bytes[..24], *b"scVJRN04\x01\0\0\0\0\0\0\x01\x02\0\0\0\x03abc");
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
            assert!(
                !matches!(read(0, &damaged), RecordContent::Sound(_) | RecordContent::Earlier(_)),
                "byte {at}, bit {bit}"
            );
        }
    }

    #[test]
    fn the_last_record_of_an_earlier_build_is_read() {
        let file = |numbers: &[u64]| numbers.iter().flat_map(|&n| earlier::encode(n, &[n as u8; 5000])).collect();
        let layout = BodyLayout::WithoutLostOrders;
        let last =
            |sequence: u64| RecordContent::Earlier(Record { sequence, layout, body: vec![sequence as u8; 5000] });
        let whole: Vec<u8> = file(&[5, 6, 7]);
        assert_eq!(read(0, &whole), last(7));
        assert_eq!(read(0, &whole[..whole.len() - 8192]), last(6), "this layout does not show a lost end");
        assert_eq!(read(0, &whole[..20_000]), last(6), "a power cut leaves a record without its end");
        let missing: Vec<u8> = file(&[5, 6, 8]);
        assert_eq!(read(0, &missing), RecordContent::Damaged(Damage::Content));
    }

    #[test]
    fn other_files_are_no_journal() {
        assert_eq!(read(0, b""), RecordContent::Damaged(Damage::Length { bytes: 0 }));
        assert_eq!(read(0, &[0; FILE_BYTES]), RecordContent::Torn);
        let mut later = encode(0, &record(1, b"state")).unwrap();
        later[7] = b'9';
        assert_eq!(read(0, &later), RecordContent::Damaged(Damage::Version));
    }
}
