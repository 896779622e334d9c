//! What the vehicle's end does with a frame.

use super::{Carried, HeardLast, Part, VehicleEvent, VehicleLink};
use crate::directive::{Slot, VersionedSlot};
use crate::link::DropReason;
use crate::mac::{Access, Grant};
use crate::map::StateSource;
use crate::time::Instant;
use crate::wire::{Address, ChunkKind, Envelope, Header, Stamp};
use std::time::Duration;

impl<S: StateSource> VehicleLink<S> {
    /// Takes received bytes.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let us = self.config.address;
        let envelope = match Envelope::decode(bytes, |to| to == us || to == Address::EVERYBODY) {
            Ok(envelope) if envelope.header.from == Address::SURFACE => envelope,
            Ok(_) => return self.pair.stats.drop(DropReason::Stranger),
            Err(e) => return self.pair.stats.drop(e.into()),
        };
        if envelope.header.to == Address::EVERYBODY {
            return self.handle_call(&envelope, now);
        }
        let inbound = match self.pair.handle_frame(&envelope) {
            Ok(inbound) => inbound,
            Err(DropReason::NoBase) => {
                // The surface builds on what we never acknowledged: it took us for another run in between.
                return self.renew(now);
            }
            Err(DropReason::Unauthenticated) => {
                self.report_due = self.report_due.min(now + Duration::from_secs(60));
                return;
            }
            Err(_) => return,
        };
        if inbound.restarted {
            self.forget_peer(now);
            self.events.push_back(VehicleEvent::SurfaceRestarted);
        }
        let header = inbound.header().clone();
        let slots: Vec<Vec<u8>> =
            inbound.chunks().filter(|c| c.kind == ChunkKind::Slot).map(|c| c.payload.to_vec()).collect();
        let foreign = inbound.chunks().any(|c| c.kind != ChunkKind::Slot);
        let (number, is_latest, lacks_base, fates) =
            (inbound.number, inbound.is_latest, inbound.lacks_base, inbound.fates);
        if foreign {
            self.pair.stats.drop(DropReason::Malformed);
        }
        self.handle_fates(fates, now);
        self.objects.set_loss(self.pair.stats.loss_out.expected());
        for (slot, number) in slots.iter().zip(number.into_iter().cycle()) {
            self.handle_slot(slot, number, bytes.len(), now);
        }
        if is_latest {
            self.handle_stamp(&header, number, bytes.len(), now);
            self.handle_turn(&header, now);
        }
        if lacks_base {
            self.renew(now);
        }
        self.owe_answer(now);
    }

    fn handle_turn(&mut self, header: &Header, now: Instant) {
        let Some(quarters) = header.turn else { return };
        self.called = None;
        self.begin_turn();
        if header.hello {
            // It does not tell what the surface has heard.
            self.forget_said();
        }
        let grant = Grant::heard(quarters, header.remaining, &self.config.modem, now);
        self.floor.handle_grant((quarters > 0).then_some(grant));
    }

    fn handle_stamp(&mut self, header: &Header, number: Option<u64>, bytes: usize, now: Instant) {
        // A hello may be a replay: it tells no time.
        let Some(number) = number else { return };
        self.heard = Some(HeardLast { number, at: now });
        if let Some(Stamp::Surface { clock_ms, one_way }) = header.stamp {
            self.one_way = one_way.or(self.one_way);
            let ago = self.config.modem.airtime(bytes) + self.one_way.unwrap_or_default();
            self.clock.get_or_insert_default().measure(clock_ms, ago, now);
        }
    }

    fn handle_fates(&mut self, fates: Vec<(Carried<S::Carried>, bool)>, now: Instant) {
        for (part, bytes, delivered) in fates.into_iter().flat_map(|(c, d)| c.into_iter().map(move |(p, b)| (p, b, d)))
        {
            if delivered {
                self.pair.stats.deliver(part.class(), bytes, now);
            }
            match part {
                Part::Map(carried) => self.source.handle_fate(carried, delivered, now),
                Part::Plane(kind, carried) => {
                    if let Some(plane) = self.plane_mut(kind) {
                        plane.source.handle_fate(carried, delivered, now);
                    }
                }
                Part::Object(id, run) => {
                    if self.objects.handle_fate(id, &run, delivered) {
                        self.events.push_back(VehicleEvent::ObjectDelivered(id));
                    }
                }
                Part::Pose if !delivered => self.pose_due = now,
                Part::Report if !delivered => self.owe_report(now),
                Part::Pose | Part::Report | Part::PlaneDigest(_) => {}
            }
        }
    }

    fn handle_slot(&mut self, payload: &[u8], number: u64, frame_bytes: usize, now: Instant) {
        let Ok(mut slot) = VersionedSlot::decode(payload) else {
            return self.pair.stats.drop(DropReason::Malformed);
        };
        if !self.inbox.admit(&slot) {
            return;
        }
        if let Some(window) = self.pair.window_mut() {
            window.hold_back(number);
        }
        if let Some(Slot::Fix(fix)) = &mut slot.content {
            // It was as old as it says when it left.
            let under_way = self.config.modem.airtime(frame_bytes) + self.one_way.unwrap_or_default();
            fix.age_s += under_way.as_secs_f64();
        }
        self.events.push_back(VehicleEvent::Slot { id: slot.id, version: slot.version, content: slot.content });
        self.answer_due = Some(now);
    }

    /// Where the modem decides when to speak, the surface hears of what came in after a while, or with what is sent anyway.
    fn owe_answer(&mut self, now: Instant) {
        if matches!(self.config.modem.access, Access::ModemOwned { .. })
            && (self.pair.unstated() > 0 || self.pair.must_greet())
        {
            self.answer_due.get_or_insert(now + Duration::from_secs(1));
        }
    }
}
