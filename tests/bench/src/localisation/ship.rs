//! The surface vehicle of a rehearsed localisation: its instruments, its relay, and its course above the vehicle.

use scenecast_core::LatLon;
use scenecast_core::gps::GpsLanguage;
use scenecast_protocol::directive::Fix;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_rehearsal::{Instruments, Receiver};
use scenecast_surface::position::{Follow, Mounting, Relay, RelayConfig, UsblSighting};
use std::time::Duration;

/// Origin of the rehearsal, an arbitrary position.
const ORIGIN: LatLon = LatLon { lat_deg: 29.5, lon_deg: 34.92 };
const SPEED_M_S: f64 = 1.5;
const RECEIVER: Receiver = Receiver { origin: ORIGIN, sigma_m: 1.0, hdop: 0.9, is_corrected: false };

pub(super) struct Ship {
    pub(super) at: (f64, f64),
    pub(super) relay: Relay,
    follow: Follow,
    target: (f64, f64),
    heading_rad: f64,
    instruments: Instruments,
    /// Error of the receiver, metres east and north, and the seconds for which it lasts.
    gps_error: ((f64, f64), u32),
}

impl Ship {
    pub(super) fn new(seed: u64) -> Self {
        let config = RelayConfig {
            origin: Some(ORIGIN),
            language: GpsLanguage::Nmea,
            mounting: Mounting::default(),
            max_sigma_m: 50.0,
            period: Duration::from_secs(1),
        };
        Self {
            at: (0.0, -40.0),
            relay: Relay::new(config),
            follow: Follow::new(40.0, 20.0),
            target: (0.0, -40.0),
            heading_rad: 0.0,
            instruments: Instruments::new(RECEIVER, seed),
            gps_error: ((0.0, 0.0), 0),
        }
    }

    fn vehicle() -> Address {
        Address::vehicle(1).unwrap_or(Address::SURFACE)
    }

    /// Adds a GPS error for five seconds, as echoes of a crane or a quay cause it.
    pub(super) fn disturb_gps(&mut self, direction: f64, distance: f64) {
        let (sin, cos) = (direction * std::f64::consts::TAU).sin_cos();
        let off = 15.0 + 85.0 * distance;
        self.gps_error = ((off * sin, off * cos), 5);
    }

    /// Moves for one second, then the receiver and the compass report.
    pub(super) fn step(&mut self, second: u32, now: Instant) {
        let (dx, dy) = (self.target.0 - self.at.0, self.target.1 - self.at.1);
        let distance = dx.hypot(dy);
        let distance_m = distance.min(SPEED_M_S);
        if distance > 1.0 {
            self.heading_rad = dx.atan2(dy).rem_euclid(std::f64::consts::TAU);
            self.at = (self.at.0 + dx / distance * distance_m, self.at.1 + dy / distance * distance_m);
        }
        self.report(second, now);
        if let (Some(own), Some((seen, velocity))) = (self.relay.own(now), self.relay.vehicle(Self::vehicle(), now)) {
            self.target = self.follow.next((own.x_m, own.y_m), (seen.x_m, seen.y_m), velocity).unwrap_or(self.target);
        }
    }

    fn report(&mut self, second: u32, now: Instant) {
        let (off, left) = self.gps_error;
        self.gps_error.1 = left.saturating_sub(1);
        let off = if left == 0 { (0.0, 0.0) } else { off };
        let sentences = self.instruments.report(self.at, self.heading_rad, off, second);
        self.relay.handle_gps(sentences.as_bytes(), now);
    }

    /// The head has measured the vehicle's position, and the vehicle has reported its depth.
    pub(super) fn sight(&mut self, sighting: &UsblSighting, depth_m: f64, now: Instant) -> Option<Fix> {
        self.relay.handle_depth(Self::vehicle(), depth_m, now);
        self.relay.handle_usbl(Self::vehicle(), sighting, now).ok().flatten()
    }
}
