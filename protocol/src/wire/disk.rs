//! The state of the vehicle's disk, in its report.

use crate::bytes::{Reader, Truncated};

/// Whether the vehicle's files can be written, and the free space of its disk.
///
/// ```text
/// bits  field                      range
///  1    reserved                   0
///  1    the journal is refused     the vehicle keeps no new order and no new label
///  1    the checkpoint is refused  a restart loses the latest part of the scene model
///  5    free space                 0 unknown, 1 less than 1 MB, n at least 2^(n - 2) MB of 2^20 bytes
/// ```
///
/// Source: vehicle, in the last byte of a report. A vehicle without files has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DiskReport {
    /// Whether the last state was not written to the journal.
    pub journal_refused: bool,
    /// Whether the last checkpoint of the scene model was not written.
    pub checkpoint_refused: bool,
    /// Free space in bytes; `None` if it is unknown. On the wire it is rounded down to a power of two of at least 2^20
    /// bytes, or to 0.
    pub free_bytes: Option<u64>,
}

impl DiskReport {
    const RESERVED: u8 = 0x80;
    const JOURNAL: u8 = 0x40;
    const CHECKPOINT: u8 = 0x20;
    /// The free space, and its largest value.
    const FREE: u8 = 0x1F;

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        let flag = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
        let free = self.free_bytes.map_or(0, |bytes| match (bytes >> 20).checked_ilog2() {
            Some(log) => (log + 2).min(u32::from(Self::FREE)) as u8,
            None => 1,
        });
        out.push(flag(self.journal_refused, Self::JOURNAL) | flag(self.checkpoint_refused, Self::CHECKPOINT) | free);
    }

    /// `None` stands for a reserved bit, which no vehicle sets.
    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let byte = r.u8()?;
        let free_bytes = match byte & Self::FREE {
            0 => None,
            1 => Some(0),
            n => Some(1 << (18 + n)),
        };
        let (journal_refused, checkpoint_refused) = (byte & Self::JOURNAL != 0, byte & Self::CHECKPOINT != 0);
        Ok((byte & Self::RESERVED == 0).then_some(Self { journal_refused, checkpoint_refused, free_bytes }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coded(disk: DiskReport) -> u8 {
        let mut bytes = Vec::new();
        disk.encode(&mut bytes);
        bytes[0]
    }

    #[test]
    fn golden_bytes_of_a_disk() {
        let disk = |journal_refused, checkpoint_refused, free_bytes| {
            coded(DiskReport { journal_refused, checkpoint_refused, free_bytes })
        };
        assert_eq!(disk(false, false, None), 0);
        assert_eq!(disk(true, false, Some(0)), 0x41);
        assert_eq!(disk(false, true, Some((1 << 20) - 1)), 0x21);
        assert_eq!(disk(true, true, Some(1 << 20)), 0x62);
        assert_eq!(disk(false, false, Some(40_000_000_000)), 0x11);
        assert_eq!(disk(false, false, Some(u64::MAX)), 0x1F);
    }

    #[test]
    fn every_byte_without_the_reserved_bit_is_a_state_of_a_disk() {
        for byte in 0..=255 {
            let read = DiskReport::decode(&mut Reader::new(&[byte])).unwrap();
            assert_eq!(read.map(coded), (byte < 0x80).then_some(byte));
        }
        let space = |byte: u8| DiskReport::decode(&mut Reader::new(&[byte])).unwrap().unwrap().free_bytes;
        assert_eq!([0, 1, 2, 11, 31].map(space), [None, Some(0), Some(1 << 20), Some(512 << 20), Some(1 << 49)]);
    }
}
