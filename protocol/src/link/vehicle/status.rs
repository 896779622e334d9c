//! The vehicle's status: when its two chunks, pose and report, are due, and how much of a frame they take.

use crate::directive::SLOTS;
use crate::time::Instant;
use crate::wire::{
    ChunkKind, FrameBuilder, PoseDetails, RegistrationReport, Trail, TrailCorner, VehicleStatus, room_for_payload,
};
use std::ops::Range;
use std::time::Duration;

/// Part of the bit budget that each of pose and report may take at most, in a period of its own.
const SHARE: f64 = 1.0 / 40.0;

/// Up to this budget in bit/s, regular reports and those on fixes take half of their usual part, so that frames carry more
/// of the map. Reports of other decisions, and poses, are not delayed by it.
const SMALL_BUDGET_BPS: u32 = 250;

/// Intervals between two copies in a period: copies apart from each other are not lost together.
const COPY_INTERVALS: u32 = 8;

/// Bytes of a frame for faults and the shortest pose, with the headers of both chunks.
const FAULTS_AND_POSE: usize = PoseDetails::FAULTS_ALONE + 2 + VehicleStatus::SHORT_POSE + 1;

/// Sends the latest status once a period, in several frames where [`Self::set_copies`] asks for them. Pose and report take at
/// most a twentieth of the bit budget.
#[derive(Debug)]
pub(super) struct StatusSender {
    period: Duration,
    status: Option<VehicleStatus>,
    pose_due: Instant,
    report_due: Instant,
    /// When the last three poses were sent, the earliest first: a trail begins with the first of them, so that the surface
    /// knows the track if two frames in a row are lost.
    sent: [Option<Instant>; 3],
    /// When the last report was sent, and its bytes.
    reported: Option<(Instant, usize)>,
    /// Slot with which the next report begins: a report that does not fit into a frame continues in the next.
    report_from: usize,
    copies: Copies,
    /// Whether a pose that is due has let a frame pass that had no room for its trail.
    has_waited: bool,
}

/// How often a pose and a report that are due are sent, each in a frame of its own.
#[derive(Debug)]
struct Copies {
    each: u32,
    /// Copies that are still to be sent.
    poses: u32,
    reports: u32,
}

impl StatusSender {
    pub(super) fn new(period: Duration, now: Instant) -> Self {
        let copies = Copies { each: 1, poses: 1, reports: 1 };
        let sent = [None; 3];
        let (status, reported, report_from, has_waited) = (None, None, 0, false);
        Self { period, status, pose_due: now, report_due: now, sent, reported, report_from, copies, has_waited }
    }

    /// Sends each pose and each report in so many frames, as far as the share of the budget allows it. Where the ends take
    /// no turns, the loss of a frame is known late, and two in a row would leave the surface without a status for long.
    pub(super) fn set_copies(&mut self, wanted: u32, budget_bps: u32) {
        let (_, report) = self.reported.unwrap_or((Instant::ZERO, VehicleStatus::POSE));
        let share = time_of_share(budget_bps, report.max(VehicleStatus::POSE));
        let affordable = self.period.as_micros() / share.as_micros().max(1);
        self.copies.each = wanted.min(affordable as u32).max(1);
    }

    pub(super) fn set(&mut self, status: VehicleStatus) {
        self.status = Some(status);
    }

    pub(super) fn status_mut(&mut self) -> Option<&mut VehicleStatus> {
        self.status.as_mut()
    }

