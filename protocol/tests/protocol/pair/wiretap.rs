//! What a stranger who hears every frame knows: the runs of both ends and the numbers of their frames.

use scenecast_protocol::wire::{Address, Envelope, Header, MissionId, Seal, SessionId};

/// The sessions in the last hello of the surface (0) and of the vehicle (1), and the highest number of each since then.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Wiretap {
    sessions: [Option<SessionId>; 2],
    numbers: [u64; 2],
}

impl Wiretap {
    pub(crate) fn hear(&mut self, bytes: &[u8]) {
        let Ok(Envelope { header, .. }) = Envelope::decode(bytes, |to| to != Address::EVERYBODY) else { return };
        let of = usize::from(header.from.is_vehicle());
        match header.session {
            Some(_) if header.session == self.sessions[of] => {}
            Some(_) => (self.sessions[of], self.numbers) = (header.session, [0; 2]),
            None => self.numbers[of] = self.numbers[of].max(header.number_near(self.numbers[of])),
        }
    }

    pub(crate) fn session(&self, of: Address) -> Option<SessionId> {
        self.sessions[usize::from(of.is_vehicle())]
    }

    /// The highest number of an end in its last run.
    pub(crate) fn number(&self, of: Address) -> u64 {
        self.numbers[usize::from(of.is_vehicle())]
    }

    /// The CRC of a numbered frame of an end.
    pub(crate) fn crc(&self, mission: MissionId, of: Address, number: u64) -> Option<Seal<'static>> {
        let other = usize::from(!of.is_vehicle());
        Some(Seal::Run { mission, to: self.sessions[other]?, from: self.session(of)?, number })
    }

    /// The CRC of a frame that was heard.
    pub(crate) fn crc_of(&self, mission: MissionId, header: &Header) -> Option<Seal<'static>> {
        self.crc(mission, header.from, header.number_near(self.number(header.from)))
    }
}
