//! Handling of received frames.

use super::hellos::ShortReply;
use super::parts::Carried;
use super::{VehicleEvent, VehicleLink};
use crate::bytes::Truncated;
use crate::directive::{InForceDigests, Slot, VersionedSlot};
use crate::link::{Admission, DropReason};
use crate::mac::{Access, Grant};
use crate::map::StateSource;
use crate::seal::VehicleKey;
use crate::time::Instant;
use crate::wire::{Address, ChunkKind, Envelope, FrameError, Header, Introduction};
use std::time::Duration;

/// Time without an accepted frame after which late frames are taken for a sign of a forged one.
const STRAYS_TIMEOUT: Duration = Duration::from_secs(20);

impl<S: StateSource> VehicleLink<S> {
    /// Handles the bytes of one received frame; a frame that cannot be used is counted in [`Self::stats`] and dropped.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let us = self.config.address;
        let envelope = match Envelope::decode(bytes, |to| to == us || to == Address::EVERYBODY) {
            Ok(envelope) if envelope.header.from == Address::SURFACE => envelope,
            Ok(_) => return self.pair.stats.drop(DropReason::UnknownSender),
            Err(e) => {
                if e == FrameError::NotForUs {
                    self.watch_others(bytes, now);
                }
                return self.pair.stats.drop(e.into());
            }
        };
        if envelope.header.to == Address::EVERYBODY {
            return self.handle_call(&envelope, now);
        }
        let owed_hello = self.pair.must_send_hello();
        self.pair.set_silence(self.last_received().map(|at| now.since(at)));
        let inbound = self.pair.handle_frame(&envelope, |_, _| true);
        if inbound.is_ok() {
            self.reply.handle_verified();
            self.pair.note_length(bytes.len(), self.config.modem.frame_bytes);
        }
        self.tell_mismatches();
        let is_hello = envelope.header.kind().is_hello();
        let inbound = match inbound {
            Ok(inbound) => inbound,
            Err(DropReason::Checksum | DropReason::Keyed) if is_hello => return self.complain(&envelope.header, now),
            Err(DropReason::NoBase) => {
                // The surface builds on frames that we never acknowledged: in between it took us for another run.
                return self.renew(now);
            }
            Err(DropReason::Late) if self.pair.seems_out_of_step() && self.is_silent_for(STRAYS_TIMEOUT, now) => {
                // A forged frame had so high a number that every true one comes late.
                return self.renew(now);
            }
            Err(DropReason::Unauthenticated) => {
                if is_hello {
                    self.complain(&envelope.header, now);
                }
                return self.content.status.owe_report_by(now + Duration::from_secs(60));
            }
            Err(_) => {
                if let Some(caller) = self.pair.poll_retired_caller() {
                    self.tell_of(&caller, now);
                }
                // A frame of an ended run shows that another surface does not know that it has lost the vehicle.
                if let Some(session) = self.pair.refused_session().filter(|_| !owed_hello)
                    && !self.hello_limit.admit(session, now)
                {
                    self.pair.withhold_hello();
                }
                return self.owe_answer(now);
            }
        };
        if let Some(caller) = &inbound.refusal {
            self.tell_of(caller, now);
        }
        match is_hello {
            true if envelope.header.session.is_some_and(|session| self.hello_limit.admit(session, now)) => {
                match self.pair.must_send_hello() && inbound.refusal.is_none() {
                    true => self.hello_limit.handle_offer(),
                    false => self.hello_limit.handle_known(now),
                }
            }
            true if owed_hello => return,
            true => return self.pair.withhold_hello(),
            false => self.hello_limit.handle_numbered(),
        }
        if inbound.restarted {
            self.content.set_plain(self.pair.peer_introduction().is_some_and(|surface| surface.is_plain));
            self.forget_peer(now);
            self.events.push_back(VehicleEvent::SurfaceRestarted);
        }
        if let (Some(_), Some(series)) = (inbound.number, self.pair.peer_introduction().and_then(|i| i.series)) {
            let is_new = self.inbox.meet(series);
            self.events.extend(is_new.then_some(VehicleEvent::SurfaceMet));
        }
        let header = inbound.header().clone();
        let slots: Vec<Vec<u8>> =
            inbound.chunks().filter(|c| c.kind == ChunkKind::Slot).map(|c| c.payload.to_vec()).collect();
        let foreign =
            inbound.chunks().any(|c| !matches!(c.kind, ChunkKind::Slot | ChunkKind::Inquiry | ChunkKind::NextKey));
        let key_parts: Vec<Vec<u8>> =
            inbound.chunks().filter(|c| c.kind == ChunkKind::NextKey).map(|c| c.payload.to_vec()).collect();
        let inquiry = inbound.chunks().find(|c| c.kind == ChunkKind::Inquiry);
        let inquiry = inquiry.and_then(|chunk| InForceDigests::decode(chunk.payload).ok());
        let (number, is_latest, lacks_base, fates) =
            (inbound.number, inbound.is_latest, inbound.lacks_base, inbound.fates);
        if foreign {
            self.pair.stats.drop(DropReason::Malformed);
        }
        self.handle_fates(fates, now);
        self.content.objects.set_loss(self.pair.stats.outgoing.loss.expected());
        for (slot, number) in slots.iter().zip(number.into_iter().cycle()) {
            self.handle_slot(slot, number, bytes.len(), now);
        }
        if let Some(held) = inquiry.filter(|_| number.is_some())
            && !self.content.in_force.handle_inquiry(&held, now)
        {
            // The next report shows that the surface holds all of it.
            self.content.status.owe_report_by(now + Duration::from_secs(2));
        }
        if is_latest {
            if let Some(number) = number {
                let airtime = self.config.modem.airtime(bytes.len());
                self.timing.handle_frame(number, header.stamp.as_ref(), airtime, now);
            }
            self.handle_turn(&header, now);
        }
        if lacks_base {
            self.renew(now);
        }
        self.handle_key_parts(&key_parts);
        self.owe_answer(now);
    }

    /// Time between two reports to the holder about others that call.
    const CALLER_INTERVAL: Duration = Duration::from_secs(60);

    /// Tells the surface that holds this vehicle of another one that calls it.
    fn tell_of(&mut self, other: &Introduction, now: Instant) {
        if self.told_caller.is_some_and(|at| now.since(at) < Self::CALLER_INTERVAL) {
            return;
        }
        self.told_caller = Some(now);
        let named = Introduction { origin: None, ..*other };
        self.content.caller = Some(named.encode(Introduction::MAX_BYTES));
        self.content.status.owe_report_by(now + Duration::from_secs(5));
    }

    /// A frame that is not for this vehicle may show that its address is wrong. One without a run sends at most answers to calls,
    /// so that frames of its address are those of another vehicle.
    fn watch_others(&mut self, bytes: &[u8], now: Instant) {
        let Ok(Envelope { header, .. }) = Envelope::decode(bytes, |_| true) else { return };
        match (header.from, header.to) {
            (from, Address::SURFACE) if from == self.config.address && !self.pair.has_run() => {
                self.pair.note_own_address()
            }
            (Address::SURFACE, to) if to.is_vehicle() && !self.pair.has_run() => self.pair.note_call_of(to, now),
            _ => return,
        }
        self.tell_mismatches();
    }

    fn tell_mismatches(&mut self) {
        self.events.extend(std::iter::from_fn(|| self.pair.poll_mismatch()).map(VehicleEvent::Mismatch));
    }

    /// Takes parts of the next key, and notes that the surface has proven a run under it.
    fn handle_key_parts(&mut self, parts: &[Vec<u8>]) {
        self.events.extend(self.pair.poll_key_change().then_some(VehicleEvent::KeyChanged));
        for part in parts {
            match self.pair.handle_key_part(part) {
                Ok(key) => self.events.extend(key.map(VehicleEvent::NextKey)),
                Err(Truncated) => self.pair.stats.drop(DropReason::Malformed),
            }
        }
    }

    /// The host keeps the next key, so that this end accepts it from now on.
    pub fn keep_next_key(&mut self, key: &VehicleKey) {
        self.pair.keep_next_key(key);
    }

    fn is_silent_for(&self, time: Duration, now: Instant) -> bool {
        self.last_received().is_none_or(|at| now.since(at) >= time)
    }

    /// Answers a discovery call, unless the surface is in contact with us.
    fn handle_call(&mut self, envelope: &Envelope<'_>, now: Instant) {
        const CONTACT_TIMEOUT: Duration = Duration::from_secs(60);
        let Some(generation) = ShortReply::called_by(self.pair.authenticity(), self.config.mission, envelope) else {
            self.complain(&envelope.header, now);
            return self.pair.stats.drop(DropReason::Checksum);
        };
        self.pair.note_called();
        if self.pair.has_run() && self.last_received().is_some_and(|at| now.since(at) < CONTACT_TIMEOUT) {
            return;
        }
        let Some(session) = envelope.header.session.filter(|&session| self.hello_limit.admit(session, now)) else {
            return;
        };
        self.reply.handle_call(&envelope.header, (session, generation));
        self.grant_reply(&envelope.header, now);
    }

    /// A hello or a call does not verify. After some of them, and in no contact, the vehicle tells so whoever sends them.
    fn complain(&mut self, header: &Header, now: Instant) {
        if let Some(session) = header.session
            && self.is_silent_for(STRAYS_TIMEOUT, now)
            && self.reply.handle_unverified(session, now)
        {
            self.grant_reply(header, now);
        }
    }

    /// The short hello that is owed goes out in the turn that a hello or a call names.
    fn grant_reply(&mut self, header: &Header, now: Instant) {
        let grant = match header.to {
            Address::EVERYBODY => Some(self.reply.draw_turn(&self.config, header.turn, now)),
            _ => header.turn.map(|quarters| Grant::received(quarters, header.remaining, &self.config.modem, now)),
        };
        self.begin_turn();
        self.floor.handle_grant(grant);
    }

    fn handle_turn(&mut self, header: &Header, now: Instant) {
        let Some(quarters) = header.turn else { return self.answer_full_duplex(now) };
        self.reply.cancel();
        self.begin_turn();
        if header.kind().is_hello() {
            // A hello does not acknowledge our frames, so it is not known which of them to repeat.
            self.repeater.forget();
        }
        let grant = Grant::received(quarters, header.remaining, &self.config.modem, now);
        self.floor.handle_grant((quarters > 0).then_some(grant));
    }

    /// A surface whose modem is taken for full duplex grants no turns: it learns from a hello that the modem here is not.
    fn answer_full_duplex(&mut self, now: Instant) {
        let is_full_duplex = self.pair.caller().is_some_and(|surface| surface.is_full_duplex);
        if is_full_duplex && self.config.modem.access == Access::Shared && self.pair.must_send_hello() {
            self.begin_turn();
            let begins = now + self.config.modem.turn_around;
            self.floor.handle_grant(Some(Grant { begins, ends: begins + self.config.modem.frame_airtime() * 2 }));
        }
    }

    fn handle_fates(&mut self, fates: Vec<(Carried<S::Carried>, bool)>, now: Instant) {
        if !fates.is_empty() {
            self.probe.handle_fates(self.pair.outstanding());
        }
        for (carried, delivered) in fates {
            for (part, bytes) in carried {
                if delivered {
                    self.pair.stats.deliver(part.class(), bytes, now);
                }
                let object = self.content.handle_fate(part, delivered, now);
                self.events.extend(object.map(VehicleEvent::ObjectDelivered));
            }
        }
    }

    fn handle_slot(&mut self, payload: &[u8], number: u64, frame_bytes: usize, now: Instant) {
        let series = self.pair.peer_introduction().and_then(|introduction| introduction.series);
        let (Some(series), Ok(mut slot)) = (series, VersionedSlot::decode(payload)) else {
            return self.pair.stats.drop(DropReason::Malformed);
        };
        let stops = matches!(slot.content, Some(Slot::Constraints(order)) if order.stops());
        // Without a key, the order of another surface may be forged.
        let is_told = self.content.is_told.get(slot.id.index()) == Some(&true) || !self.pair.is_authentic();
        match self.inbox.admit(series, &slot, is_told || stops) {
            Admission::New => {}
            Admission::Known => return,
            Admission::Overtaken => return self.content.status.owe_report_by(now + Duration::from_secs(1)),
        }
        if let Some(window) = self.pair.window_mut() {
            window.hold_back(number);
        }
        if let Some(Slot::Fix(fix)) = &mut slot.content {
            // The age in the slot is that at the start of the transmission.
            fix.age_s += self.timing.transit(self.config.modem.airtime(frame_bytes)).as_secs_f64();
        }
        self.events.push_back(VehicleEvent::Slot { id: slot.id, version: slot.version, content: slot.content });
        self.answer_due = Some(now);
    }

    /// Where the modem decides when to transmit, an acknowledgement or hello goes out within a second,
    /// by itself if need be. The first frames after a frame of the surface carry it, as those of a turn do.
    fn owe_answer(&mut self, now: Instant) {
        if self.config.modem.access.is_free() && (self.pair.unstated() > 0 || self.pair.must_send_hello()) {
            self.begin_turn();
            let wait = self.config.modem.answer_wait(Duration::from_secs(1));
            self.answer_due.get_or_insert(now + wait);
        }
    }
}
