//! An autopilot at its port.

use super::clock::Clock;
use scenecast_drivers::autopilot::mavlink::MavlinkConfig;
use scenecast_drivers::autopilot::{Autopilot, Goal, Health, Mavlink, Nmea, Step};

use crate::port::{FromPort, Port};
use scenecast_config::{AutopilotKind, Config};
use scenecast_core::LatLon;
use scenecast_core::UserError;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Makes the autopilot of kind `rehearsal`, a simulated vehicle; builds without the simulator have none.
pub type SimulatedAutopilot = fn(&Config, Instant) -> Box<dyn Autopilot>;

/// A state machine and the port that its bytes go through, if it has one.
pub(super) struct Pilot {
    autopilot: Box<dyn Autopilot>,
    port: Option<Port>,
    clock: Clock,
    health: Health,
}

impl Pilot {
    /// The autopilot that is configured, if any.
    pub(super) fn open(
        config: &Config,
        simulated: Option<SimulatedAutopilot>,
        clock: Clock,
    ) -> Result<Option<Self>, UserError> {
        let a = &config.autopilot;
        let now = clock.now();
        let silence = Duration::from_secs_f64(a.timeout_s);
        let autopilot: Box<dyn Autopilot> = match a.kind {
            AutopilotKind::Mavlink => {
                let config = MavlinkConfig { system: a.system, arms: a.arm, silence };
                Box::new(Mavlink::new(config, now))
            }
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
        };
        let place = a.port.clone().filter(|_| a.kind != AutopilotKind::Rehearsal);
        let port = place.map(|place| Port::open_when_there("autopilot", place, None));
        let health = autopilot.health(now);
        Ok(Some(Self { autopilot, port, clock, health }))
    }

    /// Carries bytes until something has happened; safe to abandon.
    pub(super) async fn next(&mut self) {
        self.write();
        let due = self.clock.wall(self.autopilot.poll_timeout());
        let told = async {
            match &mut self.port {
                Some(port) => port.next().await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = tokio::time::sleep_until(due) => self.autopilot.handle_timeout(self.clock.now()),
            told = told => match told {
                FromPort::Open => self.autopilot.handle_open(self.clock.now()),
                FromPort::Bytes(bytes) => self.autopilot.handle_bytes(&bytes, self.clock.now()),
                FromPort::Closed => {}
            },
        }
        self.write();
        self.tell();
    }

    fn write(&mut self) {
        while let Some(bytes) = self.autopilot.poll_output() {
            if let Some(port) = &self.port {
                port.write(bytes);
            }
        }
    }

    fn tell(&mut self) {
        while let Some(note) = self.autopilot.poll_note() {
            tracing::info!("autopilot: {note}");
        }
        let health = self.health();
        if std::mem::replace(&mut self.health, health) != health {
            tracing::info!("autopilot: {}; {}", health.name(), self.counters());
        }
    }

    /// How it does.
    pub(super) fn health(&self) -> Health {
        self.autopilot.health(self.clock.now())
    }

    /// What happened so far, for people.
    pub(super) fn counters(&self) -> String {
        let counters = self.autopilot.counters();
        let all: Vec<String> = counters.iter().map(|(what, n)| format!("{what} {n}")).collect();
        if all.is_empty() { "nothing yet".to_owned() } else { all.join(", ") }
    }

    /// The next stretch of way.
    pub(super) fn poll_step(&mut self) -> Option<Step> {
        self.autopilot.poll_step()
    }

    /// Go there; `None`: stay.
    pub(super) fn set_goal(&mut self, goal: Option<Goal>) {
        self.autopilot.set_goal(goal, self.clock.now());
    }

    /// Where on the Earth the vehicle is.
    pub(super) fn handle_place(&mut self, place: LatLon, sigma_m: f64) {
        self.autopilot.handle_place(place, sigma_m, self.clock.now());
    }
}

/// Something happened at the autopilot; never without one.
pub(super) async fn next_of(pilot: &mut Option<Pilot>) {
    match pilot {
        Some(pilot) => pilot.next().await,
        None => std::future::pending().await,
    }
}
