//! Calls of a surface that looks for vehicles.

use super::VehicleLink;
use crate::link::{DropReason, Transmit};
use crate::mac::Grant;
use crate::map::StateSource;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameBuilder, Header, Seal, SessionId};
use std::time::Duration;

impl<S: StateSource> VehicleLink<S> {
    /// The surface asks who is there. One that it does not speak with answers at a time of its own choosing.
    pub(super) fn handle_call(&mut self, envelope: &Envelope<'_>, now: Instant) {
        let sound = match &self.config.authenticity {
            Some(a) => envelope.open(&Seal::Hello(&a.key, self.config.mission, 0, 0)).is_some(),
            None => envelope.open(&Seal::Crc(self.config.mission, 0)).is_some(),
        };
        let header = &envelope.header;
        if !sound || !header.hello {
            return self.pair.stats.drop(DropReason::Checksum);
        }
        if self.pair.is_met() && self.heard.is_some_and(|h| now.since(h.at) < Duration::from_secs(60)) {
            return;
        }
        self.called = Some((header.session, header.nonce.unwrap_or_default()));
        let window = Duration::from_millis(250) * u32::from(header.turn.unwrap_or_default());
        let share = (crate::random::next(&mut self.random) >> 40) as f64 / (1u64 << 24) as f64;
        let begins = now + self.config.modem.turn_around + window.mul_f64(share);
        self.begin_turn();
        self.floor.handle_grant(Some(Grant { begins, ends: begins + self.config.modem.frame_airtime() * 2 }));
    }

    /// "Here": the answer to a call for vehicles that are not known.
    pub(super) fn write_here(&mut self, (session, nonce): (SessionId, u64)) -> Transmit {
        let authenticity = self.config.authenticity.clone();
        let header = Header {
            from: self.config.address,
            to: Address::SURFACE,
            session,
            number: 0,
            base: 1,
            remaining: 0,
            turn: None,
            stamp: None,
            nonce: authenticity.as_ref().map(|_| nonce),
            ack: None,
            hello: true,
            keyed: authenticity.is_some(),
        };
        let builder = FrameBuilder::new(&header, self.config.modem.frame_bytes);
        let mission = self.config.mission;
        let bytes = match &authenticity {
            Some(a) => builder.finish(&Seal::Hello(&a.key, mission, session.get(), nonce), true),
            None => builder.finish(&Seal::Crc(mission, session.get()), true),
        };
        self.pair.stats.count(Class::Overhead, bytes.len());
        Transmit { to: Address::SURFACE, bytes, kind: "hello" }
    }
}
