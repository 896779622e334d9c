//! One run of the bench: the vehicle's places and the true classes below its camera.

use super::turn::Turn;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::map::{Cell, LabelGrid, Rect};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Intent, VehicleMode};
use scenecast_rehearsal::{Mission, MissionOptions, World, true_classes};
use std::collections::VecDeque;
use std::sync::Arc;

/// A stay is a time in which the vehicle does not leave the circle of this radius around its place at the beginning, metres.
const STAY_M: f64 = 2.0;
/// A stay of this time without a report that the vehicle holds is a fault, seconds.
pub(super) const STAY_LIMIT_S: u32 = 60;
/// Places along an edge of the camera's view at which the class is looked up.
const SAMPLES: u32 = 9;

/// The floor over which the camera's time is added up: that of a label, and that of a class.
pub(super) struct Watched {
    /// The label of each cell of the world.
    pub(super) labels: Arc<LabelGrid>,
    pub(super) label: u8,
    pub(super) class: u8,
}

/// A mission, watched each second.
pub(super) struct Flight {
    pub(super) mission: Mission,
    /// True classes of the survey area and its surroundings, shifted by one; 0 is not known.
    classes: LabelGrid,
    watched: Option<Watched>,
    watched_s: [f64; 2],
    turn: Turn,
    /// The purpose of the vehicle's plan in the last second in which its turn was watched.
    purpose: Option<Intent>,
    /// Places of each second since the vehicle last left a circle or held.
    stay: VecDeque<(f64, f64)>,
    longest_stay_s: u32,
}

impl Flight {
    pub(super) fn new(config: &Config, seed: u64) -> Result<Self, UserError> {
        let world = World::procedural(config, seed);
        let mission = Mission::new(config.clone(), MissionOptions { world, seed, record: None })?;
        let (around, cell_m) = (mission.pictured_area(), mission.cell_m());
        let cell = |metres: f64| (metres / cell_m).floor() as i32;
        let (x, y) = (cell(around.west), cell(around.south));
        let count = |high: f64, first: i32| (cell(high) - first + 1).max(1) as u32;
        let area = Rect { x, y, width: count(around.east, x), height: count(around.north, y) };
        let classes = true_classes(mission.world(), area, cell_m);
        Ok(Self {
            mission,
            classes,
            watched: None,
            watched_s: [0.0; 2],
            turn: Turn::default(),
            purpose: None,
            stay: VecDeque::new(),
            longest_stay_s: 0,
        })
    }

    /// Adds up the time over this floor from now on.
    pub(super) fn watch(&mut self, watched: Watched) {
        self.watched = Some(watched);
    }

    /// Seconds over the watched label and over the watched class.
    pub(super) fn watched_s(&self) -> [f64; 2] {
        self.watched_s
    }

    /// Seconds from the order until the vehicle headed for the label, and the purpose of its plan after 20 s.
    pub(super) fn turned(&self) -> (Option<u32>, Option<Intent>) {
        (self.turn.turned_s(), self.purpose)
    }

    pub(super) fn longest_stay_s(&self) -> u32 {
        self.longest_stay_s
    }

    pub(super) fn class_name(&self, class: u8) -> String {
        self.mission.world().class_name(class)
    }

    pub(super) fn weigh(&mut self, label: u8, weight: f64, exploration: f64) -> Result<(), UserError> {
        let (vehicle, now) = (self.mission.address(), self.mission.now());
        let order = [(label, weight)].into();
        let version = self.mission.surface_mut().set_utility(vehicle, &order, (exploration, 0.0), now);
        version.map(drop).map_err(UserError::failed)
    }

    pub(super) fn fly_until(&mut self, end_s: u32) -> Result<(), UserError> {
        for second in self.second() + 1..=end_s {
            self.mission.advance(Instant::from_secs_f64(second.into()))?;
            self.note_second();
        }
        Ok(())
    }

