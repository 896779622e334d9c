//! `scenecast asv`

use super::clock::Clock;
use super::journal::create_folder;
use super::modem::Modem;
use super::pilot::SimulatedAutopilot;
use super::position::Position;
use super::refusals::{Refusals, warn_without_key};
use super::stop::Stop;
use scenecast_config::Config;
use scenecast_console::{Ask, Console, LinkMeter, MissionFacts, Reply, Request, answer, bind, snapshot, start};
use scenecast_core::UserError;
use scenecast_core::label_picture;
use scenecast_core::world_file;
use scenecast_drivers::modem::ModemEvent;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{Surface, SurfaceOutput};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;

/// Runs the surface until it is interrupted.
pub fn run_surface(config: Config, simulated: Option<SimulatedAutopilot>) -> Result<(), UserError> {
    super::block_on(async move {
        let stop = Stop::new()?;
        let entrance = match &config.console.listen {
            None => None,
            Some(address) => {
                let token = scenecast_config::load_token(&config)?;
                Some(bind(address.as_str(), "console.listen", token, &config.console.host).await?)
            }
        };
        let dir = config.runtime.state_dir.clone();
        let is_again = dir.exists();
        create_folder(&dir).map_err(|e| UserError::file(&dir, e))?;
        let clock = Clock::new(config.runtime.time_scale);
        let profile = scenecast_drivers::modem::modem_of_process(&config, Address::SURFACE)?;
        warn_without_key(&config);
        let mut surface = scenecast_surface::assemble(
            &config,
            scenecast_config::authenticity(&config)?,
            scenecast_config::tuning_table(&config)?,
            profile,
            super::random_bits(),
            clock.now(),
        )?;
        if is_again {
            surface.assume_budget_spent(clock.now());
        }
        let console = entrance.zip(config.console.listen.as_ref()).map(|(entrance, address)| {
            println!("the operator's page is at http://{address} (end with Ctrl-C)");
            start(entrance)
        });
        let facts = MissionFacts::new(&config, &profile, super::random_bits(), config.runtime.time_scale);
        let meter = LinkMeter::new(Duration::from_secs_f64(config.link.budget_window_s));
        let modem = super::modem::open(&config, Address::SURFACE, profile, clock).await?;
        let position = Position::open(&config, &mut surface, simulated, clock)?;
        let vehicle = scenecast_config::vehicle_address(&config)?;
        let refusals = Refusals::default();
        Host { surface, modem, console, clock, dir, facts, meter, bits: profile, refusals, position, vehicle }
            .run(stop)
            .await
    })
}

struct Host {
    surface: Surface,
    modem: Modem,
    console: Option<Console>,
    clock: Clock,
    dir: PathBuf,
    facts: MissionFacts,
    meter: LinkMeter,
    bits: scenecast_protocol::mac::ModemProfile,
    refusals: Refusals,
    position: Position,
    /// The vehicle to stay above.
    vehicle: Address,
}

