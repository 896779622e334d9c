//! Batches of events in the store's file, and their remains after a power cut.

/// Magic bytes and version of a batch's head.
const MAGIC: &[u8; 8] = b"scSURF02";
const HEAD: usize = 28;
const TAIL: usize = 4;

/// Batches begin at multiples of this, the size of a page: appending one never rewrites a sector of a synced one.
const BLOCK: usize = 4096;

static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// The readable batches of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Scan<'a> {
    pub(super) bodies: Vec<&'a [u8]>,
    /// Start of the first unreadable batch, a byte offset.
    pub(super) unreadable: Option<usize>,
    /// Intact batches follow the unreadable one, which no power cut causes.
    pub(super) is_damaged: bool,
}

#[derive(Debug, Clone, Copy)]
struct Batch<'a> {
    number: u64,
    previous: u64,
    body: &'a [u8],
}

/// The bytes of a batch, in whole blocks.
///
/// ```text
/// bytes 0-7     "scSURF02"
/// bytes 8-15    sequence number of its last event, big-endian
/// bytes 16-23   this number of the batch before it, big-endian; in the first batch of a file 0
/// bytes 24-27   n, length of the body, big-endian
/// then n        body: version of the layout (2 bytes, big-endian), then the events in postcard
/// then 4        CRC-32/ISCSI of everything before, big-endian
/// to a multiple of 4096: zero
/// ```
pub(super) fn encode(number: u64, previous: u64, body: &[u8]) -> Vec<u8> {
    let length = (body.len() as u32).to_be_bytes();
    let mut bytes = [&MAGIC[..], &number.to_be_bytes(), &previous.to_be_bytes(), &length, body].concat();
    let crc = CRC.checksum(&bytes);
    bytes.extend_from_slice(&crc.to_be_bytes());
    bytes.resize(bytes.len().next_multiple_of(BLOCK), 0);
    bytes
}

fn decode(bytes: &[u8]) -> Option<Batch<'_>> {
    let (number, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
    let (previous, rest) = rest.split_first_chunk::<8>()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let length = u32::from_be_bytes(*length) as usize;
    let (body, rest) = rest.split_at_checked(length)?;
    let (crc, _) = rest.split_first_chunk::<TAIL>()?;
    let is_sound = CRC.checksum(bytes.get(..HEAD + length)?) == u32::from_be_bytes(*crc);
    let [number, previous] = [number, previous].map(|n| u64::from_be_bytes(*n));
    is_sound.then_some(Batch { number, previous, body })
}

/// Reads the batches up to the first that is unreadable or does not follow the one before.
pub(super) fn scan(bytes: &[u8]) -> Scan<'_> {
    let at = |offset: usize| bytes.get(offset..).and_then(decode);
    let (mut bodies, mut offset, mut last) = (Vec::new(), 0, 0);
    while let Some(batch) = at(offset).filter(|batch| batch.previous == last) {
        bodies.push(batch.body);
        last = batch.number;
        offset += (HEAD + batch.body.len() + TAIL).next_multiple_of(BLOCK);
    }
    // A disk may show blocks of a file that is gone; their numbers are lower.
    let is_later = |offset: usize| at(offset).is_some_and(|batch| batch.number > last);
    let is_damaged = bodies.is_empty() && !bytes.is_empty() || (offset..bytes.len()).step_by(BLOCK).any(is_later);
    Scan { bodies, unreadable: (offset < bytes.len()).then_some(offset), is_damaged }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_as_documented() {
        let bytes = encode(0x0102, 0x0100, b"abc");
        assert_eq!(bytes.len(), BLOCK);
        assert_eq!(bytes[..31], *b"scSURF02\0\0\0\0\0\0\x01\x02\0\0\0\0\0\0\x01\0\0\0\0\x03abc");
        assert_eq!(bytes[31..35], CRC.checksum(&bytes[..31]).to_be_bytes());
        assert!(bytes[35..].iter().all(|&b| b == 0));
    }

    #[test]
    fn a_torn_end_is_left_out_and_damage_before_it_is_seen() {
        let file = [encode(5, 0, &[1; 5000]), encode(7, 5, &[2; 9]), encode(9, 7, &[3; 9])].concat();
        let whole = scan(&file);
        assert_eq!((whole.bodies.len(), whole.unreadable, whole.is_damaged), (3, None, false));
        let torn = scan(&file[..file.len() - BLOCK + 20]);
        assert_eq!((torn.bodies.len(), torn.unreadable, torn.is_damaged), (2, Some(3 * BLOCK), false));
        for (at, bodies) in [(100, 0), (2 * BLOCK + 29, 1)] {
            let mut damaged = file.clone();
            damaged[at] ^= 1;
            let found = scan(&damaged);
            assert_eq!((found.bodies.len(), found.is_damaged), (bodies, true), "byte {at}");
        }
        let missing = [encode(5, 0, b"a"), encode(9, 7, b"c")].concat();
        assert!(scan(&missing).is_damaged, "a batch is missing");
        let old = [encode(5, 0, b"a"), encode(4, 3, b"z")].concat();
        assert_eq!((scan(&old).bodies.len(), scan(&old).is_damaged), (1, false), "a block of a file that is gone");
    }
}
