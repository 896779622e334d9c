//! The choice between the survey and the reactions of the failsafe, and the waypoint that follows from it.

use super::{Durable, VehicleOutput};
use crate::Navigator;
use crate::failsafe::{Failsafe, FailsafePolicy};
use crate::planning::{Point, distance};
use crate::steering::{Course, PathAhead, Steering};
use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint, WorldPoint};
use scenecast_protocol::directive::{Areas, Constraints, Fence, Limits, Reaction, Settings, Utility};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Intent, ModeReason, PlannedPath, VehicleMode};
use std::time::Duration;

/// The last request to the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Motion {
    #[default]
    Going,
    Still,
    Rising,
}

/// The present activity of the vehicle, and the reason for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Activity {
    motion: Motion,
    mode: VehicleMode,
    reason: ModeReason,
    /// Whether the vehicle was inside the depth band since it last began to move.
    was_in_band: bool,
}

/// The facts by which a waypoint is chosen.
pub(super) struct Situation<'a> {
    pub(super) navigator: &'a Navigator,
    /// The map of the scene model, and its version.
    pub(super) map: (&'a LabelGrid, u64),
    pub(super) utility: Option<&'a Utility>,
}

/// The way to a waypoint.
#[derive(Debug, Clone, Copy)]
struct Leg {
    to: MapPoint,
    /// How near to it the vehicle has come, and since when.
    nearest_m: f64,
    since: Instant,
}

impl Leg {
    /// Autopilots may end a leg this far from its end, metres.
    const NEAR_M: f64 = 2.0;
    /// A vehicle that comes no nearer for this time has ended its leg.
    const STOPPED: Duration = Duration::from_secs(10);
    /// What a position at rest may come nearer by itself, metres.
    const NOISE_M: f64 = 0.1;

    fn new(to: MapPoint, at: MapPoint, now: Instant) -> Self {
        Self { to, nearest_m: to.distance_m(at), since: now }
    }

    fn handle_position(&mut self, at: MapPoint, now: Instant) {
        if self.to.distance_m(at) < self.nearest_m - Self::NOISE_M {
            *self = Self::new(self.to, at, now);
        }
    }

    /// Whether the autopilot has ended the leg some way from the waypoint.
    fn has_ended(&self, now: Instant) -> bool {
        self.nearest_m < Self::NEAR_M && now.since(self.since) >= Self::STOPPED
    }
}

/// Decides where the vehicle goes: by the survey's plan, unless the failsafe demands a reaction.
///
/// It owns the failsafe, the planned path and the waypoint. Its owner passes the requests on to the host.
#[derive(Debug)]
pub(super) struct Guidance {
    steering: Steering,
    failsafe: Failsafe,
    activity: Activity,
    leg: Option<Leg>,
    /// The plan after the waypoint.
    path: PlannedPath,
    is_finished: bool,
}

impl Guidance {
    /// Starts with the limits, the fence and the unanswered breach of the last run. `settings` are the ordered ones.
    pub(super) fn new(
        steering: Steering,
        policy: FailsafePolicy,
        durable: &Durable,
        settings: &Settings,
        now: Instant,
    ) -> Self {
        let (failsafe, activity, path) = (Failsafe::new(policy, now), Activity::default(), PlannedPath::default());
        let mut guidance = Self { steering, failsafe, activity, leg: None, path, is_finished: false };
        let failsafe = &mut guidance.failsafe;
        failsafe.order = Constraints { hold: durable.hold, abort: durable.abort };
        if let Some(limits) = durable.limits.order() {
            failsafe.set_limits(limits);
            (failsafe.used_m, failsafe.used_s) = durable.limits.used();
        }
        if let Some(reason) = ModeReason::from_code(durable.limits.breach) {
            failsafe.handle_breach(reason);
        }
        guidance.steering.set_choices(settings.planner.value(), settings.at_end.value());
        if let Some(fence) = Fence::from_bytes(&durable.fence).filter(|f| f.check().is_ok()) {
            guidance.steering.set_fence(&fence);
        }
        if let Some(areas) = durable.goals.areas() {
            guidance.steering.set_areas(areas);
        }
        guidance.steering.set_destination(durable.goals.destination());
        guidance
    }

    pub(super) fn steering(&self) -> &Steering {
        &self.steering
    }

    pub(super) fn waypoint(&self) -> Option<MapPoint> {
        self.leg.map(|leg| leg.to)
    }

    /// The purpose of the plan while the vehicle surveys by an adaptive planner or goes to a destination.
    pub(super) fn intent(&self) -> Option<Intent> {
        self.steering.intent().filter(|_| self.activity.mode == VehicleMode::Survey)
    }

    pub(super) fn path(&self) -> &PlannedPath {
        &self.path
    }

    pub(super) fn mode(&self) -> (VehicleMode, ModeReason) {
        (self.activity.mode, self.activity.reason)
    }

    /// Metres and seconds since the limits were put in force.
    pub(super) fn used(&self) -> (f64, f64) {
        (self.failsafe.used_m, self.failsafe.used_s)
    }