impl Host {
    async fn run(mut self, mut stop: Stop) -> Result<(), UserError> {
        let mut second = tokio::time::interval(Duration::from_secs(1));
        second.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            let changed = self.pump()?;
            if changed {
                self.publish();
            }
            let now = self.clock.now();
            let wake = self.surface.poll_timeout(now).map(|(at, _)| at).filter(|&at| at > now);
            let wake = wake.unwrap_or_else(|| self.clock.now() + Duration::from_secs(1));
            tokio::select! {
                () = stop.asked() => {
                    self.modem.log_audit();
                    return Ok(());
                }
                _ = tokio::time::sleep_until(self.clock.wall(wake)) => {}
                _ = second.tick() => self.publish(),
                event = self.modem.next() => self.handle_modem(event?),
                (ask, reply) = next_request(&mut self.console) => self.answer(ask, reply),
                () = self.position.next(&mut self.surface, self.vehicle) => {}
            }
        }
    }

    fn handle_modem(&mut self, event: ModemEvent) {
        let now = self.clock.now();
        match event {
            ModemEvent::Sent => self.surface.handle_transmit_outcome(now),
            ModemEvent::Received(bytes) => self.handle_frame(&bytes),
            ModemEvent::Poll(frames) => self.surface.handle_poll(frames),
            ModemEvent::Repeated(bits) => self.surface.handle_repeated(bits, now),
            ModemEvent::Fix(end, line) => self.surface.handle_range(end, &line, now),
            ModemEvent::Ready | ModemEvent::Lost | ModemEvent::Refused(_) => {}
        }
    }

    fn handle_frame(&mut self, bytes: &[u8]) {
        let now = self.clock.now();
        self.meter.heard(self.bits.bits_on_air(bytes.len()), now);
        self.surface.handle_frame(bytes, now);
        let views = self.surface.vehicles().filter_map(|(a, _)| self.surface.view(a));
        views.for_each(|v| self.refusals.note(v.stats()));
    }

    fn answer(&mut self, ask: Ask, reply: oneshot::Sender<Reply>) {
        // A browser that has gone away needs no answer.
        let _ = reply.send(answer(&mut self.surface, ask, self.facts.cell_m, self.clock.now()));
    }

    fn publish(&mut self) {
        if let Some(console) = &self.console {
            let snapshot = snapshot(&self.surface, &self.facts, &self.meter, self.clock.now());
            console.snapshots.send_replace(Arc::new(snapshot));
        }
    }

    /// Carries out what the surface asks for; says whether the page has something new to show.
    fn pump(&mut self) -> Result<bool, UserError> {
        let now: Instant = self.clock.now();
        let mut changed = false;
        while let Some(output) = self.surface.poll_output() {
            changed = true;
            match output {
                SurfaceOutput::MapChanged(vehicle) => self.write_map(vehicle)?,
                SurfaceOutput::VehicleFound(vehicle) => {
                    tracing::info!("vehicle {} answered a call: it is spoken with from now on", vehicle.number());
                }
                SurfaceOutput::ExemplarHere(vehicle, label) => {
                    tracing::info!("an image of label {label} of vehicle {} is here", vehicle.number());
                }
                SurfaceOutput::SlotDecided(..) | SurfaceOutput::Changed(_) => {}
            }
        }
        self.modem.set_budget(self.surface.budget_bps());
        if self.modem.takes_cycles()
            && let Some(cycle) = self.surface.poll_cycle(now)
        {
            self.modem.begin_cycle(cycle);
        }
        while self.modem.takes_frames()
            && let Some(transmit) = self.surface.poll_transmit(now)
        {
            self.meter.sent(self.bits.bits_on_air(transmit.bytes.len()), now);
            self.modem.send(transmit);
        }
        Ok(changed)
    }

    fn write_map(&self, vehicle: Address) -> Result<(), UserError> {
        let Some(map) = self.surface.map(vehicle) else { return Ok(()) };
        let png = match label_picture::encode(map) {
            Ok(png) => png,
            // What came through the water ends no run.
            Err(e) => {
                tracing::warn!("operator-map-{}.png is not written: {e}", vehicle.number());
                return Ok(());
            }
        };
        let file = |extension| self.dir.join(format!("operator-map-{}.{extension}", vehicle.number()));
        if let (Some(plane), Some(bounds)) = (self.surface.relay().and_then(|r| r.plane()), map.bounds()) {
            let placement = self.surface.view(vehicle).and_then(|v| v.status().and_then(|(s, _)| s.placement));
            let text = world_file(plane, placement, bounds, self.facts.cell_m);
            scenecast_files::write_whole(&file("pgw"), text.as_bytes())?;
        }
        scenecast_files::write_whole(&file("png"), &png)
    }
}

async fn next_request(console: &mut Option<Console>) -> Request {
    let request = match console {
        Some(console) => console.requests.recv().await,
        None => None,
    };
    match request {
        Some(request) => request,
        None => std::future::pending().await,
    }
}
