//! What the vehicle does next, and what it says of it.

use super::{Vehicle, VehicleOutput};
use crate::planning::{Point, distance};
use crate::steering::{Course, PathAhead};
use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
use scenecast_protocol::directive::{Constraints, Fence, Limits, Reaction};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{ModeReason, PlannedPath, VehicleMode, VehicleStatus};

/// What the host was last asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Motion {
    #[default]
    Going,
    Still,
    Rising,
}

/// What the vehicle does, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Doing {
    motion: Motion,
    mode: VehicleMode,
    reason: ModeReason,
    /// The depth band was kept since the vehicle last began to go.
    was_in_band: bool,
}

/// Metres and seconds between two records of what is used of the limits.
const RECORD_EVERY: (f64, f64) = (50.0, 60.0);

impl Vehicle {
    /// Puts in force what survived.
    pub(super) fn restore_course(&mut self) {
        let durable = &self.durable;
        self.failsafe.order = Constraints { hold: durable.hold, abort: durable.abort };
        if let Some(limits) = Limits::from_bytes(&durable.limits) {
            self.failsafe.set_limits(limits);
            (self.failsafe.used_m, self.failsafe.used_s) = (f64::from(durable.used.0), f64::from(durable.used.1));
        }
        if let Some(reason) = ModeReason::from_code(durable.breach) {
            self.failsafe.handle_breach(reason);
        }
        self.steering.set_planner(self.telling.settings.planner.value());
        if let Some(fence) = Fence::from_bytes(&durable.fence).filter(|f| f.check().is_ok()) {
            self.steering.set_fence(&fence);
        }
    }

    /// Chooses a waypoint if there is none or the last one is reached, or does what is to be done instead of the survey.
    pub fn steer(&mut self, now: Instant) {
        self.failsafe.handle_time(now);
        if self.done {
            return;
        }
        let at = self.placed();
        self.watch(at);
        let is_limited = self.failsafe.left_m().is_finite();
        let home_m = if is_limited { self.steering.way_home_m(at) } else { 0.0 };
        match self.failsafe.stop(home_m) {
            None => self.survey(at),
            Some((Reaction::Hold, why)) => self.stay(VehicleMode::Hold, why),
            Some((Reaction::Surface, why)) => self.come_up(why),
            Some((Reaction::Return, why)) => self.go_home(at, why),
        }
        if std::mem::take(&mut self.has_new_orders) {
            self.link.owe_pose(now);
        }
        self.record();
    }

    /// Where it believes to be in the world. When that has moved under it, the way is chosen afresh: the rest of the last leg
    /// might cross an outline now.
    fn placed(&mut self) -> Point {
        let (east, north) = self.navigator.to_world(MapPoint::default()).xy();
        if (east, north) != self.steering.placed() {
            self.steering.set_placement(east, north);
            self.forget_way();
        }
        self.navigator.to_world(self.navigator.position()).xy()
    }

    fn is_reached(&self, waypoint: MapPoint) -> bool {
        waypoint.distance_m(self.navigator.position()) < self.steering.arrival_m()
    }

    fn watch(&mut self, at: Point) {
        if !self.steering.bounds().holds(at) {
            self.failsafe.handle_breach(ModeReason::Fence);
        }
        let is_broken = self.failsafe.is_band_broken(self.navigator.depth_m());
        if is_broken && self.course.was_in_band && self.course.motion != Motion::Rising {
            self.failsafe.handle_breach(ModeReason::Band);
        }
        self.course.was_in_band = (self.course.was_in_band || !is_broken) && self.course.motion != Motion::Rising;
    }

    /// What must survive has changed since it was last recorded.
    fn record(&mut self) {
        let (used_m, used_s) = (self.failsafe.used_m, self.failsafe.used_s);
        let (noted_m, noted_s) = (f64::from(self.durable.used.0), f64::from(self.durable.used.1));
        let is_far = used_m - noted_m > RECORD_EVERY.0 || used_s - noted_s > RECORD_EVERY.1;
        let breach = self.failsafe.latched as u8;
        if (is_far && self.failsafe.left_m().is_finite()) || breach != self.durable.breach {
            self.durable.used = (used_m as u32, used_s as u32);
            self.durable.breach = breach;
            self.outputs.push_back(VehicleOutput::Persist);
        }
    }

