//! `scenecast auv`

use super::clock::Clock;
use super::durable::{Keeper, Run};
use super::flight::Flight;
use super::journal::Folder;
use super::mapping::{Camera, FromMapper, MapperThread, Seen, ToMapper};
use super::modem::Modem;
use super::pilot::SimulatedAutopilot;
use super::refusals::{Refusals, warn_without_key};
use super::reload::{Load, Reload};
use super::restore::{Start, start};
use super::stop::Stop;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_drivers::modem::ModemEvent;
use scenecast_files::Recording;
use scenecast_protocol::directive::Budget;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_vehicle::{Vehicle, VehicleOutput};
use std::path::Path;

/// Runs the vehicle until it is interrupted; SIGHUP has it `load` budget and shares again.
pub fn run_vehicle(load: Load, simulated: Option<SimulatedAutopilot>) -> Result<(), UserError> {
    super::block_on(async move {
        let stop = Stop::new()?;
        let config = load()?;
        warn_without_key(&config);
        let dir = Path::new(&config.runtime.state_dir);
        let Start { run, mut mapper, keep } = start(&config, dir)?;
        let Run { keeper, durable, is_again } = run;
        let clock = Clock::new(config.runtime.time_scale);
        let address = scenecast_config::vehicle_address(&config)?;
        let profile = scenecast_drivers::modem::modem_of_process(&config, address)?;
        let recording = match config.camera.source.as_str() {
            "" => None,
            source => Some(Recording::open(Recording::folder(source)?, config.camera.metres_per_pixel)?),
        };
        let area = survey_area(&config, recording.as_ref())?;
        let mut vehicle = scenecast_vehicle::assemble(
            &config,
            scenecast_config::authenticity(&config)?,
            profile,
            area,
            durable,
            super::random_bits(),
            clock.now(),
        )?;
        if is_again {
            vehicle.assume_budget_spent(clock.now());
        }
        let at_end = recording.is_some();
        let camera = Camera::new(recording, clock, mapper.last_s());
        mapper.tune(vehicle.settings());
        let mapper = MapperThread::start(mapper, keep)?;
        let modem = super::modem::open(&config, address, profile, clock).await?;
        let (reload, refusals) = (Reload::new(load)?, Refusals::default());
        let flight = Flight::open(&config, simulated, clock)?;
        let (behind, missed) = (0, 0);
        let host =
            Host { vehicle, camera, mapper, modem, clock, keeper, reload, refusals, flight, at_end, behind, missed };
        host.run(stop).await
    })
}

fn survey_area(config: &Config, recording: Option<&Recording>) -> Result<Area, UserError> {
    let area = scenecast_config::survey_area(config).or_else(|| recording.map(Recording::area));
    let missing = "survey.area_m: set the west, south, east and north limits of the survey";
    area.ok_or_else(|| UserError::Input(missing.to_owned()))
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
    /// Camera frames that could not be read.
    missed: u64,
}

impl Host {
    async fn run(mut self, mut stop: Stop) -> Result<(), UserError> {
        loop {
            self.pump()?;
            let wake = self.vehicle.poll_timeout().map(|(at, _)| at).filter(|&at| at > self.clock.now());
            let wake = wake.unwrap_or_else(|| self.clock.now() + std::time::Duration::from_secs(1));
            tokio::select! {
                () = stop.asked() => {
                    self.modem.log_audit();
                    self.mapper.finish();
                    return Ok(());
                }
                _ = tokio::time::sleep_until(self.clock.wall(wake)) => {}
                event = self.modem.next() => self.handle_modem(event?),
                config = self.reload.next() => self.follow(&config),
                () = self.flight.next() => self.flight.steer(&mut self.vehicle),
                mut frame = self.camera.next() => {
                    self.behind += 1;
                    self.flight.place_camera(&self.vehicle, &mut frame);
                    let _ = self.mapper.orders.send(ToMapper::Frame(Box::new(frame)));
                }
                seen = self.mapper.seen.recv() => match seen {
                    Some(FromMapper::Seen(seen)) => self.handle_seen(seen),
                    Some(FromMapper::Missed(problem)) => self.handle_missed(&problem),
                    None => return Err(UserError::Failed("the scene model's thread ended".to_owned())),
                },
            }
        }
    }

