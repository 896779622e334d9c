//! The answer to a discovery call: a surface that looks for vehicles invites all to answer, each at a random time.

use super::VehicleConfig;
use crate::link::run::{Generation, LinkAuthenticity};
use crate::mac::Grant;
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameBuilder, Header, MissionId, Seal, SessionId};
use std::time::Duration;

/// The answer that is owed to a discovery call.
#[derive(Debug)]
pub(super) struct CallReply {
    /// Session and nonce of the call, and the generation of its key.
    pending: Option<(SessionId, u64, Generation)>,
    /// State of the generator that draws the time of the answer.
    random: u64,
}

impl CallReply {
    pub(super) fn new(seed: u64) -> Self {
        Self { pending: None, random: seed ^ 0x0CA1_15EA }
    }

    /// The generation of the key of a frame to everybody, if it is a discovery call of this mission.
    pub(super) fn called_by(
        authenticity: Option<&LinkAuthenticity>,
        mission: MissionId,
        envelope: &Envelope<'_>,
    ) -> Option<Generation> {
        let generation = match authenticity {
            Some(a) => a.open_call(envelope, mission),
            None => envelope.open(&Seal::Crc(mission, 0)).map(|_| Generation::Present),
        };
        generation.filter(|_| envelope.header.kind().is_hello())
    }

    /// Takes a call; returns the turn in which it is answered, at a random time in the window that the call names.
    pub(super) fn handle_call(
        &mut self,
        config: &VehicleConfig,
        call: &Header,
        (session, generation): (SessionId, Generation),
        now: Instant,
    ) -> Grant {
        self.pending = Some((session, call.nonce.unwrap_or_default(), generation));
        let window = Duration::from_millis(250) * u32::from(call.turn.unwrap_or_default());
        let share = (crate::random::next(&mut self.random) >> 40) as f64 / (1u64 << 24) as f64;
        let begins = now + config.modem.turn_around + window.mul_f64(share);
        Grant { begins, ends: begins + config.modem.frame_airtime() * 2 }
    }

    pub(super) fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    pub(super) fn cancel(&mut self) {
        self.pending = None;
    }

    /// The frame that answers the pending call, if there is one.
    pub(super) fn take(&mut self, config: &VehicleConfig, authenticity: Option<&LinkAuthenticity>) -> Option<Vec<u8>> {
        let (session, nonce, generation) = self.pending.take()?;
        let header = Header {
            nonce: authenticity.map(|_| nonce),
            keyed: authenticity.is_some(),
            ..Header::hello(config.address, Address::SURFACE, session)
        };
        let builder = FrameBuilder::new(&header, config.modem.frame_bytes);
        let seal = match authenticity {
            Some(a) => Seal::Hello(a.key(generation), config.mission, session.get(), nonce),
            None => Seal::Crc(config.mission, session.get()),
        };
        Some(builder.finish(&seal, true))
    }
}