    fn second(&self) -> u32 {
        self.mission.now().as_secs_f64().round() as u32
    }

    fn note_second(&mut self) {
        if let Some(Watched { labels, label, class }) = &self.watched {
            let of_label = self.share_in_view(|cell| labels.get(cell) == *label);
            let of_class = self.share_in_view(|cell| self.class_at(cell) == Some(*class));
            self.watched_s = [self.watched_s[0] + of_label, self.watched_s[1] + of_class];
        }
        self.note_turn();
        let at = (self.mission.motion().x_m, self.mission.motion().y_m);
        self.stay.push_back(at);
        if self.is_holding() {
            self.stay.clear();
        }
        let has_left = |&(x, y): &(f64, f64)| (x - at.0).hypot(y - at.1) > STAY_M;
        while self.stay.front().is_some_and(has_left) {
            self.stay.pop_front();
        }
        self.longest_stay_s = self.longest_stay_s.max(self.stay.len().saturating_sub(1) as u32);
    }

    /// Watches how the vehicle turns once it has the order.
    fn note_turn(&mut self) {
        let (vehicle, Some(Watched { label, .. })) = (self.mission.vehicle(), &self.watched) else { return };
        if vehicle.utility().is_none() || self.turn.is_over() {
            return;
        }
        let ((x, y), cell_m, camera) =
            (vehicle.navigator().position().xy(), self.mission.cell_m(), &self.mission.config().camera);
        let reach = f64::from(camera.width_px.min(camera.height_px)) * camera.metres_per_pixel / 2.0 / cell_m;
        let heading_rad = self.mission.motion().heading_rad;
        self.turn.note((vehicle.map(), *label), (x / cell_m, y / cell_m), heading_rad, reach);
        self.purpose = vehicle.status(self.mission.now()).intent;
    }

    /// Whether the last report at the surface says that the vehicle does not survey.
    fn is_holding(&self) -> bool {
        let view = self.mission.surface().view(self.mission.address());
        let mode = view.and_then(|view| view.status().map(|(status, _)| status.mode));
        mode.is_some_and(|mode| mode != VehicleMode::Survey)
    }

    /// The part of the camera's view on cells of the world that have a property.
    fn share_in_view(&self, has_property: impl Fn(Cell) -> bool) -> f64 {
        let (camera, motion) = (&self.mission.config().camera, self.mission.motion());
        let [width, height] =
            [camera.width_px, camera.height_px].map(|pixels| f64::from(pixels) * camera.metres_per_pixel);
        let (sin, cos) = motion.heading_rad.sin_cos();
        let part = |i: u32, edge: f64| ((f64::from(i) + 0.5) / f64::from(SAMPLES) - 0.5) * edge;
        let cell = |metres: f64| (metres / self.mission.cell_m()).floor() as i32;
        let shown = (0..SAMPLES).flat_map(|i| (0..SAMPLES).map(move |j| (part(i, width), part(j, height))));
        let is_shown = |(right, ahead): (f64, f64)| {
            let (x, y) = (motion.x_m + right * cos + ahead * sin, motion.y_m - right * sin + ahead * cos);
            has_property(Cell::new(cell(x), cell(y)))
        };
        shown.filter(|&at| is_shown(at)).count() as f64 / f64::from(SAMPLES * SAMPLES)
    }

    /// The true class of a cell of the world.
    pub(super) fn class_at(&self, cell: Cell) -> Option<u8> {
        self.classes.get(cell).checked_sub(1)
    }

    /// Columns and rows from a cell of the vehicle's map to the same place of the world.
    pub(super) fn map_offset(&self) -> (i32, i32) {
        let navigator = self.mission.vehicle().navigator();
        let ((x, y), (east, north)) = (navigator.position().xy(), navigator.world().xy());
        let cells = |metres: f64| (metres / self.mission.cell_m()).round() as i32;
        (cells(east - x), cells(north - y))
    }
}
