//! Records of the journal, and their remains after a power cut.

/// Kind of file, without its version.
const KIND: &[u8; 6] = b"scVJRN";
/// Magic bytes and version of a record.
const MAGIC: &[u8; 8] = b"scVJRN02";
const HEAD: usize = 20;
const TAIL: usize = 4;

/// Records begin at multiples of this, the size of a page and of the largest usual sector: writing a record never
/// rewrites a sector that holds a confirmed one.
pub(super) const BLOCK: usize = 4096;

static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// The reason that a file is no valid journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Damage {
    #[error("the file is of another version of scenecast; use that one, or move the file away to begin a new mission")]
    Version,
    /// Damage that no power cut causes.
    #[error("damaged at byte {offset}; restore the file, or move it away to begin a new mission")]
    At {
        /// Start of the first unreadable record, a byte offset.
        offset: usize,
    },
}

/// A record as it was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Record<'a> {
    /// One more than that of the record before it, across files.
    pub(super) sequence: u64,
    pub(super) body: &'a [u8],
}

/// The content of a journal file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Scan<'a> {
    pub(super) last: Record<'a>,
    /// Start of a record that a power cut interrupted, a byte offset.
    pub(super) torn: Option<usize>,
}

/// The bytes of a record, in whole blocks.
///
/// ```text
/// bytes 0-7     "scVJRN02"
/// bytes 8-15    sequence number, one more than that of the record before, big-endian
/// bytes 16-19   n, length of the body, big-endian
/// then n        body
/// then 4        CRC-32/ISCSI of everything before, big-endian
/// to a multiple of 4096: zero
/// ```
pub(super) fn encode(sequence: u64, body: &[u8]) -> Vec<u8> {
    let length = (body.len() as u32).to_be_bytes();
    let mut bytes = [&MAGIC[..], &sequence.to_be_bytes(), &length, body].concat();
    let crc = CRC.checksum(&bytes);
    bytes.extend_from_slice(&crc.to_be_bytes());
    bytes.resize(bytes.len().next_multiple_of(BLOCK), 0);
    bytes
}

fn decode(bytes: &[u8]) -> Option<Record<'_>> {
    let (sequence, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let length = u32::from_be_bytes(*length) as usize;
    let (body, rest) = rest.split_at_checked(length)?;
    let (crc, _) = rest.split_first_chunk::<TAIL>()?;
    let covered = bytes.get(..HEAD + length)?;
    let sound = CRC.checksum(covered) == u32::from_be_bytes(*crc);
    sound.then_some(Record { sequence: u64::from_be_bytes(*sequence), body })
}

/// Finds the last whole record of a file.
///
/// A record is written after the one before it was synced. So a power cut leaves at most the last one unreadable, and
/// never the first, which is synced before the file gets its name. Anything else is damage.
pub(super) fn scan(bytes: &[u8]) -> Result<Scan<'_>, Damage> {
    let at = |offset: usize| bytes.get(offset..).and_then(decode);
    let Some(mut last) = at(0) else {
        let other = bytes.starts_with(KIND) && !bytes.starts_with(MAGIC);
        return Err(if other { Damage::Version } else { Damage::At { offset: 0 } });
    };
    let mut offset = 0;
    loop {
        offset += (HEAD + last.body.len() + TAIL).next_multiple_of(BLOCK);
        match at(offset).filter(|next| last.sequence.checked_add(1) == Some(next.sequence)) {
            Some(next) => last = next,
            None => break,
        }
    }
    // A disk may show blocks of a file that is gone; their sequence numbers give them away.
    let follows = |offset: usize| at(offset).is_some_and(|r| r.sequence > last.sequence);
    if (offset..bytes.len()).step_by(BLOCK).any(follows) {
        return Err(Damage::At { offset });
    }
    Ok(Scan { last, torn: (offset < bytes.len()).then_some(offset) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_as_documented() {
        let bytes = encode(0x0102, b"abc");
        assert_eq!(bytes.len(), BLOCK);
        assert_eq!(bytes[..23], *b"scVJRN02\0\0\0\0\0\0\x01\x02\0\0\0\x03abc");
        assert_eq!(bytes[23..27], CRC.checksum(&bytes[..23]).to_be_bytes());
        assert!(bytes[27..].iter().all(|&b| b == 0));
    }

    #[test]
    fn damage_before_a_whole_record_is_reported_with_its_position() {
        let records: Vec<Vec<u8>> = (5..8).map(|n| encode(n, &[n as u8; 5000])).collect();
        let file = records.concat();
        let length = HEAD + 5000 + TAIL;
        for (i, expected) in
            [(0, Err(Damage::At { offset: 0 })), (1, Err(Damage::At { offset: 2 * BLOCK })), (2, Ok(6))]
        {
            for at in 0..length {
                let mut damaged = file.clone();
                damaged[i * 2 * BLOCK + at] ^= 0x10;
                let found = scan(&damaged).map(|s| s.last.sequence);
                let version = i == 0 && (KIND.len()..MAGIC.len()).contains(&at);
                assert_eq!(found, if version { Err(Damage::Version) } else { expected }, "record {i}, byte {at}");
            }
        }
    }

    #[test]
    fn a_missing_record_is_damage_but_an_old_last_block_is_not() {
        let file = |numbers: &[u64]| numbers.iter().flat_map(|&n| encode(n, b"body")).collect::<Vec<u8>>();
        assert_eq!(scan(&file(&[5, 6, 8])), Err(Damage::At { offset: 2 * BLOCK }));
        let with_old = file(&[5, 6, 3]);
        let found = scan(&with_old).unwrap();
        assert_eq!((found.last.sequence, found.torn), (6, Some(2 * BLOCK)));
    }

    #[test]
    fn an_empty_file_is_damage() {
        assert_eq!(scan(b""), Err(Damage::At { offset: 0 }));
        assert_eq!(scan(b"scVJ"), Err(Damage::At { offset: 0 }));
    }
}
