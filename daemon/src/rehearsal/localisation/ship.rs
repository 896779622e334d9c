//! The surface vehicle of a rehearsed localisation: its GPS, its compass, its relay, and its way above the vehicle.

use crate::asv::position::{
    Follow, GpsLanguage, LatLon, Mounting, Relay, RelayConfig, TangentPlane, UsblSighting, nmea,
};
use scenecast_protocol::directive::Fix;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use sim_channel::Stream;
use std::time::Duration;

/// Where the rehearsal lies; any place would do.
const ORIGIN: LatLon = LatLon { lat_deg: 29.5, lon_deg: 34.92 };
const SPEED_M_S: f64 = 1.5;
/// White noise of the receiver, metres; beside it an error of as much that changes over minutes.
const GPS_SIGMA_M: f64 = 1.0;
/// Standard deviation of the compass, degrees.
const COMPASS_SIGMA_DEG: f64 = 0.5;

pub(super) struct Ship {
    pub(super) at: (f64, f64),
    pub(super) relay: Relay,
    follow: Follow,
    target: (f64, f64),
    heading_rad: f64,
    plane: TangentPlane,
    dice: Stream,
    slow_error: (f64, f64),
    /// By how much the receiver is led astray, and for how many seconds more.
    astray: ((f64, f64), u32),
}

impl Ship {
    pub(super) fn new(seed: u64) -> Self {
        let config = RelayConfig {
            origin: Some(ORIGIN),
            language: GpsLanguage::Nmea,
            mounting: Mounting::default(),
            most_sigma_m: 50.0,
            period: Duration::from_secs(1),
        };
        Self {
            at: (0.0, -40.0),
            relay: Relay::new(config),
            follow: Follow::new(40.0, 20.0),
            target: (0.0, -40.0),
            heading_rad: 0.0,
            plane: TangentPlane::new(ORIGIN),
            dice: Stream::new(seed, &[9]),
            slow_error: (0.0, 0.0),
            astray: ((0.0, 0.0), 0),
        }
    }

    fn vehicle() -> Address {
        Address::vehicle(1).unwrap_or(Address::SURFACE)
    }

    /// Echoes of a crane or a quay lead the receiver astray for five seconds.
    pub(super) fn lead_astray(&mut self, direction: f64, distance: f64) {
        let (sin, cos) = (direction * std::f64::consts::TAU).sin_cos();
        let off = 15.0 + 85.0 * distance;
        self.astray = ((off * sin, off * cos), 5);
    }

    /// One second of way, and what the receiver and the compass say after it.
    pub(super) fn step(&mut self, second: u32, now: Instant) {
        let (dx, dy) = (self.target.0 - self.at.0, self.target.1 - self.at.1);
        let distance = dx.hypot(dy);
        let way = distance.min(SPEED_M_S);
        if distance > 1.0 {
            self.heading_rad = dx.atan2(dy).rem_euclid(std::f64::consts::TAU);
            self.at = (self.at.0 + dx / distance * way, self.at.1 + dy / distance * way);
        }
        self.tell(second, now);
        if let (Some(own), Some((seen, velocity))) = (self.relay.own(now), self.relay.vehicle(Self::vehicle(), now)) {
            self.target = self.follow.next((own.x_m, own.y_m), (seen.x_m, seen.y_m), velocity).unwrap_or(self.target);
        }
    }

    fn tell(&mut self, second: u32, now: Instant) {
        let [a, b, c, d, e] = [(); 5].map(|()| self.dice.normal());
        let slow = |error: f64, draw: f64| error * 0.99 + GPS_SIGMA_M * 0.14 * draw;
        self.slow_error = (slow(self.slow_error.0, a), slow(self.slow_error.1, b));
        let ((mut off_x, mut off_y), left) = self.astray;
        if left == 0 {
            (off_x, off_y) = (0.0, 0.0);
        }
        self.astray.1 = left.saturating_sub(1);
        let x = self.at.0 + self.slow_error.0 + GPS_SIGMA_M * c + off_x;
        let y = self.at.1 + self.slow_error.1 + GPS_SIGMA_M * d + off_y;
        let place = nmea::place_fields(self.plane.to_place(x, y));
        let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
        let gga = nmea::line(&format!("GPGGA,{h:02}{m:02}{s:02}.00,{place},1,09,0.9,0.0,M,0.0,M,,"));
        let heading = (self.heading_rad.to_degrees() + COMPASS_SIGMA_DEG * e).rem_euclid(360.0);
        let hdt = nmea::line(&format!("HEHDT,{heading:.2},T"));
        self.relay.handle_gps((gga + &hdt).as_bytes(), now);
    }

    /// The head told where it sees the vehicle, which says how deep it is.
    pub(super) fn sight(&mut self, sighting: &UsblSighting, depth_m: f64, now: Instant) -> Option<Fix> {
        self.relay.handle_depth(Self::vehicle(), depth_m, now);
        self.relay.handle_usbl(Self::vehicle(), sighting, now).ok().flatten()
    }
}