    fn survey(&mut self, at: Point) {
        let is_back = self.course.motion != Motion::Going || self.course.mode != VehicleMode::Survey;
        if !is_back && self.waypoint.is_some_and(|w| !self.is_reached(w)) {
            return;
        }
        let left_m = self.failsafe.left_m();
        let (map, version) = (&self.telling.seen, self.telling.version);
        match self.steering.next(at, (map, version), self.utility.as_ref(), left_m) {
            Course::Go(to) => {
                let path = self.steering.ahead(to, left_m - distance(at, to));
                self.go((to, path), VehicleMode::Survey, ModeReason::Survey);
            }
            Course::UsedUp => self.go_home(at, self.failsafe.tighter()),
            Course::There => self.stay(VehicleMode::Hold, ModeReason::NoPath),
            Course::NoWay => self.stay(VehicleMode::Hold, ModeReason::NoPath),
        }
    }

    fn go_home(&mut self, at: Point, why: ModeReason) {
        let is_on_way = self.course.mode == VehicleMode::Return && self.course.motion == Motion::Going;
        if is_on_way && self.waypoint.is_some_and(|w| !self.is_reached(w)) {
            return;
        }
        match self.steering.next_home(at) {
            Course::Go(to) => self.go((to, self.steering.ahead_home(to)), VehicleMode::Return, why),
            Course::NoWay => self.stay(VehicleMode::Hold, ModeReason::NoPath),
            Course::There | Course::UsedUp => self.stay(VehicleMode::Hold, why),
        }
    }

    /// Goes to a place of the world; the host goes by the vehicle's own reckoning.
    fn go(&mut self, (to, path): (Point, PathAhead), mode: VehicleMode, reason: ModeReason) {
        self.course = Doing { motion: Motion::Going, mode, reason, ..self.course };
        let to_map = |(east_m, north_m)| self.navigator.to_map(WorldPoint { east_m, north_m });
        let waypoint = to_map(to);
        let points = path.points.into_iter().map(to_map).collect();
        (self.waypoint, self.path) = (Some(waypoint), PlannedPath { points, continues: path.continues });
        self.outputs.push_back(VehicleOutput::Waypoint(waypoint));
    }

    fn stay(&mut self, mode: VehicleMode, reason: ModeReason) {
        let mode = if self.failsafe.order.abort { VehicleMode::Abort } else { mode };
        if self.course.motion != Motion::Still {
            self.outputs.push_back(VehicleOutput::Hold);
        }
        self.course = Doing { motion: Motion::Still, mode, reason, ..self.course };
        self.forget_way();
    }

    fn come_up(&mut self, reason: ModeReason) {
        if self.course.motion != Motion::Rising {
            self.outputs.push_back(VehicleOutput::Surface);
        }
        self.course = Doing { motion: Motion::Rising, mode: VehicleMode::Surface, reason, was_in_band: false };
        self.forget_way();
    }

    fn forget_way(&mut self) {
        (self.waypoint, self.path) = (None, PlannedPath::default());
    }

    /// The operator has decided anew: the way is chosen afresh.
    pub(super) fn reconsider(&mut self) {
        self.forget_way();
        self.steering.replan();
    }

    /// The survey is over: stay, and keep telling.
    pub fn finish_survey(&mut self) {
        self.done = true;
        self.forget_way();
        self.course = Doing { motion: Motion::Still, mode: VehicleMode::Done, ..Doing::default() };
        self.outputs.push_back(VehicleOutput::Hold);
    }

    /// What the vehicle does, and why.
    pub fn mode(&self) -> (VehicleMode, ModeReason) {
        (self.course.mode, self.course.reason)
    }

    pub(super) fn status(&self, now: Instant) -> VehicleStatus {
        VehicleStatus {
            mode: self.course.mode,
            reason: self.course.reason,
            autopilot_silent: self.autopilot_silent,
            position: self.navigator.position(),
            depth_m: self.navigator.depth_m(),
            heading_deg: self.navigator.heading_rad().to_degrees().rem_euclid(360.0),
            sigma_m: self.navigator.sigma_m(),
            fix_age_s: self.navigator.last_fix().map(|at| now.since(at).as_secs_f64()),
            waypoint: self.waypoint,
            path: self.path.clone(),
            epoch: self.durable.epoch,
            labels: self.labels,
            explored_cells: self.explored,
            placement: self.navigator.placement(),
            ..VehicleStatus::default()
        }
    }
}
