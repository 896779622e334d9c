//! Frames with any body, sealed as a true sender seals sound ones.

use crc::{CRC_24_OPENPGP, CRC_32_ISCSI, Crc};
use scenecast_protocol::wire::{FrameBuilder, Header, MissionId, Seal, SessionId};

/// The bytes of a header with its acknowledgement statement.
pub fn head(header: &Header) -> Vec<u8> {
    let builder = FrameBuilder::new(header, 4096);
    let len = builder.len(true);
    let mut bytes = builder.finish(&Seal::Crc(MissionId(0), 0), true);
    bytes.truncate(len - Seal::bytes(header.keyed, header.kind()));
    bytes
}

/// What the CRC of a frame covers beside its bytes and the mission.
#[derive(Debug, Clone, Copy)]
pub enum Covered {
    /// Of a hello: the receiver's session.
    Hello(u16),
    /// Of a numbered frame: the sessions of the receiver and of the sender, and the number.
    Run(SessionId, SessionId, u64),
}

/// Closes a frame with its CRC.
pub fn close_with_crc(frame: &mut Vec<u8>, mission: MissionId, covered: Covered) {
    let mission = mission.0.to_be_bytes();
    let (crc, unused, before) = match covered {
        Covered::Hello(to) => (&CRC_24_OPENPGP, 1, to.to_be_bytes().to_vec()),
        Covered::Run(to, from, number) => {
            let sessions = [to.get().to_be_bytes(), from.get().to_be_bytes()].concat();
            (&CRC_32_ISCSI, 0, [&sessions[..], &(number as u16).to_be_bytes()].concat())
        }
    };
    let crc = Crc::<u32>::new(crc);
    let mut digest = crc.digest();
    [&mission[..], &before, frame].into_iter().for_each(|bytes| digest.update(bytes));
    frame.extend_from_slice(&digest.finalize().to_be_bytes()[unused..]);
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
