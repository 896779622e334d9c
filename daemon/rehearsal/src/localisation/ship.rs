//! The surface vehicle of a rehearsed localisation: its instruments, its relay, and its way above the vehicle.

use crate::instruments::{Instruments, Receiver};
use scenecast_core::LatLon;
use scenecast_core::gps::GpsLanguage;
use scenecast_protocol::directive::Fix;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::position::{Follow, Mounting, Relay, RelayConfig, UsblSighting};
use std::time::Duration;

/// Where the rehearsal lies; any place would do.
const ORIGIN: LatLon = LatLon { lat_deg: 29.5, lon_deg: 34.92 };
const SPEED_M_S: f64 = 1.5;
/// A plain receiver.
const RECEIVER: Receiver = Receiver { origin: ORIGIN, sigma_m: 1.0, hdop: 0.9, is_corrected: false };

pub(super) struct Ship {
    pub(super) at: (f64, f64),
    pub(super) relay: Relay,
    follow: Follow,
    target: (f64, f64),
    heading_rad: f64,
    instruments: Instruments,
    /// By how much the receiver is led astray, and for how many seconds more.
    astray: ((f64, f64), u32),
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
        let (off, left) = self.astray;
        self.astray.1 = left.saturating_sub(1);
        let off = if left == 0 { (0.0, 0.0) } else { off };
        let said = self.instruments.report(self.at, self.heading_rad, off, second);
        self.relay.handle_gps(said.as_bytes(), now);
    }

    /// The head told where it sees the vehicle, which says how deep it is.
    pub(super) fn sight(&mut self, sighting: &UsblSighting, depth_m: f64, now: Instant) -> Option<Fix> {
        self.relay.handle_depth(Self::vehicle(), depth_m, now);
        self.relay.handle_usbl(Self::vehicle(), sighting, now).ok().flatten()
    }
}
