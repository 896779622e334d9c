//! Frames with any body, sealed as a true sender seals sound ones.

use crc::{CRC_24_OPENPGP, CRC_32_ISCSI, Crc};
use scenecast_protocol::wire::{FrameBuilder, Header, MissionId, Seal};

/// The bytes of a header with its acknowledgement statement.
pub fn head(header: &Header) -> Vec<u8> {
    let builder = FrameBuilder::new(header, 4096);
    let len = builder.len(true);
    let mut bytes = builder.finish(&Seal::Crc(MissionId(0), 0), true);
    bytes.truncate(len - Seal::bytes(header.keyed, len));
    bytes
}

/// Closes a frame with the CRC for a mission and the receiver's session.
pub fn close_with_crc(frame: &mut Vec<u8>, mission: MissionId, session: u16) {
    let short = frame.len() + 3 < 128;
    let crc = Crc::<u32>::new(if short { &CRC_24_OPENPGP } else { &CRC_32_ISCSI });
    let mut digest = crc.digest();
    digest.update(&mission.0.to_be_bytes());
    digest.update(&session.to_be_bytes());
    digest.update(frame);
    frame.extend_from_slice(&digest.finalize().to_be_bytes()[usize::from(short)..]);
}

/// A reader of instructions that yields zeros past the end.
pub struct Script<'a>(pub &'a [u8]);

impl<'a> Script<'a> {
    pub fn is_over(&self) -> bool {
        self.0.is_empty()
    }

    pub fn u8(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_be_bytes([self.u8(), self.u8()])
    }

    /// A length in one byte, and as many bytes, or the rest.
    pub fn bytes(&mut self) -> &'a [u8] {
        let length = usize::from(self.u8()).min(self.0.len());
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        bytes
    }
}
