//! The surface vehicle at anchor: GPS, compass and USBL head, whose measurements the relay fuses into fixes.

use crate::instruments::{Instruments, Receiver};
use scenecast_config::Config;
use scenecast_core::LatLon;
use scenecast_core::gps::GpsLanguage;
use scenecast_protocol::time::Instant;
use scenecast_surface::position::{Mounting, Relay, RelayConfig, UsblSighting};
use sim_channel::NodePosition;
use sim_channel::usbl::{UsblConfig, UsblFix, UsblHead};
use std::time::Duration;

/// Origin of a rehearsal that does not set one: equator and first meridian.
const NOWHERE: LatLon = LatLon { lat_deg: 0.0, lon_deg: 0.0 };
/// Depth of the head, metres.
pub(super) const HEAD_M: f64 = 1.0;
/// Share of a fix's standard deviation for the receiver's noise, and for its slow error; the rest is the head's.
const GPS_PART: f64 = 0.4;

/// The instruments, and a sighting that the head has not reported yet.
#[derive(Debug)]
pub(super) struct Anchored {
    at: NodePosition,
    instruments: Instruments,
    head: UsblHead,
    seconds: u32,
    sighted: Option<UsblFix>,
}

impl Anchored {
    /// Creates the instruments for a head at a position, and the surface's relay.
    pub(super) fn new(config: &Config, at: NodePosition, origin: Option<LatLon>, seed: u64) -> (Self, Relay) {
        let (origin, sigma) = (origin.unwrap_or(NOWHERE), config.navigation.fix_sigma_m);
        let head_sigma = sigma * (1.0 - 2.0 * GPS_PART * GPS_PART).sqrt();
        let usbl = UsblConfig {
            range_std_m: head_sigma.min(0.1),
            angle_std_rad: head_sigma / config.channel.range_m.max(1.0),
            ..UsblConfig::default()
        };
        let receiver = Receiver { origin, sigma_m: GPS_PART * sigma, hdop: 0.5, is_corrected: true };
        let relay = RelayConfig {
            origin: Some(origin),
            language: GpsLanguage::Nmea,
            mounting: Mounting { depth_m: HEAD_M, ..Mounting::default() },
            max_sigma_m: 63.0,
            period: Duration::from_secs(1),
        };
        let (instruments, head) = (Instruments::new(receiver, seed), UsblHead::new(usbl, seed));
        (Self { at, instruments, head, seconds: 0, sighted: None }, Relay::new(relay))
    }

    /// NMEA sentences of GPS and compass, to be read once a second.
    pub(super) fn report(&mut self) -> String {
        self.seconds += 1;
        self.instruments.report((self.at.x_m, self.at.y_m), 0.0, (0.0, 0.0), self.seconds)
    }

    /// The vehicle replies from its present position; the reply travels for `travel`.
    pub(super) fn range(&mut self, vehicle: &NodePosition, travel: Duration, now: Instant) {
        let mut fix = self.head.measure(&self.at, vehicle, now.into());
        fix.ready_at = fix.ready_at.saturating_add(travel);
        self.sighted = Some(fix);
    }

    /// The sighting whose report is due now.
    pub(super) fn poll_sighting(&mut self, now: Instant) -> Option<UsblSighting> {
        let fix = self.sighted.take_if(|f| Instant::from(f.ready_at) <= now)?;
        Some(UsblSighting {
            range_m: fix.range_m,
            bearing_rad: fix.bearing_rad,
            elevation_rad: fix.elevation_rad,
            accuracy_m: fix.accuracy_m,
            age_s: now.since(Instant::from(fix.measured_at)).as_secs_f64(),
        })
    }
}
