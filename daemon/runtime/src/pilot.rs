//! The autopilot that is configured, and the port to it.

use crate::port::{FromPort, Port};
use scenecast_config::{AutopilotKind, Config};
use scenecast_core::UserError;
use scenecast_drivers::autopilot::mavlink::MavlinkConfig;
use scenecast_drivers::autopilot::{Autopilot, Mavlink, Nmea};
use scenecast_host::PilotEvent;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Makes the autopilot of kind `rehearsal`, a simulated vehicle; builds without the simulator have none.
pub type SimulatedAutopilot = fn(&Config, Instant) -> Box<dyn Autopilot>;

/// The autopilot that is configured, if any.
pub(super) fn autopilot(
    config: &Config,
    simulated: Option<SimulatedAutopilot>,
    now: Instant,
) -> Result<Option<Box<dyn Autopilot>>, UserError> {
    let a = &config.autopilot;
    let silence = Duration::from_secs_f64(a.timeout_s);
    Ok(Some(match a.kind {
        AutopilotKind::Mavlink => Box::new(Mavlink::new(MavlinkConfig { system: a.system, arms: a.arm, silence }, now)),
        AutopilotKind::Nmea => Box::new(Nmea::new(true, silence, now)),
        AutopilotKind::Log => Box::new(Nmea::new(false, silence, now)),
        AutopilotKind::Rehearsal => match simulated {
            Some(make) => make(config, now),
            None => {
                let what = "autopilot.kind = \"rehearsal\" is not allowed: this build has no simulator";
                return Err(UserError::Input(format!("{what}; it takes none, mavlink, nmea or log")));
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
    /// Opens the port that an autopilot is configured to have.
    pub(super) fn open(config: &Config, has_autopilot: bool) -> Self {
        let a = &config.autopilot;
        let port = a.port.clone().filter(|_| has_autopilot && a.kind != AutopilotKind::Rehearsal);
        Self { port: port.map(|port| Port::open_when_there("autopilot", port, None)) }
    }

    /// What the port reports next; never without one. Safe to abandon.
    pub(super) async fn next(&mut self) -> FromPort {
        Port::next_of(&mut self.port).await
    }

    /// Bytes that the port does not take are stale by the time that it would.
    pub(super) fn write(&self, bytes: Vec<u8>) {
        if let Some(port) = &self.port {
            port.write(bytes);
        }
    }
}

/// Logs news of the autopilot.
pub(super) fn log(event: PilotEvent) {
    match event {
        PilotEvent::Note(note) => tracing::info!("autopilot: {note}"),
        PilotEvent::Health { health, counters } => tracing::info!("autopilot: {}; {counters}", health.name()),
    }
}
