//! `scenecast auv`

use super::clock::Clock;
use super::durable::Keeper;
use super::journal::Folder;
use super::mapping::{self, Camera, MapperThread, Seen, ToMapper};
use super::pilot::{Pilot, depth_m, next_of, origin};
use super::refusals::{Refusals, warn_without_key};
use super::reload::{Load, Reload};
use crate::asv::position::TangentPlane;
use crate::autopilot::Goal;
use crate::auv::{Area, Durable, Vehicle, VehicleOutput};
use crate::config::Config;
use crate::modem::{self, Modem, ModemEvent};
use crate::problem::Problem;
use crate::rehearsal::Recording;
use scenecast_protocol::directive::Budget;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use std::path::Path;

/// Runs the vehicle until it is interrupted; SIGHUP has it `load` budget and shares again.
pub fn run_vehicle(load: Load) -> Result<(), Problem> {
    super::block_on(async move {
        let config = load()?;
        warn_without_key(&config);
        let dir = Path::new(&config.runtime.state_dir);
        let folder = Folder::hold(dir).map_err(|e| Problem::file(dir, e))?;
        let (keeper, durable) = Keeper::begin_run(folder)?;
        let clock = Clock::new(config.runtime.time_scale);
        let profile = crate::ends::modem_of_process(&config);
        let recording = match config.camera.source.as_str() {
            "" => None,
            source => Some(Recording::open(Recording::folder(source)?)?),
        };
        let area = survey_area(&config, recording.as_ref())?;
        let epoch = durable.epoch;
        let is_again = durable != Durable::default();
        let mut vehicle = crate::ends::vehicle(&config, profile, area, durable, super::random_bits(), clock.now())?;
        if is_again {
            vehicle.assume_budget_spent(clock.now());
        }
        let at_end = recording.is_some();
        let camera = Camera::new(recording, clock);
        let mapper = mapping::spawn(&config, epoch)?;
        let modem = modem::open(&config, profile).await?;
        let (reload, refusals) = (Reload::new(load)?, Refusals::default());
        let flight = Flight {
            pilot: Pilot::open(&config, clock)?,
            plane: origin(&config)?.map(TangentPlane::new),
            depth_m: depth_m(&config),
        };
        Host { vehicle, camera, mapper, modem, clock, keeper, reload, refusals, flight, at_end, behind: 0 }.run().await
    })
}

fn survey_area(config: &Config, recording: Option<&Recording>) -> Result<Area, Problem> {
    let area = crate::ends::configured_area(config).or_else(|| recording.map(Recording::area));
    let missing = "survey.area_m: set the west, south, east and north limits of the survey";
    area.ok_or_else(|| Problem::Input(missing.to_owned()))
}

/// What flies the vehicle, and where its world is.
struct Flight {
    pilot: Option<Pilot>,
    plane: Option<TangentPlane>,
    /// Of the survey, metres.
    depth_m: f64,
}

struct Host {
    vehicle: Vehicle,
    camera: Camera,
    mapper: MapperThread,
    modem: Modem,
    clock: Clock,
    keeper: Keeper<Folder>,
    reload: Reload,
    refusals: Refusals,
    flight: Flight,
    /// Whether the end of the camera's frames is the end of the survey.
    at_end: bool,
    /// Camera frames that the scene model has not seen yet.
    behind: u32,
}