    /// Whether distance or time is limited.
    pub(super) fn is_limited(&self) -> bool {
        self.failsafe.left_m().is_finite()
    }

    /// The number on the wire of the breach that the operator has not answered; 0 if there is none.
    pub(super) fn breach(&self) -> u8 {
        self.failsafe.latched as u8
    }

    /// Speed over ground that the vehicle keeps, metres a second.
    pub(super) fn speed_m_s(&self) -> f64 {
        self.failsafe.speed_m_s()
    }

    /// Counts metres against the limits.
    pub(super) fn handle_travel(&mut self, metres: f64) {
        self.failsafe.handle_travel(metres);
    }

    /// The link received a frame of the surface.
    pub(super) fn handle_received(&mut self, at: Instant) {
        self.failsafe.handle_received(at);
    }

    /// The camera saw the sea floor around `at`, in metres in the map frame, and the scene model explains
    /// each cell with a perplexity.
    pub(super) fn handle_view(&mut self, at: Point, perplexity: &[(Cell, f32)]) {
        self.steering.handle_view(at);
        perplexity.iter().for_each(|&(cell, p)| self.steering.handle_perplexity(cell, p));
    }

    /// Puts hold and abort in force, and takes the order as the operator's answer to a breach.
    pub(super) fn set_constraints(&mut self, order: Constraints) {
        self.failsafe.order = order;
        self.clear_breach();
    }

    /// Whether the vehicle keeps these limits at the depth and the altitude that it travels at.
    pub(super) fn is_able(&self, limits: &Limits, depth_m: f64) -> bool {
        self.failsafe.is_able(limits, depth_m)
    }

    /// Puts limits in force; distance and time count from zero.
    pub(super) fn set_limits(&mut self, limits: Limits) {
        self.failsafe.set_limits(limits);
        self.replan();
    }

    /// Puts a fence in force that was checked, and takes it as the operator's answer to a breach.
    pub(super) fn set_fence(&mut self, fence: &Fence) {
        self.steering.set_fence(fence);
        self.clear_breach();
    }

    /// Puts weighted areas in force that were checked.
    pub(super) fn set_areas(&mut self, areas: Areas) {
        self.steering.set_areas(areas);
        self.drop_path();
    }

    /// Whether an allowed path leads from the vehicle to a place, and enough is left of the limits for it and the return.
    pub(super) fn can_reach(&self, navigator: &Navigator, place: DecimetrePoint) -> bool {
        let at = navigator.to_world(navigator.position()).xy();
        self.steering.can_reach(at, place, self.failsafe.left_m())
    }

    /// Orders the vehicle to a place before it resumes its survey; `None` withdraws the order.
    pub(super) fn set_destination(&mut self, place: Option<DecimetrePoint>) {
        self.steering.set_destination(place);
        self.drop_path();
    }

    /// Whether the vehicle has yet to go to a destination.
    pub(super) fn has_destination(&self) -> bool {
        self.steering.has_destination()
    }

    /// Sets the planner and the end of the survey that the operator ordered.
    pub(super) fn set_choices(&mut self, settings: &Settings) {
        self.steering.set_choices(settings.planner.value(), settings.at_end.value());
        self.replan();
    }

    /// Drops waypoint and plan, so that the next one follows the latest orders.
    pub(super) fn replan(&mut self) {
        self.drop_path();
        self.steering.replan();
    }

    fn clear_breach(&mut self) {
        self.failsafe.clear_breach();
        self.replan();
    }

    fn drop_path(&mut self) {
        (self.leg, self.path) = (None, PlannedPath::default());
    }

    /// Ends the survey for good: from now on the vehicle holds.
    pub(super) fn finish(&mut self) -> VehicleOutput {
        self.is_finished = true;
        self.drop_path();
        self.activity = Activity { motion: Motion::Still, mode: VehicleMode::Done, ..Activity::default() };
        VehicleOutput::Hold
    }

    /// Counts time against the limits. Returns whether the survey goes on.
    pub(super) fn handle_time(&mut self, now: Instant) -> bool {
        self.failsafe.handle_time(now);
        !self.is_finished
    }

    /// Chooses a waypoint if there is none or the last one is reached, or carries out the reaction of the failsafe.
    pub(super) fn steer(&mut self, known: &Situation<'_>) -> Option<VehicleOutput> {
        let navigator = known.navigator;
        let at = self.follow_placement(navigator);
        if let Some(leg) = &mut self.leg {
            leg.handle_position(navigator.position(), self.failsafe.now);
        }
        self.watch(at, navigator.depth_m());
        let return_m = if self.is_limited() { self.steering.return_path_m(at) } else { 0.0 };
        match self.failsafe.stop(return_m) {
            None => self.survey(at, known),
            Some((Reaction::Hold, why)) => self.stay(VehicleMode::Hold, why),
            Some((Reaction::Surface, why)) => self.come_up(why),
            Some((Reaction::Return, why)) => self.go_back(at, why, navigator),
        }
    }

