//! The host of the surface: role, modem and the surface vehicle's autopilot.

use crate::link_host::{FrameEvent, FrameOutcome, LinkHost};
use crate::pilot::{Pilot, PilotEvent};
use scenecast_drivers::autopilot::{Autopilot, Goal};
use scenecast_drivers::modem::Station;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::position::{Follow, UsblSighting};
use scenecast_surface::{Surface, SurfaceOutput};
use std::collections::VecDeque;

/// Requests and events of a surface's host.
#[derive(Debug, Clone, PartialEq)]
pub enum SurfaceHostEvent {
    Role(SurfaceOutput),
    /// A new target of the surface vehicle, metres east and north in the world frame.
    Following(f64, f64),
    /// An event of frames or modem.
    Frame(FrameEvent),
    Pilot(PilotEvent),
}

/// The autopilot of the surface vehicle, which follows a vehicle.
pub struct Follower {
    pilot: Pilot,
    /// `None` if the surface vehicle keeps its position.
    follow: Option<Follow>,
    vehicle: Address,
    target: Option<(f64, f64)>,
}

impl Follower {
    /// An autopilot that stays above `vehicle`, if it is to follow.
    pub fn new(autopilot: Box<dyn Autopilot>, follow: Option<Follow>, vehicle: Address, now: Instant) -> Self {
        Self { pilot: Pilot::new(autopilot, now), follow, vehicle, target: None }
    }

    /// Follows the vehicle by the position that the USBL head measures, or else by the one that the vehicle reports.
    /// Returns a target if it changed.
    fn sail(&mut self, surface: &Surface, now: Instant) -> Option<(f64, f64)> {
        let autopilot = &mut self.pilot.autopilot;
        while autopilot.poll_step().is_some() {}
        let (Some(follow), Some(relay)) = (&mut self.follow, surface.relay()) else { return None };
        let own = relay.own(now).map(|e| (e.x_m, e.y_m));
        let seen = relay.vehicle(self.vehicle, now).map(|(e, velocity)| ((e.x_m, e.y_m), velocity));
        let seen = seen.or_else(|| surface.vehicle_in_world(self.vehicle).map(|at| (at, (0.0, 0.0))));
        let Some(own) = own else {
            // Without its own position the surface vehicle stays where it is.
            autopilot.set_goal(None, now);
            return None;
        };
        let news = seen.and_then(|(at, velocity)| follow.next(own, at, velocity));
        self.target = news.or(self.target);
        let goal = self.target.map(|(x, y)| Goal {
            east_m: x - own.0,
            north_m: y - own.1,
            depth_m: Some(0.0),
            place: relay.plane().map(|plane| plane.to_place(x, y)),
        });
        autopilot.set_goal(goal, now);
        news
    }
}

/// The surface's role with its modem, its instruments and its autopilot.
pub struct SurfaceHost {
    link: LinkHost<Surface>,
    follower: Option<Follower>,
    events: VecDeque<SurfaceHostEvent>,
}

impl SurfaceHost {
    /// Joins the surface's role with its modem.
    pub fn new(surface: Surface, station: Station, follower: Option<Follower>) -> Self {
        Self { link: LinkHost::new(surface, station), follower, events: VecDeque::new() }
    }

    pub fn surface(&self) -> &Surface {
        self.link.end()
    }

    /// The role, for the operator's orders.
    pub fn surface_mut(&mut self) -> &mut Surface {
        self.link.end_mut()
    }

    /// The link's host, for the account of bits and the port.
    pub fn link(&self) -> &LinkHost<Surface> {
        &self.link
    }

    /// The link's host, to report on the modem's port.
    pub fn link_mut(&mut self) -> &mut LinkHost<Surface> {
        &mut self.link
    }

    /// The connection to the GPS was opened. Returns the first bytes to send.
    pub fn handle_gps_open(&mut self) -> &'static [u8] {
        self.surface_mut().handle_gps_open()
    }

    /// Takes bytes of the GPS.
    pub fn handle_gps(&mut self, bytes: &[u8], now: Instant) {
        self.surface_mut().handle_gps(bytes, now);
    }

    /// Takes bytes of a compass beside the GPS.
    pub fn handle_compass(&mut self, bytes: &[u8], now: Instant) {
        self.surface_mut().handle_compass(bytes, now);
    }

    /// Takes a position that a USBL head outside of the modem measured.
    pub fn handle_usbl(&mut self, vehicle: Address, sighting: &UsblSighting, now: Instant) {
        self.surface_mut().handle_usbl(vehicle, sighting, now);
    }

    /// The autopilot's port was opened.
    pub fn handle_pilot_open(&mut self, now: Instant) {
        self.follower.iter_mut().for_each(|f| f.pilot.handle_open(now));
        self.sail(now);
    }

    /// Takes bytes of the autopilot's port, in pieces of any size.
    pub fn handle_pilot_bytes(&mut self, bytes: &[u8], now: Instant) -> FrameOutcome {
        let outcome = self.follower.as_mut().map_or(FrameOutcome::Dropped, |f| f.pilot.handle_bytes(bytes, now));
        self.sail(now);
        outcome
    }

    /// Lets time pass in the modem's driver and in the autopilot.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.link.handle_timeout(now);
        if self.follower.as_mut().is_some_and(|f| f.pilot.handle_timeout(now)) {
            self.sail(now);
        }
    }

    fn sail(&mut self, now: Instant) {
        let Self { link, follower, events } = self;
        let target = follower.as_mut().and_then(|f| f.sail(link.end(), now));
        events.extend(target.map(|(x, y)| SurfaceHostEvent::Following(x, y)));
    }

    /// The time at which [`Self::handle_timeout`] is due or output should be polled again.
    pub fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        let pilot = self.follower.as_ref().map(|f| f.pilot.autopilot.poll_timeout());
        self.link.poll_timeout(now).into_iter().chain(pilot).min()
    }

    /// The next request or event.
    pub fn poll_event(&mut self) -> Option<SurfaceHostEvent> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        if let Some(output) = self.link.end_mut().poll_output() {
            return Some(SurfaceHostEvent::Role(output));
        }
        if let Some(event) = self.link.poll_event() {
            return Some(SurfaceHostEvent::Frame(event));
        }
        self.follower.as_mut()?.pilot.poll_event().map(SurfaceHostEvent::Pilot)
    }

    /// The next bytes for the modem's port.
    pub fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.link.poll_output(now)
    }

    /// The next bytes for the autopilot's port.
    pub fn poll_pilot_output(&mut self) -> Option<Vec<u8>> {
        self.follower.as_mut()?.pilot.autopilot.poll_output()
    }
}