    fn handle_modem(&mut self, event: ModemEvent) {
        let now = self.clock.now();
        match event {
            ModemEvent::Sent => self.vehicle.handle_transmit_outcome(now),
            ModemEvent::Received(bytes) => {
                self.vehicle.handle_frame(&bytes, now);
                self.refusals.note(self.vehicle.stats());
            }
            ModemEvent::Poll(frames) => self.vehicle.handle_poll(frames),
            ModemEvent::Repeated(bits) => self.vehicle.handle_repeated(bits, now),
            ModemEvent::Fix(..) | ModemEvent::Ready | ModemEvent::Lost | ModemEvent::Refused(_) => {}
        }
    }

    /// Budget and shares of the configuration are in force, whatever the surface said before.
    fn follow(&mut self, config: &Config) {
        let background = scenecast_config::background(config);
        let budget = Budget { bits_per_s: config.link.budget_bps, shares: Shares(config.link.shares), background };
        let streams = budget.background.names().join(", ");
        tracing::info!("SIGHUP: budget {} bit/s, shares {:?} %, then {streams}", budget.bits_per_s, budget.shares.0);
        self.vehicle.set_budget(budget, self.clock.now());
    }

    fn handle_seen(&mut self, seen: Seen) {
        let now = self.clock.now();
        if let Some(f) = &seen.frame {
            self.behind -= 1;
            if !self.flight.is_piloted() {
                self.vehicle.set_pose(f.x_m, f.y_m, f.heading_rad, f.depth_m, now);
            }
        }
        self.vehicle.handle_map(&seen.update, now);
        self.vehicle.handle_exemplars(seen.exemplars);
        self.finish_at_end();
    }

    /// One bad frame does not end a mission.
    fn handle_missed(&mut self, problem: &UserError) {
        self.behind -= 1;
        self.missed += 1;
        tracing::error!("a camera frame was passed over, {} so far: {problem}", self.missed);
        self.finish_at_end();
    }

    fn finish_at_end(&mut self) {
        if self.at_end && self.behind == 0 && self.camera.is_over() {
            self.at_end = false;
            tracing::info!("the recorded mission has ended");
            self.vehicle.finish_survey();
            let _ = self.mapper.orders.send(ToMapper::Keep);
        }
    }

    fn pump(&mut self) -> Result<(), UserError> {
        let now: Instant = self.clock.now();
        self.vehicle.steer(now);
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Persist => {
                    self.keeper.save(self.vehicle.durable())?;
                    self.vehicle.handle_persisted();
                }
                VehicleOutput::Tune(settings) => {
                    let _ = self.mapper.orders.send(ToMapper::Tune(settings));
                }
                VehicleOutput::Applied(a) => tracing::info!("{} {}: {:?}", a.id.name(), a.version, a.state),
                VehicleOutput::Waypoint(at) => {
                    self.flight.set_rising(false);
                    tracing::info!("waypoint {:.1} m east, {:.1} m north", at.x_m, at.y_m);
                }
                VehicleOutput::Hold => {
                    self.flight.set_rising(false);
                    tracing::info!("hold");
                }
                VehicleOutput::Fixed(fix, _) => {
                    tracing::debug!(
                        "fix: {:.1} m east, {:.1} m north, +-{:.1} m",
                        fix.position.east_m,
                        fix.position.north_m,
                        fix.sigma_m
                    );
                }
                VehicleOutput::Surface => {
                    self.flight.set_rising(true);
                    tracing::info!("come up");
                }
            }
        }
        self.modem.set_budget(self.vehicle.budget_bps());
        while self.modem.takes_frames()
            && let Some(transmit) = self.vehicle.poll_transmit(now)
        {
            self.modem.send(transmit);
        }
        Ok(())
    }
}
