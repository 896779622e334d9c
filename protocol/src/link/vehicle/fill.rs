//! What a frame of the vehicle carries: chosen and encoded when its turn has come.

use super::{Carried, Part, VehicleLink};
use crate::link::Transmit;
use crate::mac::quarter_seconds;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, ChunkKind, FrameBuilder, room_for_payload};
use std::time::Duration;

impl VehicleLink {
    pub(super) fn frames_wanted(&self) -> u32 {
        let room = self.config.modem.frame_bytes.saturating_sub(14).max(1) as f64;
        let bytes = self.map_backlog() as f64 * self.bytes_per_cell + self.objects.backlog_bytes() as f64;
        (bytes / room).ceil() as u32
    }

    pub(super) fn map_backlog(&self) -> usize {
        if self.config.replicate_map { self.map.backlog_cells() } else { 0 }
    }

    pub(super) fn write_frame(&mut self, frames: u32, now: Instant) -> (Transmit, bool) {
        let size = self.config.modem.frame_bytes;
        let remaining = (frames - 1) as u8;
        let wish = (remaining == 0).then(|| self.wish(now));
        let (mut builder, hello) = self.pair.begin_frame(size, size / 6, remaining, wish, false);
        let mut carried = Carried::new();
        let before = builder.room();
        if !hello {
            self.fill(&mut builder, &mut carried, now);
        }
        let room_left = builder.room();
        let exhausted = room_left > before / 2;
        if exhausted && remaining > 0 {
            builder.set_remaining(0);
        }
        let last = remaining == 0 || exhausted;
        let kind = carried.iter().max_by_key(|(_, n)| *n).map_or("ack", |(p, _)| p.class().name());
        let payload: usize = carried.iter().map(|(_, n)| n).sum();
        for (part, n) in &carried {
            self.pair.stats.count(part.class(), *n);
        }
        let bytes = self.pair.finish_frame(builder, carried, hello, last);
        self.pair.stats.count(Class::Overhead, bytes.len() - payload);
        (Transmit { to: Address::SURFACE, bytes, kind }, last)
    }

    /// When another turn would be of use, as the turn byte says it.
    fn wish(&self, now: Instant) -> u8 {
        let modem = &self.config.modem;
        let affordable = self.budget.earliest(modem.bits_on_air(modem.frame_bytes) * 2, now).since(now);
        let idle = self.is_settled();
        let wait = if idle { affordable.max(self.idle_pause()).min(self.config.status_period) } else { affordable };
        quarter_seconds(wait, 254)
    }

    /// Pause between turns while nothing is to be said: turns that only ask take at most a tenth of the budget.
    fn idle_pause(&self) -> Duration {
        const ASK_AND_ANSWER_BITS: f64 = 240.0;
        let tenth = f64::from(self.budget.bits_per_s()) / 10.0;
        Duration::from_secs_f64((ASK_AND_ANSWER_BITS / tenth).max(1.0))
    }

    fn fill(&mut self, builder: &mut FrameBuilder, carried: &mut Carried, now: Instant) {
        self.fill_status(builder, carried, now);
        loop {
            let room = room_for_payload(builder.room());
            let object = self.objects.next_part(room);
            let both = object.is_some() && self.map_backlog() > 0;
            let exemplar_first = !both || self.shares.turn() == Class::Exemplar;
            let spent = match object {
                Some((id, range, bytes)) if exemplar_first && builder.push(ChunkKind::Object, &bytes) => {
                    self.objects.mark_in_flight(id, &range);
                    carried.push((Part::Object(id, range), bytes.len()));
                    (Class::Exemplar, bytes.len())
                }
                _ => match self.fill_map(builder, carried, room, now) {
                    Some(bytes) => (Class::Map, bytes),
                    None => return,
                },
            };
            if both {
                self.shares.spend(spent.0, spent.1);
            }
        }
    }

    fn fill_status(&mut self, builder: &mut FrameBuilder, carried: &mut Carried, now: Instant) {
        let Some(status) = self.status.as_mut().filter(|_| now >= self.status_due) else { return };
        status.base_digest = self.map.acked_digest();
        status.slots = self.inbox.reports();
        let mut bytes = status.encode();
        if room_for_payload(builder.room()) < bytes.len() + 1 {
            // Where a frame is small, the waypoint is what can be missed.
            status.waypoint = None;
            bytes = status.encode();
        }
        if !builder.push(ChunkKind::Status, &bytes) {
            return;
        }
        let share = bytes.len() as f64 * 80.0 / f64::from(self.budget.bits_per_s());
        self.status_due = now + self.config.status_period.max(Duration::from_secs_f64(share));
        carried.push((Part::Status, bytes.len()));
    }

    fn fill_map(
        &mut self,
        builder: &mut FrameBuilder,
        carried: &mut Carried,
        room: usize,
        now: Instant,
    ) -> Option<usize> {
        let worth = |old: u8, new: u8| {
            let interest = self.worth[usize::from(old)].max(self.worth[usize::from(new)]);
            let surprise = if old == 0 { 1.0 } else { 0.5 };
            surprise * (0.2 + interest)
        };
        if !self.config.replicate_map {
            return None;
        }
        let chunk = self.map.next_chunk(self.config.codec, room, now, &worth)?;
        if !builder.push(ChunkKind::Map, &chunk.bytes) {
            return None;
        }
        self.pair.stats.chunks_sent += 1;
        let n = chunk.bytes.len();
        let per_cell = n as f64 / chunk.changes.len().max(1) as f64;
        self.bytes_per_cell += (per_cell - self.bytes_per_cell) * 0.1;
        self.map.mark_in_flight(&chunk.changes);
        carried.push((Part::Map(chunk.changes), n));
        Some(n)
    }
}