impl Host {
    async fn run(mut self) -> Result<(), Problem> {
        loop {
            self.pump()?;
            let wake = self.vehicle.poll_timeout().map(|(at, _)| at).filter(|&at| at > self.clock.now());
            let wake = wake.unwrap_or_else(|| self.clock.now() + std::time::Duration::from_secs(1));
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {
                    self.modem.log_audit();
                    return Ok(());
                }
                _ = tokio::time::sleep_until(self.clock.wall(wake)) => {}
                event = self.modem.next() => match event {
                    ModemEvent::Sent => self.vehicle.handle_transmit_outcome(self.clock.now()),
                    ModemEvent::Received(bytes) => {
                        self.vehicle.handle_frame(&bytes, self.clock.now());
                        self.refusals.note(self.vehicle.stats());
                    }
                },
                config = self.reload.next() => self.follow(&config),
                () = next_of(&mut self.flight.pilot) => self.handle_pilot(),
                mut frame = self.camera.next() => {
                    self.behind += 1;
                    if self.flight.pilot.is_some() {
                        // The autopilot says where the camera is, not the recording.
                        let n = self.vehicle.navigator();
                        (frame.x_m, frame.y_m) = n.position();
                        (frame.heading_rad, frame.depth_m) = (n.heading_rad(), n.depth_m());
                    }
                    let _ = self.mapper.orders.send(ToMapper::Frame(Box::new(frame)));
                }
                seen = self.mapper.seen.recv() => match seen {
                    Some(seen) => self.handle_seen(seen?),
                    None => return Err(Problem::Failed("the scene model's thread ended".to_owned())),
                },
            }
        }
    }

    /// Budget and shares of the configuration are in force, whatever the surface said before.
    fn follow(&mut self, config: &Config) {
        let budget = Budget { bits_per_s: config.link.budget_bps, shares: Shares(config.link.shares) };
        tracing::info!("SIGHUP: budget {} bit/s, shares {:?} %", budget.bits_per_s, budget.shares.0);
        self.vehicle.set_budget(budget, self.clock.now());
    }

    /// Takes the way that the autopilot tells, and tells it where to go.
    fn handle_pilot(&mut self) {
        /// Fixes that are older do not tell the autopilot where it is, seconds.
        const OLDEST_FIX_S: f64 = 60.0;
        let now = self.clock.now();
        let Some(pilot) = &mut self.flight.pilot else { return };
        while let Some(step) = pilot.poll_step() {
            self.vehicle.handle_odometry(step.dx_m, step.dy_m, step.heading_rad, step.depth_m, now);
        }
        self.vehicle.set_autopilot_silent(pilot.health().is_silent());
        let navigator = self.vehicle.navigator();
        let (x, y) = navigator.position();
        let (world_x, world_y) = navigator.world();
        let goal = self.vehicle.waypoint().map(|(to_x, to_y)| {
            let (east_m, north_m) = (to_x - x, to_y - y);
            let place = self.flight.plane.map(|plane| plane.to_place(world_x + east_m, world_y + north_m));
            Goal { east_m, north_m, depth_m: Some(self.flight.depth_m), place }
        });
        pilot.set_goal(goal);
        let is_fixed = navigator.last_fix().is_some_and(|at| now.since(at).as_secs_f64() < OLDEST_FIX_S);
        if let (true, Some(plane)) = (is_fixed, &self.flight.plane) {
            pilot.handle_place(plane.to_place(world_x, world_y), navigator.sigma_m());
        }
    }

    fn handle_seen(&mut self, seen: Seen) {
        let now = self.clock.now();
        self.behind -= 1;
        let f = &seen.frame;
        if self.flight.pilot.is_none() {
            self.vehicle.set_pose(f.x_m, f.y_m, f.heading_rad, f.depth_m, now);
        }
        self.vehicle.handle_map(&seen.update, now);
        self.vehicle.answer_requests(&|label| seen.exemplars.get(&label).map(AsRef::as_ref));
        if self.at_end && self.behind == 0 && self.camera.is_over() {
            self.at_end = false;
            tracing::info!("the recorded mission has ended");
            self.vehicle.finish_survey();
        }
    }

    fn pump(&mut self) -> Result<(), Problem> {
        let now: Instant = self.clock.now();
        self.vehicle.steer();
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Persist => {
                    self.keeper.save(self.vehicle.durable())?;
                    self.vehicle.handle_persisted();
                }
                VehicleOutput::RefineRate(rate) => {
                    let _ = self.mapper.orders.send(ToMapper::RefineRate(rate));
                }
                VehicleOutput::Applied(a) => tracing::info!("{} {}: {:?}", a.id.name(), a.version, a.state),
                VehicleOutput::Waypoint(x, y) => tracing::info!("waypoint {x:.1} m east, {y:.1} m north"),
                VehicleOutput::Hold => tracing::info!("hold"),
                VehicleOutput::Fixed(fix, _) => {
                    tracing::debug!("fix: {:.1} m east, {:.1} m north, +-{:.1} m", fix.x_m, fix.y_m, fix.sigma_m);
                }
            }
        }
        self.modem.set_budget(self.vehicle.budget_bps());
        if !self.modem.is_busy()
            && let Some(t) = self.vehicle.poll_transmit(now)
        {
            self.modem.send(t.bytes, self.clock)?;
        }
        Ok(())
    }
}