    /// Whether a pose or a report is due.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        now >= self.pose_due.min(self.report_due)
    }

    /// Whether a status is known and due.
    pub(super) fn is_waiting(&self, now: Instant) -> bool {
        self.status.is_some() && self.is_due(now)
    }

    /// When the next chunk is due, if a status is known.
    pub(super) fn next_due(&self) -> Option<Instant> {
        self.status.as_ref().map(|_| self.pose_due.min(self.report_due))
    }

    pub(super) fn owe_pose(&mut self, now: Instant) {
        (self.pose_due, self.copies.poses) = (now, self.copies.each);
    }

    /// Makes a report due at once, from its first slot.
    pub(super) fn owe_report(&mut self, now: Instant) {
        (self.report_due, self.report_from, self.copies.reports) = (now, 0, self.copies.each);
    }

    /// A pose is lost. Another copy of it may have arrived, so that one more is enough.
    pub(super) fn handle_lost_pose(&mut self, now: Instant) {
        if now < self.pose_due && self.copies.poses == self.copies.each {
            self.copies.poses = 1;
        }
        self.pose_due = now;
    }

    /// A report is lost; see [`Self::handle_lost_pose`].
    pub(super) fn handle_lost_report(&mut self, now: Instant) {
        if now < self.report_due && self.copies.reports == self.copies.each {
            self.copies.reports = 1;
        }
        (self.report_due, self.report_from) = (now, 0);
    }

    /// Makes a report due at `at`, unless it is due before.
    pub(super) fn owe_report_by(&mut self, at: Instant) {
        self.report_due = self.report_due.min(at);
    }

    /// Makes a report due as soon as its share of the budget allows it.
    pub(super) fn owe_report_in_share(&mut self, now: Instant) {
        let Some(budget_bps) = self.status.as_ref().map(|s| s.budget_bps) else { return };
        if self.report_from != 0 {
            // The part of the report that is under way may have had the fix before.
            return self.owe_report(now);
        }
        let at = self.reported.map_or(now, |(at, bytes)| now.max(at + time_of_report(budget_bps, bytes)));
        self.owe_report_by(at);
    }

    /// Puts a report into a frame if one is due; returns its bytes, and the slots that it tells of.
    pub(super) fn fill_report(&mut self, builder: &mut FrameBuilder, now: Instant) -> Option<(usize, Range<usize>)> {
        let first = self.report_from.min(SLOTS);
        let status = self.status.as_ref().filter(|_| now >= self.report_due)?;
        let (bytes, next) = status.encode_report(room_for_payload(builder.room()), self.report_from)?;
        if !builder.push(ChunkKind::Report, &bytes) {
            return None;
        }
        // A report of several frames has no copies.
        let is_whole = next == 0 && self.report_from == 0;
        self.report_from = next;
        self.reported = Some((now, bytes.len()));
        if is_whole && self.copies.reports > 1 {
            self.copies.reports -= 1;
            self.report_due = now + self.period / COPY_INTERVALS;
        } else if next == 0 {
            self.report_due = now + self.period.max(time_of_report(status.budget_bps, bytes.len()));
            self.copies.reports = self.copies.each;
        }
        let until = if next == 0 { SLOTS } else { next.min(SLOTS) };
        Some((bytes.len(), first..until))
    }

    /// Puts a pose into a frame if one is due; returns its bytes.
    pub(super) fn fill_pose(&mut self, builder: &mut FrameBuilder, now: Instant) -> Option<usize> {
        let status = self.status.as_ref().filter(|_| now >= self.pose_due)?;
        let period = self.period.max(time_of_share(status.budget_bps, VehicleStatus::POSE));
        // The path, the registration and the trail may take a hundredth of the budget each, in all copies together.
        let share = period.as_secs_f64() * f64::from(status.budget_bps) / 800.0 / f64::from(self.copies.each);
        let share = share as usize;
        let details = self.details(status, share, builder.room(), now)?;
        // From a pose at the end of a full frame, the surface would not learn how the vehicle came there.
        let corners = |trail: &Option<Trail>| trail.as_ref().map_or(0, Trail::len);
        if !self.has_waited && !builder.is_empty() && corners(&details.trail) < corners(&self.trail(status, share, now))
        {
            self.has_waited = true;
            return None;
        }
        let details = details.encode();
        let mut length = 0;
        if !details.is_empty() {
            length += builder.push(ChunkKind::Details, &details).then_some(details.len())?;
        }
        let room = room_for_payload(builder.room()).min(VehicleStatus::POSE.saturating_add(share));
        let bytes = status.encode_pose(room);
        if !builder.push(ChunkKind::Pose, &bytes) {
            return None;
        }
        length += bytes.len();
        self.has_waited = false;
        let pose = bytes.len().min(VehicleStatus::POSE);
        if self.copies.poses > 1 {
            self.copies.poses -= 1;
            self.pose_due = now + self.period / COPY_INTERVALS;
            return Some(length);
        }
        self.pose_due = now + self.period.max(time_of_share(status.budget_bps, pose));
        self.copies.poses = self.copies.each;
        // The last copy stands for all.
        self.sent = [self.sent[1], self.sent[2], Some(now)];
        Some(length)
    }

    /// The details of a pose, which leave room for it. Registration and trail may take `share` bytes each. `None` if there is no room for
    /// the faults: a pose without them says that there are none.
    fn details(&self, status: &VehicleStatus, share: usize, room: usize, now: Instant) -> Option<PoseDetails> {
        let faults = status.faults;
        if faults.is_any() && room < FAULTS_AND_POSE {
            return None;
        }
        let mut details = PoseDetails { faults, ..PoseDetails::default() };
        // The headers of details and pose take up to five bytes.
        let most = room.saturating_sub(VehicleStatus::POSE + 5);
        let fits = |details: &PoseDetails| details.encode().len() <= most;
        details.intent = status.intent;
        if !fits(&details) {
            details.intent = None;
        }
        details.registration = status.registration.filter(|_| RegistrationReport::BYTES <= share);
        if !fits(&details) {
            details.registration = None;
        }
        // A trail alone needs the first byte of the details too.
        let left = most.saturating_sub(details.encode().len().max(1));
        details.trail = self.trail(status, share.min(left), now);
        Some(details)
    }

    /// The trail before a pose, in at most `room` bytes.
    fn trail(&self, status: &VehicleStatus, room: usize, now: Instant) -> Option<Trail> {
        let is_new = |corner: &&TrailCorner| {
            self.sent[0].is_none_or(|since| f64::from(corner.ago_s) <= now.since(since).as_secs_f64())
        };
        let corners: Vec<TrailCorner> = status.trail.iter().take_while(is_new).copied().collect();
        Trail::new(status.position, &corners, room)
    }
}

