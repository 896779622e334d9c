//! The configured autopilot and its port.

use crate::port::{FromPort, Port};
use scenecast_config::{AutopilotKind, Config, NavigationSource, survey_depth_m};
use scenecast_core::{TangentPlane, UserError};
use scenecast_drivers::autopilot::mavlink::MavlinkConfig;
use scenecast_drivers::autopilot::{Autopilot, Mavlink, Nmea};
use scenecast_host::{Follower, FrameOutcome, PilotEvent, VehiclePilot};
use scenecast_protocol::time::Instant;
use scenecast_surface::position::Follow;
use std::net::SocketAddr;
use std::time::Duration;

/// Makes the autopilot of kind `rehearsal`, a simulated vehicle; builds without the simulator have none.
pub type SimulatedAutopilot = fn(&Config, Instant) -> Box<dyn Autopilot>;

/// The configured autopilot, if there is one.
fn autopilot(
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

/// The configured autopilot of a vehicle with the frames in which it is told where to go, if there is one.
pub(super) fn of_vehicle(
    config: &Config,
    simulated: Option<SimulatedAutopilot>,
    now: Instant,
) -> Result<Option<VehiclePilot>, UserError> {
    let plane = config.mission.origin_deg.map(TangentPlane::new);
    let measures = config.navigation.source == NavigationSource::Autopilot;
    let depth_m = survey_depth_m(config);
    let pilot = autopilot(config, simulated, now)?;
    Ok(pilot.map(|pilot| VehiclePilot::new(pilot, plane, depth_m, now).measuring(measures)))
}

/// The configured autopilot of a surface, which follows the vehicle, if there is one.
pub(super) fn of_surface(
    config: &Config,
    simulated: Option<SimulatedAutopilot>,
    now: Instant,
) -> Result<Option<Follower>, UserError> {
    let vehicle = scenecast_config::vehicle_address(config)?;
    let p = &config.position;
    let follow = p.follow.then(|| Follow::new(p.stand_off_m, p.dead_band_m));
    let pilot = autopilot(config, simulated, now)?;
    Ok(pilot.map(|pilot| Follower::new(pilot, follow, vehicle, now)))
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
        // Over UDP, a camera or a ground station may speak before the autopilot.
        let open = match a.kind {
            AutopilotKind::Mavlink => Port::open_judged_when_there,
            _ => |name, place| Port::open_when_there(name, place, None),
        };
        Self { port: port.map(|port| open("autopilot", port)) }
    }

    /// Reports whether the sender of a datagram is the autopilot.
    pub(super) fn judge(&self, sender: SocketAddr, outcome: FrameOutcome) {
        self.port.iter().for_each(|port| port.judge(sender, outcome));
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
