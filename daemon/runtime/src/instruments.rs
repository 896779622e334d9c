//! GPS and compass of the surface vehicle, and the settings of the relay that they feed.

use crate::port::{FromPort, Port};
use scenecast_config::Config;
use scenecast_core::gps::GpsLanguage;
use scenecast_host::SurfaceHost;
use scenecast_protocol::time::Instant;
use scenecast_surface::position::{Mounting, Relay, RelayConfig};
use std::time::Duration;

/// Speed of sound that modems assume, m/s.
const MODEM_SOUND_M_S: f64 = 1500.0;
/// Silence of a receiver after which its port is opened again.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(15);

/// The ports of the configured instruments.
pub(super) struct Instruments {
    gps: Option<Port>,
    compass: Option<Port>,
}

/// A report of an instrument's port.
pub(super) enum FromInstrument {
    Gps(FromPort),
    Compass(FromPort),
}

impl Instruments {
    /// Opens the ports of the configured instruments.
    pub(super) fn open(config: &Config) -> Self {
        let p = &config.position;
        Self {
            gps: p.gps.clone().map(|gps| Port::open_when_there("GPS", gps.address, Some(SILENCE_TIMEOUT))),
            compass: p.compass.clone().map(|port| Port::open_when_there("compass", port, Some(SILENCE_TIMEOUT))),
        }
    }

    /// The next report of an instrument; without instruments it never returns. Cancel-safe.
    pub(super) async fn next(&mut self) -> FromInstrument {
        tokio::select! {
            report = Port::next_of(&mut self.gps) => FromInstrument::Gps(report),
            report = Port::next_of(&mut self.compass) => FromInstrument::Compass(report),
        }
    }

    /// Hands the host the report of an instrument.
    pub(super) fn handle(&self, report: FromInstrument, host: &mut SurfaceHost, now: Instant) {
        match report {
            FromInstrument::Gps(FromPort::Bytes(bytes) | FromPort::Datagram(bytes, _)) => host.handle_gps(&bytes, now),
            FromInstrument::Gps(FromPort::Open) => {
                let hello = host.handle_gps_open();
                if let (false, Some(gps)) = (hello.is_empty(), &self.gps) {
                    gps.write(hello.to_vec());
                }
            }
            FromInstrument::Compass(FromPort::Bytes(bytes) | FromPort::Datagram(bytes, _)) => {
                host.handle_compass(&bytes, now);
            }
            FromInstrument::Gps(FromPort::Closed) | FromInstrument::Compass(_) => {}
        }
    }
}

/// The relay of a surface that has a GPS.
pub(super) fn relay(config: &Config) -> Option<Relay> {
    config.position.gps.as_ref().map(|gps| Relay::new(relay_config(config, gps.language)))
}

fn relay_config(config: &Config, language: GpsLanguage) -> RelayConfig {
    let p = &config.position;
    let sound_ratio = if p.sound_speed_m_s > 0.0 { p.sound_speed_m_s / MODEM_SOUND_M_S } else { 1.0 };
    RelayConfig {
        origin: config.mission.origin_deg,
        language,
        mounting: Mounting {
            lever: p.usbl_lever_m.into(),
            depth_m: p.usbl_depth_m,
            from_bow: p.usbl_from_bow,
            turn_rad: p.usbl_rotation_deg.to_radians(),
            sound_ratio,
        },
        max_sigma_m: p.max_sigma_m,
        period: Duration::from_secs_f64(p.fix_period_s),
    }
}