/// The time between two reports of `bytes` that no order has made urgent.
fn time_of_report(budget_bps: u32, bytes: usize) -> Duration {
    time_of_share(budget_bps, bytes) * if budget_bps <= SMALL_BUDGET_BPS { 2 } else { 1 }
}

/// The time in which the share of a chunk is its `bytes`.
fn time_of_share(budget_bps: u32, bytes: usize) -> Duration {
    Duration::from_secs_f64(bytes as f64 * 8.0 / SHARE / f64::from(budget_bps.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::MapPoint;
    use crate::link::vehicle::content::tests::builder;
    use crate::wire::EquipmentFaults;

    /// Seconds from a report until one on a fix is due.
    fn wait_for_fix_report(budget_bps: u32) -> f64 {
        let (sent, decided) = (Instant::from_secs_f64(100.0), Instant::from_secs_f64(105.0));
        let mut sender = StatusSender::new(Duration::from_secs(3600), Instant::ZERO);
        sender.set(VehicleStatus { budget_bps, ..VehicleStatus::default() });
        assert_eq!(sender.fill_report(&mut builder(64), sent), Some((11, 0..SLOTS)));
        sender.owe_report_in_share(decided);
        sender.report_due.since(decided).as_secs_f64()
    }

    #[test]
    fn a_pose_goes_out_with_its_faults_or_not_at_all() {
        let faults = EquipmentFaults { camera_silent: true, ..EquipmentFaults::default() };
        let waypoint = Some(MapPoint::new(1.0, 2.0));
        for room in 16..80 {
            let mut sender = StatusSender::new(Duration::from_secs(1), Instant::ZERO);
            sender.set(VehicleStatus { budget_bps: 10_000, faults, waypoint, ..VehicleStatus::default() });
            let mut builder = builder(room);
            let whole = builder.room();
            let filled = sender.fill_pose(&mut builder, Instant::ZERO);
            let with_faults =
                [VehicleStatus::SHORT_POSE, VehicleStatus::POSE].map(|pose| PoseDetails::FAULTS_ALONE + pose);
            assert_eq!(filled.is_some(), whole >= FAULTS_AND_POSE, "{whole} bytes");
            assert!(filled.is_none_or(|bytes| with_faults.contains(&bytes)), "{whole} bytes: {filled:?}");
        }
    }

    /// Seconds after which poses are sent in the 5 s after `first`, and the loss of one is known after `lost` seconds.
    fn poses(copies: u32, lost: f64) -> Vec<f64> {
        let mut sender = StatusSender::new(Duration::from_secs(4), Instant::ZERO);
        sender.set(VehicleStatus { budget_bps: 100_000, ..VehicleStatus::default() });
        sender.set_copies(copies, 100_000);
        sender.owe_pose(Instant::ZERO);
        let mut sent = Vec::new();
        for tenth in 0..39 {
            let now = Instant::from_secs_f64(f64::from(tenth) / 10.0);
            if tenth == (lost * 10.0) as u32 {
                sender.handle_lost_pose(now);
            }
            if sender.fill_pose(&mut builder(64), now).is_some() {
                sent.push(now.as_secs_f64());
            }
        }
        sent
    }

    #[test]
    fn a_pose_lets_one_full_frame_pass_for_its_trail() {
        let trail = (1..8).map(|i| TrailCorner { ago_s: 4 * i, place: MapPoint::new(f64::from(i), f64::from(i % 2)) });
        let status = VehicleStatus { budget_bps: 10_000, trail: trail.collect(), ..VehicleStatus::default() };
        let mut sender = StatusSender::new(Duration::from_secs(15), Instant::ZERO);
        sender.set(status);
        let full = || {
            let mut builder = builder(64);
            assert!(builder.push(ChunkKind::Map, &[1; 30]));
            builder
        };
        assert_eq!(sender.fill_pose(&mut full(), Instant::ZERO), None);
        assert!(sender.is_due(Instant::ZERO));
        assert!(sender.fill_pose(&mut full(), Instant::ZERO).is_some(), "it waits once");
        let mut sender = StatusSender { has_waited: false, pose_due: Instant::ZERO, ..sender };
        assert!(sender.fill_pose(&mut builder(64), Instant::ZERO).is_some(), "no frame has more room");
    }

    #[test]
    fn one_more_copy_follows_a_loss() {
        assert_eq!(poses(3, 9.0), [0.0, 0.5, 1.0]);
        assert_eq!(poses(3, 0.7), [0.0, 0.5, 0.7], "the third copy comes earlier");
        assert_eq!(poses(3, 2.0), [0.0, 0.5, 1.0, 2.0]);
        assert_eq!(poses(1, 2.0), [0.0, 2.0]);
    }

    #[test]
    fn a_report_on_a_fix_waits_where_the_budget_is_small() {
        assert_eq!([wait_for_fix_report(10_000), wait_for_fix_report(1000)], [0.0, 0.0]);
        // 11 bytes are an eightieth of 100 bit/s in 70.4 s.
        assert!((wait_for_fix_report(100) - 65.4).abs() < 0.01, "{}", wait_for_fix_report(100));
    }
}
