//! GPS, compass and autopilot of the surface vehicle.

use super::clock::Clock;
use super::pilot::{Pilot, SimulatedAutopilot, next_of};
use crate::port::{FromPort, Port};
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_core::gps::GpsLanguage;
use scenecast_drivers::autopilot::Goal;
use scenecast_protocol::wire::Address;
use scenecast_surface::Surface;
use scenecast_surface::position::{Follow, Mounting, Relay, RelayConfig};
use std::time::Duration;

/// Speed of sound that modems reckon with, m/s.
const MODEM_SOUND_M_S: f64 = 1500.0;
/// A receiver that says nothing for so long is opened again.
const QUIET: Duration = Duration::from_secs(15);

/// The instruments of the surface vehicle.
pub(super) struct Position {
    gps: Option<Port>,
    compass: Option<Port>,
    pilot: Option<Pilot>,
    follow: Option<Follow>,
    target: Option<(f64, f64)>,
    clock: Clock,
}

/// What an instrument told.
enum Told {
    Gps(FromPort),
    Compass(FromPort),
    Pilot,
}

impl Position {
    /// Opens what is configured, and gives the surface its relay.
    pub(super) fn open(
        config: &Config,
        surface: &mut Surface,
        simulated: Option<SimulatedAutopilot>,
        clock: Clock,
    ) -> Result<Self, UserError> {
        let p = &config.position;
        if let Some(gps) = &p.gps {
            surface.set_relay(Relay::new(relay_config(config, gps.language)));
        }
        Ok(Self {
            gps: p.gps.clone().map(|gps| Port::open_when_there("GPS", gps.address, Some(QUIET))),
            compass: p.compass.clone().map(|place| Port::open_when_there("compass", place, Some(QUIET))),
            pilot: Pilot::open(config, simulated, clock)?,
            follow: p.follow.then(|| Follow::new(p.stand_off_m, p.dead_band_m)),
            target: None,
            clock,
        })
    }

    /// Takes what the instruments tell into the surface, once; safe to abandon.
    pub(super) async fn next(&mut self, surface: &mut Surface, vehicle: Address) {
        let told = tokio::select! {
            told = next_of_port(&mut self.gps) => Told::Gps(told),
            told = next_of_port(&mut self.compass) => Told::Compass(told),
            () = next_of(&mut self.pilot) => Told::Pilot,
        };
        let now = self.clock.now();
        match told {
            Told::Gps(FromPort::Bytes(bytes)) => surface.handle_gps(&bytes, now),
            Told::Gps(FromPort::Open) => {
                let hello = surface.handle_gps_open();
                if let (false, Some(gps)) = (hello.is_empty(), &self.gps) {
                    gps.write(hello.to_vec());
                }
            }
            Told::Compass(FromPort::Bytes(bytes)) => surface.handle_compass(&bytes, now),
            Told::Gps(FromPort::Closed) | Told::Compass(_) => {}
            Told::Pilot => self.steer(surface, vehicle),
        }
    }

    /// Above the vehicle, by what the head sees of it or by what it says itself.
    fn steer(&mut self, surface: &Surface, vehicle: Address) {
        let Some(pilot) = &mut self.pilot else { return };
        while pilot.poll_step().is_some() {}
        let (Some(follow), Some(relay)) = (&mut self.follow, surface.relay()) else { return };
        let now = self.clock.now();
        let own = relay.own(now).map(|e| (e.x_m, e.y_m));
        let seen = relay.vehicle(vehicle, now).map(|(e, velocity)| ((e.x_m, e.y_m), velocity));
        let seen = seen.or_else(|| surface.vehicle_in_world(vehicle).map(|at| (at, (0.0, 0.0))));
        // Without a position of its own it stays where it is.
        let Some(own) = own else { return pilot.set_goal(None) };
        if let Some((at, velocity)) = seen
            && let Some(target) = follow.next(own, at, velocity)
        {
            tracing::info!("following: to {:.0} m east, {:.0} m north", target.0, target.1);
            self.target = Some(target);
        }
        let goal = self.target.map(|(x, y)| Goal {
            east_m: x - own.0,
            north_m: y - own.1,
            depth_m: Some(0.0),
            place: relay.plane().map(|plane| plane.to_place(x, y)),
        });
        pilot.set_goal(goal);
    }
}

async fn next_of_port(port: &mut Option<Port>) -> FromPort {
    match port {
        Some(port) => port.next().await,
        None => std::future::pending().await,
    }
}

fn relay_config(config: &Config, language: GpsLanguage) -> RelayConfig {
    let p = &config.position;
    let sound_ratio = if p.sound_speed_m_s > 0.0 { p.sound_speed_m_s / MODEM_SOUND_M_S } else { 1.0 };
    RelayConfig {
        origin: config.mission.origin_deg,
        language,
        mounting: Mounting {
            lever_m: p.usbl_lever_m,
            depth_m: p.usbl_depth_m,
            from_bow: p.usbl_from_bow,
            turn_rad: p.usbl_rotation_deg.to_radians(),
            sound_ratio,
        },
        most_sigma_m: p.max_sigma_m,
        period: Duration::from_secs_f64(p.fix_period_s),
    }
}
