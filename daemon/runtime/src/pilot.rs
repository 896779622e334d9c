//! The configured autopilot and its port, and GPS, compass and the relay of the surface vehicle.

use crate::port::{FromPort, Port};
use scenecast_config::{AutopilotKind, Config};
use scenecast_core::UserError;
use scenecast_core::gps::GpsLanguage;
use scenecast_drivers::autopilot::mavlink::MavlinkConfig;
use scenecast_drivers::autopilot::{Autopilot, Mavlink, Nmea};
use scenecast_host::{PilotEvent, SurfaceHost};
use scenecast_protocol::time::Instant;
use scenecast_surface::position::{Mounting, Relay, RelayConfig};
use std::time::Duration;

/// Makes the autopilot of kind `rehearsal`, a simulated vehicle; builds without the simulator have none.
pub type SimulatedAutopilot = fn(&Config, Instant) -> Box<dyn Autopilot>;

/// The configured autopilot, if there is one.
pub(super) fn autopilot(
    config: &Config,
    simulated: Option<SimulatedAutopilot>,
    now: Instant,
) -> Result<Option<Box<dyn Autopilot>>, UserError> {
    let a = &config.autopilot;
    let silence = Duration::from_secs_f64(a.timeout_s);
    Ok(Some(match a.kind {
        AutopilotKind::Mavlink => {
            let component = Some(a.component).filter(|component| *component > 0);
            Box::new(Mavlink::new(MavlinkConfig { system: a.system, component, arms: a.arm, silence }, now))
        }
        AutopilotKind::Nmea => Box::new(Nmea::new(true, silence, now)),
        AutopilotKind::Log => Box::new(Nmea::new(false, silence, now)),
        AutopilotKind::Rehearsal => match simulated {
            Some(make) => make(config, now),
            None => {
                let cause = "autopilot.kind = \"rehearsal\" is not allowed: this build has no simulator";
                return Err(UserError::Input(format!("{cause}; it takes none, mavlink, nmea or log")));
            }
        },
        AutopilotKind::None => return Ok(None),
    }))
}

/// The port to an autopilot, if there is one.
pub(super) struct PilotPort {
    port: Option<Port>,
}

impl PilotPort {
    /// Opens the port of the configured autopilot.
    pub(super) fn open(config: &Config, has_autopilot: bool) -> Self {
        let a = &config.autopilot;
        let port = a.port.clone().filter(|_| has_autopilot && a.kind != AutopilotKind::Rehearsal);
        Self { port: port.map(|port| Port::open_when_there("autopilot", port, None)) }
    }

    /// The next report of the port; without a port it never returns. Cancel-safe.
    pub(super) async fn next(&mut self) -> FromPort {
        Port::next_of(&mut self.port).await
    }

    /// Refused bytes are dropped, for they would be stale when the port accepts bytes again.
    pub(super) fn write(&self, bytes: Vec<u8>) {
        if let Some(port) = &self.port {
            port.write(bytes);
        }
    }
}

/// Logs events of the autopilot.
pub(super) fn log(event: PilotEvent) {
    match event {
        PilotEvent::Note(note) => tracing::info!("autopilot: {note}"),
        PilotEvent::Health { health, counters } => tracing::info!("autopilot: {}; {counters}", health.name()),
    }
}

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
