//! What a frame of the vehicle carries: chosen and encoded when its turn has come.

use super::{Carried, Part, VehicleLink};
use crate::map::StateSource;
use crate::schedule::{Class, Extra};
use crate::time::Instant;
use crate::wire::{ChunkKind, FrameBuilder, VehicleStatus, room_for_payload};
use std::time::Duration;

impl<S: StateSource> VehicleLink<S> {
    /// Fills a frame to the last byte that is of use: classes by their shares, and inside a class what is worth most.
    pub(super) fn fill(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>, now: Instant) {
        let mut unfit: Vec<Class> = Vec::new();
        loop {
            let waiting = self.waiting(now);
            let candidates: Vec<Class> = waiting.iter().copied().filter(|c| !unfit.contains(c)).collect();
            let Some(class) = self.shares.next(&candidates) else { break };
            let bytes = self.fill_class(class, false, builder, carried, now);
            if bytes == 0 {
                unfit.push(class);
            }
            self.shares.spend(class, bytes, &waiting);
        }
        self.fill_extras(builder, carried, now);
        self.fill_digests(builder, carried);
    }

    /// Fills what is left of a frame with what nobody has to have.
    fn fill_extras(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>, now: Instant) {
        let mut unfit: Vec<Extra> = Vec::new();
        loop {
            let next = self.extras(now).find(|e| !unfit.contains(e));
            let Some(extra) = next else { return };
            if self.fill_class(extra.class(), true, builder, carried, now) == 0 {
                unfit.push(extra);
            }
        }
    }

    /// Puts something of a class into a frame; returns the bytes of it.
    fn fill_class(
        &mut self,
        class: Class,
        is_extra: bool,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        now: Instant,
    ) -> usize {
        let before = carried.len();
        match class {
            Class::Status => self.fill_status(builder, carried, now),
            Class::Exemplar => self.fill_object(is_extra, builder, carried),
            Class::Confidence | Class::Depth | Class::Curiosity => self.fill_plane(class, builder, carried, now),
            _ => self.fill_map(builder, carried, now),
        }
        carried.iter().skip(before).map(|(_, n)| n).sum()
    }

    fn waiting(&self, now: Instant) -> Vec<Class> {
        let status = self.status.is_some() && self.wants_status(now);
        [
            (status, Class::Status),
            (self.source.backlog_bytes() > 0 && !self.is_refining(), Class::Map),
            (self.objects.backlog_bytes() > 0, Class::Exemplar),
        ]
        .into_iter()
        .filter_map(|(waits, class)| waits.then_some(class))
        .chain(self.waiting_planes())
        .collect()
    }

    fn fill_status(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>, now: Instant) {
        let backlog = self.backlog(now);
        let Some(status) = self.status.as_mut() else { return };
        status.backlog = backlog;
        status.base_digest = self.source.digest();
        status.slots = self.inbox.reports();
        status.budget_bps = self.budget.bits_per_s();
        status.refused_frames = self.pair.stats.refused().min(255) as u8;
        let share = |bytes: usize| Duration::from_secs_f64(bytes as f64 * 160.0 / f64::from(status.budget_bps.max(1)));
        if now >= self.report_due {
            let report = status.encode_report(room_for_payload(builder.room()), self.report_from);
            if let Some((bytes, next)) = report.filter(|(bytes, _)| builder.push(ChunkKind::Report, bytes)) {
                self.report_from = next;
                if next == 0 {
                    self.report_due = now + self.config.status_period.max(share(bytes.len()));
                }
                carried.push((Part::Report, bytes.len()));
                self.planes.iter_mut().for_each(|p| p.owes_digest = p.source.is_begun());
            }
        }
        if now >= self.pose_due {
            let period = self.config.status_period.max(share(VehicleStatus::POSE));
            // The path may take a hundredth of the budget.
            let path = (period.as_secs_f64() * f64::from(status.budget_bps) / 800.0) as usize;
            let room = room_for_payload(builder.room()).min(VehicleStatus::POSE.saturating_add(path));
            let bytes = status.encode_pose(room);
            if builder.push(ChunkKind::Pose, &bytes) {
                self.pose_due = now + self.config.status_period.max(share(bytes.len().min(VehicleStatus::POSE)));
                carried.push((Part::Pose, bytes.len()));
            }
        }
    }

    fn fill_object(&mut self, is_extra: bool, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        let room = room_for_payload(builder.room());
        let part = if is_extra { self.objects.next_extra_part(room) } else { self.objects.next_part(room) };
        let Some((id, run, bytes)) = part else { return };
        if builder.push(ChunkKind::Object, &bytes) {
            self.objects.mark_in_flight(id, &run);
            carried.push((Part::Object(id, run), bytes.len()));
        }
    }

    fn fill_map(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>, now: Instant) {
        let room = room_for_payload(builder.room());
        let Some((bytes, content)) = self.source.next_chunk(room, now) else { return };
        let fits = builder.push(ChunkKind::Map, &bytes);
        assert!(fits, "a chunk of {} bytes was made for {room}", bytes.len());
        self.pair.stats.chunks_sent += 1;
        carried.push((Part::Map(content), bytes.len()));
    }
}