    /// The position in the world frame. A new placement of the map voids the path, because the rest of the last
    /// leg could cross an outline.
    fn follow_placement(&mut self, navigator: &Navigator) -> Point {
        let (east, north) = navigator.to_world(MapPoint::default()).xy();
        if (east, north) != self.steering.map_origin() {
            self.steering.set_placement(east, north);
            self.drop_path();
        }
        navigator.to_world(navigator.position()).xy()
    }

    fn watch(&mut self, at: Point, depth_m: f64) {
        self.failsafe.handle_position(at, self.steering.bounds().holds(at));
        let is_broken = self.failsafe.is_band_broken(depth_m);
        if is_broken && self.activity.was_in_band && self.activity.motion != Motion::Rising {
            self.failsafe.handle_breach(ModeReason::Band);
        }
        self.activity.was_in_band = (self.activity.was_in_band || !is_broken) && self.activity.motion != Motion::Rising;
    }

    /// Whether the vehicle is on its way in `mode` and has not reached its waypoint.
    fn is_under_way(&self, mode: VehicleMode, navigator: &Navigator) -> bool {
        let is_moving = self.activity.motion == Motion::Going && self.activity.mode == mode;
        let is_reached = |leg: &Leg| leg.to.distance_m(navigator.position()) < self.steering.arrival_m();
        is_moving && self.leg.is_some_and(|leg| !is_reached(&leg) && !leg.has_ended(self.failsafe.now))
    }

    /// The `next` course: from the waypoint, where the autopilot has stopped beside it and the new leg is allowed, or else from here.
    fn next_course(
        &mut self,
        at: Point,
        navigator: &Navigator,
        next: impl Fn(&mut Steering, Point) -> Course,
    ) -> Course {
        if let Some(leg) = self.leg.filter(|leg| leg.has_ended(self.failsafe.now)) {
            let course = next(&mut self.steering, navigator.to_world(leg.to).xy());
            if !matches!(course, Course::Go(to) if !self.steering.bounds().allows_leg(at, to)) {
                return course;
            }
        }
        next(&mut self.steering, at)
    }

    fn survey(&mut self, at: Point, known: &Situation<'_>) -> Option<VehicleOutput> {
        if self.is_under_way(VehicleMode::Survey, known.navigator) {
            return None;
        }
        let left_m = self.failsafe.left_m();
        let course = self.next_course(at, known.navigator, |steering, from| {
            let detour = steering.next_detour(from, left_m);
            detour.unwrap_or_else(|| steering.next(from, known.map, known.utility, left_m))
        });
        match course {
            Course::Go(to) => {
                let path = match self.steering.has_destination() {
                    true => self.steering.path_after_detour(to),
                    false => self.steering.path_after(to, left_m - distance(at, to)),
                };
                Some(self.go((to, path), VehicleMode::Survey, ModeReason::Survey, known.navigator))
            }
            Course::LimitReached => self.go_back(at, self.failsafe.tighter(), known.navigator),
            Course::Arrived => self.stay(VehicleMode::Hold, ModeReason::Survey),
            Course::NoPath => self.stay(VehicleMode::Hold, ModeReason::NoPath),
        }
    }

    fn go_back(&mut self, at: Point, why: ModeReason, navigator: &Navigator) -> Option<VehicleOutput> {
        if self.is_under_way(VehicleMode::Return, navigator) {
            return None;
        }
        match self.next_course(at, navigator, Steering::next_return) {
            Course::Go(to) => {
                Some(self.go((to, self.steering.path_after_return(to)), VehicleMode::Return, why, navigator))
            }
            Course::NoPath => self.stay(VehicleMode::Hold, ModeReason::NoPath),
            Course::Arrived | Course::LimitReached => self.stay(VehicleMode::Hold, why),
        }
    }

    /// Goes to a point of the world frame. The host navigates in the map frame.
    fn go(
        &mut self,
        (to, path): (Point, PathAhead),
        mode: VehicleMode,
        reason: ModeReason,
        navigator: &Navigator,
    ) -> VehicleOutput {
        self.activity = Activity { motion: Motion::Going, mode, reason, ..self.activity };
        let to_map = |(east_m, north_m)| navigator.to_map(WorldPoint { east_m, north_m });
        let waypoint = to_map(to);
        let points = path.points.into_iter().map(to_map).collect();
        self.leg = Some(Leg::new(waypoint, navigator.position(), self.failsafe.now));
        self.path = PlannedPath { points, continues: path.continues };
        VehicleOutput::Waypoint(waypoint)
    }

    fn stay(&mut self, mode: VehicleMode, reason: ModeReason) -> Option<VehicleOutput> {
        let mode = if self.failsafe.order.abort { VehicleMode::Abort } else { mode };
        let is_new = self.activity.motion != Motion::Still;
        self.activity = Activity { motion: Motion::Still, mode, reason, ..self.activity };
        self.drop_path();
        is_new.then_some(VehicleOutput::Hold)
    }

    fn come_up(&mut self, reason: ModeReason) -> Option<VehicleOutput> {
        let is_new = self.activity.motion != Motion::Rising;
        self.activity = Activity { motion: Motion::Rising, mode: VehicleMode::Surface, reason, was_in_band: false };
        self.drop_path();
        is_new.then_some(VehicleOutput::Surface)
    }
}
