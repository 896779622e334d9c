//! The record of a mission, the source of its report; its clock and its regular events.

use scenecast_config::Config;
use scenecast_host::{FrameEvent, VehicleHostEvent};
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{Cell, LabelGrid, UNEXPLORED};
use scenecast_protocol::time::Instant;
use scenecast_registration::FrameGraph;
use scenecast_surface::SurfaceOutput;
use scenecast_vehicle::{AppliedSlot, MapChanges, Vehicle};
use std::collections::BTreeMap;
use std::time::Duration;

/// Start and end of a leg in the world frame.
pub type Leg = ((f64, f64), (f64, f64));

/// Where a camera frame was taken, in the world frame, and where the mapper placed it, in the map frame; metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FramePoses {
    pub(crate) true_at: (f64, f64),
    pub(crate) mapped_at: (f64, f64),
}

/// The events of a mission that its report counts.
#[derive(Default)]
pub(crate) struct Logbook {
    /// Each decision of the vehicle about a slot.
    pub(crate) applied: Vec<AppliedSlot>,
    /// Time at which the operator issued each version of a slot.
    pub(crate) issued: BTreeMap<(SlotId, u16), Instant>,
    /// Each waypoint: from, to, by the vehicle's own position estimate.
    pub(crate) legs: Vec<Leg>,
    /// Number of legs when the last fence took effect.
    pub(crate) legs_before_fence: usize,
    /// Estimated position of the vehicle at each frame that the mapper took.
    pub(crate) track: Vec<(f64, f64)>,
    /// The true and the mapped place of each frame that the mapper took.
    pub(crate) poses: Vec<FramePoses>,
    /// All registered frames, to place them together after the survey.
    pub(crate) graph: FrameGraph,
    /// The vehicle's map as its producers have given it.
    pub(crate) map: GivenMap,
    /// Bits on air of the frames that the surface received.
    pub(crate) received_bits: u64,
    /// What people should change at the camera.
    pub(crate) camera_advice: Option<String>,
    /// The events of both ends and their times, if they are kept.
    pub(crate) events: Option<Vec<(Instant, EndEvent)>>,
    /// Events of the surface since they were last taken.
    pub(super) outputs: Vec<SurfaceOutput>,
    /// Frames of a recording that cannot be read: how many, and why the first one.
    pub(crate) unreadable: Option<(u64, String)>,
}

/// The labels of a map, and how they changed.
#[derive(Default)]
pub(crate) struct GivenMap {
    cells: LabelGrid,
    epoch: u8,
    /// The highest label that the producers have assigned.
    pub(crate) highest: u8,
    /// Bytes that the map would have taken as a PNG file at each of its versions.
    pub(crate) png_full_bytes: u64,
    version: u64,
    /// Changes of the label of a cell that had one on the published map.
    pub(crate) flips: u64,
    /// Mission time of the first map with the cell, seconds.
    pub(crate) first_seen_s: BTreeMap<Cell, f64>,
}

impl GivenMap {
    /// The vehicle has taken changes of the map.
    pub(super) fn note_changes(&mut self, vehicle: &Vehicle, changes: &MapChanges, now: Instant) {
        let Some(labels) = &changes.labels else { return };
        if vehicle.map_version() != self.version {
            self.version = vehicle.map_version();
            let png = scenecast_core::label_picture::encode(vehicle.map());
            self.png_full_bytes += png.map_or(0, |png| png.len() as u64);
        }
        if std::mem::replace(&mut self.epoch, labels.epoch) != labels.epoch {
            self.cells.clear();
        }
        for &(cell, label) in &labels.cells {
            match self.cells.set(cell, label) {
                UNEXPLORED => _ = self.first_seen_s.entry(cell).or_insert(now.as_secs_f64()),
                before => self.flips += u64::from(before != label),
            }
        }
        self.highest = labels.highest;
    }
}

/// An event of one of the ends.
#[derive(Debug, Clone, PartialEq)]
pub enum EndEvent {
    /// A frame of the surface.
    Surface(FrameEvent),
    Vehicle(VehicleHostEvent),
}

impl Logbook {
    pub(super) fn note_event(&mut self, event: impl FnOnce() -> EndEvent, at: Instant) {
        if let Some(events) = &mut self.events {
            events.push((at, event()));
        }
    }

    pub(super) fn note_waypoint(&mut self, vehicle: &Vehicle, to: MapPoint) {
        let navigator = vehicle.navigator();
        self.legs.push((navigator.to_world(navigator.position()).xy(), navigator.to_world(to).xy()));
    }

    pub(super) fn note_applied(&mut self, applied: AppliedSlot) {
        if applied.id == SlotId::Fence {
            self.legs_before_fence = self.legs.len();
        }
        self.applied.push(applied);
    }

    pub(super) fn note_issued(&mut self, view: &PeerView<'_>) {
        for slot in view.slots() {
            self.issued.entry((slot.id, slot.version)).or_insert(slot.issued);
        }
    }
}

/// Seconds between two steps of the vehicle's motion.
pub(super) const STEP_S: f64 = 0.5;
const COMPARE_INTERVAL: Duration = Duration::from_secs(1);

/// The mission time, and the next time of each regular event.
#[derive(Debug, Clone, Copy)]
pub(super) struct Timetable {
    pub(super) now: Instant,
    pub(super) ended: Option<Instant>,
    pub(super) frame: Instant,
    step: Instant,
    look: Instant,
    fix: Instant,
    /// `None` for a mission without fixes.
    fix_interval: Option<Duration>,
}

impl Timetable {
    pub(super) fn new(config: &Config, now: Instant) -> Self {
        let period_s = config.navigation.fix_period_s;
        let fix_interval = (period_s > 0.0).then(|| Duration::from_secs_f64(period_s));
        Self { now, ended: None, frame: now, step: now, look: now, fix: Instant::from_secs_f64(period_s), fix_interval }
    }

    pub(super) fn next_event(&self) -> Instant {
        let fix = self.fix_interval.map(|_| self.fix);
        [self.look, self.step, self.frame].into_iter().chain(fix).min().unwrap_or(self.look)
    }

    /// Whether a step of the motion is due; if so, it schedules the next one, as the two methods below do.
    pub(super) fn takes_step(&mut self) -> bool {
        let is_due = self.now >= self.step;
        if is_due {
            self.step = self.step + Duration::from_secs_f64(STEP_S);
        }
        is_due
    }

    pub(super) fn takes_fix(&mut self) -> bool {
        let Some(interval) = self.fix_interval.filter(|_| self.now >= self.fix) else { return false };
        self.fix = self.fix + interval;
        true
    }

    pub(super) fn takes_look(&mut self) -> bool {
        let is_due = self.now >= self.look;
        if is_due {
            self.look = self.look + COMPARE_INTERVAL;
        }
        is_due
    }
}
