//! `scenecast asv`: ports, page, files and clock around the surface's host.

use super::clock::{Clock, utc_hours};
use super::dry_runs::DryRuns;
use super::instruments::{Instruments, relay};
use super::map_files::{MapFile, MapFiles};
use super::modem::{self, ModemPort, warn_without_key};
use super::pilot::{self, PilotPort, SimulatedAutopilot};
use super::record::{SurfaceRecord, unix_nanos};
use super::ros2::SurfaceRos2;
use super::stop::{Load, Reload, Stop, configured_budget, hold_hang_up, keep_private};
use super::store::{ArchivedFile, SurfaceFiles};
use crate::port::FromPort;
use scenecast_config::Config;
use scenecast_console::report::report_reply;
use scenecast_console::{Console, ConsoleListener, PendingRequest, bind, start};
use scenecast_core::{LatLon, Principal, TangentPlane, UserError, utc_text, world_file};
use scenecast_host::{FrameEvent, SurfaceHost, SurfaceHostEvent, modem_station};
use scenecast_protocol::directive::Budget;
use scenecast_protocol::link::DropReason;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::state::ReplaySide;
use scenecast_surface::{
    ClientRequest, CommandChange, LinkMeter, MapCaption, MissionFacts, Reply, SurfaceOutput, SurfaceRequest,
    archived_cells, former_labels, handle_request, measured_origin, snapshot,
};
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::oneshot;

/// Maximum time between two snapshots for the page.
const PUBLISH_INTERVAL: Duration = Duration::from_secs(1);
/// Time after which changes that were not committed yet are looked at again.
const CATCH_UP_INTERVAL: Duration = Duration::from_millis(100);

/// A surface without a configured name has that of the computer.
fn name_surface(config: &mut Config) {
    if config.surface.name.is_empty() {
        config.surface.name = host_name();
    }
}

/// The name of this computer; empty if it has none.
pub fn host_name() -> String {
    nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok()).unwrap_or_default()
}

/// Runs the surface until it is interrupted; on SIGHUP it calls `load` for a new budget and new shares.
pub fn run_surface(load: Load, simulated: Option<SimulatedAutopilot>) -> Result<(), UserError> {
    hold_hang_up();
    super::block_on(async move {
        let mut config = load()?;
        name_surface(&mut config);
        keep_private();
        let listener = listen(&config).await?;
        warn_without_key(&config);
        let (shell, stop) = SurfaceShell::start(&config, load, listener, simulated).await?;
        shell.run(stop).await
    })
}

/// The configured address of the page, with those who may use it.
async fn listen(config: &Config) -> Result<Option<(ConsoleListener, Vec<Principal>)>, UserError> {
    let Some(address) = &config.console.listen else { return Ok(None) };
    let tokens = scenecast_config::load_tokens(config)?;
    let principals = tokens.iter().map(|token| token.principal.clone()).collect();
    let listener = bind(address.as_str(), "console.listen", tokens, &config.console.host).await?;
    let origins = config.console.origins.iter().map(|origin| origin.as_str().to_owned()).collect();
    Ok(Some((listener.with_origins(origins), principals)))
}

struct Ports {
    modem: ModemPort,
    instruments: Instruments,
    pilot: PilotPort,
}

impl Ports {
    async fn open(config: &Config, has_autopilot: bool, now: Instant) -> Result<Self, UserError> {
        let modem = ModemPort::open(config, now).await?;
        Ok(Self { modem, instruments: Instruments::open(config), pilot: PilotPort::open(config, has_autopilot) })
    }
}

/// Moves bytes, reads the clock, writes files and answers the page; the host makes all decisions.
struct SurfaceShell {
    host: SurfaceHost,
    ports: Ports,
    console: Option<Console>,
    ros2: SurfaceRos2,
    clock: Clock,
    files: SurfaceFiles,
    maps: MapFiles,
    facts: MissionFacts,
    meter: LinkMeter,
    record: SurfaceRecord,
    dry_runs: DryRuns,
    /// Held while an archived map or the record is read.
    reading: Arc<Mutex<()>>,
    reload: Reload,
    /// The budget of the configuration, as it was read last.
    budget: Budget,
    /// The page lacks changes that are still to be committed.
    is_stale: bool,
}

impl SurfaceShell {
    /// Starts every part of the surface as it is configured.
    async fn start(
        config: &Config,
        load: Load,
        page: Option<(ConsoleListener, Vec<Principal>)>,
        simulated: Option<SimulatedAutopilot>,
    ) -> Result<(Self, Stop), UserError> {
        let authenticity = scenecast_config::authenticity(config, Address::SURFACE)?;
        let offers_key = authenticity.as_ref().is_some_and(|keys| keys.next.is_some());
        let was_there = config.runtime.state_dir.exists();
        let (mut files, clock) = SurfaceFiles::open(config)?;
        let profile = scenecast_drivers::modem::modem_of_process(config, Address::SURFACE)?;
        let (table, seed) = (scenecast_config::tuning_table(config)?, super::random_bits());
        let mut surface = scenecast_surface::assemble(config, authenticity, table, profile, seed, clock.now())?;
        // Files that do not end, such as a pipe for a key, are read above: until there a signal ends the program at once.
        let (stop, reload) = (Stop::new()?, Reload::new(load, config)?);
        let (listener, mut principals) = page.map_or((None, Vec::new()), |(page, users)| (Some(page), users));
        let ros2 = SurfaceRos2::start(config, &mut principals)?;
        surface.set_principals(principals);
        if let Some(relay) = relay(config) {
            surface.set_relay(relay);
        }
        if was_there || files.is_again() {
            surface.assume_budget_spent(clock.now());
        }
        let console = listener.zip(config.console.listen.as_ref()).map(|(listener, address)| {
            // Without a terminal the surface goes on.
            let _ = writeln!(std::io::stdout(), "the operator's page is at http://{address} (end with Ctrl-C)");
            start(listener)
        });
        files.begin(&mut surface, super::random_bits() as u32, config.mission.id, clock.now());
        let id = files.store.memory().began().map_or(0, |began| began.id);
        let facts = MissionFacts::new(config, &profile, id.into(), config.runtime.time_scale);
        let meter = LinkMeter::new(Duration::from_secs_f64(config.link.budget_window_s), clock.now());
        let follower = pilot::of_surface(config, simulated, clock.now())?;
        let ports = Ports::open(config, follower.is_some(), clock.now()).await?;
        let host = SurfaceHost::new(surface, modem_station(config, Address::SURFACE, profile)?, follower);
        let folder = config.runtime.state_dir.join("records");
        let record =
            SurfaceRecord::start(config, &config.surface.name, &folder, offers_key, host.surface().log().last());
        let shell = Self {
            host,
            ports,
            console,
            ros2,
            clock,
            files,
            maps: MapFiles::start(config.runtime.state_dir.clone()),
            facts,
            meter,
            record,
            dry_runs: DryRuns::new(config.clone()),
            reading: Arc::default(),
            reload,
            budget: configured_budget(config),
            is_stale: true,
        };
        Ok((shell, stop))
    }

    async fn run(mut self, mut stop: Stop) -> Result<(), UserError> {
        let mut publish = tokio::time::interval(PUBLISH_INTERVAL);
        publish.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            self.is_stale |= self.pump()?;
            if self.is_stale && self.files.may_commit() {
                self.publish();
            }
            let now = self.clock.now();
            let wake = self.host.poll_timeout(now).unwrap_or(now + Duration::from_secs(1));
            let catch_up = tokio::time::sleep(CATCH_UP_INTERVAL);
            tokio::select! {
                () = stop.asked() => {
                    self.publish();
                    modem::log_audit(self.host.link());
                    self.maps.finish().await;
                    self.record.finish();
                    return Ok(());
                }
                _ = tokio::time::sleep_until(self.clock.wall(wake)) => {}
                () = catch_up, if self.is_stale => {}
                _ = publish.tick() => {
                    self.publish();
                    self.files.tend(self.clock.now());
                    self.facts.storage = Some(self.files.info());
                }
                report = self.ports.modem.next() => {
                    self.ports.modem.handle(report, self.host.link_mut(), self.clock.now());
                }
                report = self.ports.instruments.next() => {
                    self.ports.instruments.handle(report, &mut self.host, self.clock.now());
                }
                report = self.ports.pilot.next() => self.handle_pilot(report),
                config = self.reload.next() => self.follow(&config),
                (request, reply) = next_request(&mut self.console) => self.handle_request(request, reply),
                (request, reply) = self.ros2.next_request() => self.handle_request(request, reply),
            }
            self.host.handle_timeout(self.clock.now());
        }
    }

    /// Takes budget and shares of the configuration if they are others than before: a terminal that closes sends a SIGHUP too.
    fn follow(&mut self, config: &Config) {
        let budget = configured_budget(config);
        if std::mem::replace(&mut self.budget, budget) == budget {
            return tracing::info!("SIGHUP: budget and shares are as before");
        }
        let Budget { bits_per_s, shares, background } = budget;
        match self.host.surface_mut().set_budget(bits_per_s, Some(shares), Some(background), self.clock.now()) {
            Ok(()) => tracing::info!("SIGHUP: budget {bits_per_s} bit/s, shares {:?} %", shares.0),
            Err(reason) => tracing::error!("SIGHUP: {reason}; no setting is changed"),
        }
        self.is_stale = true;
    }

    fn handle_pilot(&mut self, report: FromPort) {
        let now = self.clock.now();
        match report {
            FromPort::Open => self.host.handle_pilot_open(now),
            FromPort::Bytes(bytes) => _ = self.host.handle_pilot_bytes(&bytes, now),
            FromPort::Datagram(bytes, sender) => {
                self.ports.pilot.judge(sender, self.host.handle_pilot_bytes(&bytes, now));
            }
            FromPort::Closed => {}
        }
    }

    /// Handles a request. Its effects are durable before the reply, and before anything is transmitted.
    fn handle_request(&mut self, request: ClientRequest, reply: oneshot::Sender<Reply>) {
        if let SurfaceRequest::ArchivedMap(name) = &request.request {
            return self.read_archive(name, reply);
        }
        if request.request == SurfaceRequest::Report {
            return self.report(reply);
        }
        let now = self.clock.now();
        if matches!(request.request, SurfaceRequest::DryRun(..)) {
            let surface = self.host.surface();
            return self.dry_runs.answer(surface, &request.request, self.facts.cell_m, now, reply);
        }
        self.files.commit(self.host.surface_mut(), None, now);
        let by = request.by.as_ref().map(|by| by.name().to_owned());
        let answer = match &request.request {
            &SurfaceRequest::FormerLabels(vehicle, cell) => {
                former_labels(self.files.store.memory().vehicle(vehicle), cell)
            }
            SurfaceRequest::Archives => Reply::Archives(self.files.archives(now)),
            _ => handle_request(self.host.surface_mut(), request, self.facts.cell_m, now),
        };
        self.files.commit(self.host.surface_mut(), by.as_deref(), now);
        if by.is_some() {
            // Who reads the state after the reply finds the order in it.
            self.publish();
        }
        // A browser that closed its connection needs no reply.
        let _ = reply.send(answer);
    }

    /// Reads an archived map beside the loop of the link, one at a time.
    fn read_archive(&self, name: &str, reply: oneshot::Sender<Reply>) {
        let (file, cell_m) = (self.files.store.archived(name), self.facts.cell_m);
        let info = self.files.store.archives().find(|info| info.name == name);
        // The mission of an archived map may be an earlier one.
        let caption = info.map(|info| MapCaption {
            mission: String::new(),
            address: info.vehicle,
            name: info.vehicle_name.clone(),
            epoch: info.id.epoch,
            utc: utc_text(info.ended_unix_ms as f64 / 1000.0),
            side: ReplaySide::Operator,
        });
        let reading = self.reading.clone();
        tokio::task::spawn_blocking(move || {
            let _one = reading.lock();
            let map = file.and_then(ArchivedFile::read);
            let answer = map.map_or(Reply::NotFound, |map| Reply::Map(archived_cells(&map, cell_m, caption)));
            // A browser that closed its connection needs no reply.
            let _ = reply.send(answer);
        });
    }

    /// Makes the report beside the loop of the link, one at a time.
    fn report(&self, reply: oneshot::Sender<Reply>) {
        let records: Vec<_> = self.record.folder().map(Path::to_owned).into_iter().collect();
        let reading = self.reading.clone();
        tokio::task::spawn_blocking(move || {
            let _one = reading.lock();
            // A browser that closed its connection needs no reply.
            let _ = reply.send(report_reply(&records));
        });
    }

    /// Shows the state on the page and to ROS 2, after it was made durable.
    fn publish(&mut self) {
        let now = self.clock.now();
        self.files.commit(self.host.surface_mut(), None, now);
        self.is_stale = false;
        if self.console.is_none() && !self.ros2.is_on() && !self.record.is_on() {
            return;
        }
        self.meter.handle_budgets(self.host.surface());
        self.facts.stamps.observe(now.as_secs_f64(), unix_nanos());
        let snapshot = Arc::new(snapshot(self.host.surface(), &self.facts, &self.meter, now));
        self.record.observe(self.host.surface(), &snapshot);
        if let Some(console) = &self.console {
            console.snapshots.send_replace(snapshot.clone());
        }
        self.ros2.publish(snapshot);
    }

    /// Acts on every event of the host and writes the bytes for the ports. Returns whether the
    /// page needs a new snapshot.
    fn pump(&mut self) -> Result<bool, UserError> {
        let now = self.clock.now();
        if let Some(clock) = utc_hours() {
            self.host.surface_mut().set_clock(clock);
        }
        let mut is_changed = self.handle_events()?;
        while let Some(bytes) = self.host.poll_output(now) {
            self.ports.modem.write(bytes);
        }
        self.ports.modem.reopen_if_silent(self.host.link(), now);
        self.ports.modem.listen(self.host.link());
        if let Some(note) = self.ports.modem.poll_note() {
            self.host.surface_mut().log_fault(&format!("the surface's modem: {note}"), now);
            is_changed = true;
        }
        while let Some(bytes) = self.host.poll_pilot_output() {
            self.ports.pilot.write(bytes);
        }
        is_changed |= self.handle_events()?;
        Ok(is_changed)
    }

    fn handle_events(&mut self) -> Result<bool, UserError> {
        let mut is_changed = false;
        while let Some(event) = self.host.poll_event() {
            match event {
                SurfaceHostEvent::Role(output) => {
                    is_changed = true;
                    self.handle_output(output);
                }
                SurfaceHostEvent::Following(x, y) => {
                    tracing::info!("following: to {x:.0} m east, {y:.0} m north");
                }
                SurfaceHostEvent::Frame(event) => {
                    self.ports.modem.handle_event(&event)?;
                    self.measure(&event);
                    self.facts.stamps.observe(self.clock.now().as_secs_f64(), unix_nanos());
                    self.record.handle_frame(&event, &self.facts.stamps);
                }
                SurfaceHostEvent::Pilot(event) => pilot::log(event),
            }
        }
        Ok(is_changed)
    }

    fn handle_output(&mut self, output: SurfaceOutput) {
        match output {
            SurfaceOutput::MapChanged(vehicle) => self.write_map(vehicle),
            SurfaceOutput::VehicleFound(vehicle) => {
                tracing::info!("vehicle {} answered a call: the link with it is open now", vehicle.number());
            }
            SurfaceOutput::ExemplarHere(vehicle, label) => {
                tracing::info!("an image of label {label} of vehicle {} is here", vehicle.number());
            }
            SurfaceOutput::Mismatch(vehicle, mismatch) => {
                tracing::warn!("the settings of vehicle {} do not fit: {mismatch}", vehicle.number());
            }
            SurfaceOutput::KeyChanged(vehicle) => {
                tracing::info!("vehicle {} uses the next key of link.key_file", vehicle.number());
            }
            SurfaceOutput::CommandChanged(change) => log_command(&change),
            SurfaceOutput::RunEnded(_) | SurfaceOutput::SlotDecided(..) | SurfaceOutput::Changed(_) => {}
        }
    }

    fn measure(&mut self, event: &FrameEvent) {
        let now = self.clock.now();
        let bits_on_air = |frame: &[u8]| self.host.link().profile().bits_on_air(frame.len());
        match event {
            FrameEvent::Sent { frame, .. } => self.meter.sent(bits_on_air(frame), now),
            FrameEvent::Received { frame, reason, .. } if is_of_vehicle(*reason) => {
                self.meter.received(bits_on_air(frame), now);
            }
            _ => {}
        }
    }

    fn write_map(&mut self, vehicle: Address) {
        let now = self.clock.now();
        let stated = self.host.surface().view(vehicle).and_then(|view| view.cell_m());
        let cell_m = stated.unwrap_or(self.facts.cell_m);
        let request = ClientRequest { by: None, request: SurfaceRequest::Map(vehicle.number()) };
        let Reply::Map(mut cells) = handle_request(self.host.surface_mut(), request, cell_m, now) else { return };
        let surface = self.host.surface();
        let earlier = surface.record(vehicle).and_then(|record| record.earlier_map());
        let live = || surface.status(vehicle).and_then(|(status, _)| status.placement);
        let placement = earlier.map_or_else(live, |earlier| earlier.placement());
        let origin = measured_origin(surface).or(self.facts.origin);
        let plane = origin.and_then(|origin| LatLon::new(origin.lat_deg, origin.lon_deg)).map(TangentPlane::new);
        let place = plane.zip(cells.bounds);
        let world_file = place.map(|(plane, bounds)| world_file(&plane, placement, bounds, cell_m));
        cells.moved_m = placement.map_or((0.0, 0.0), |p| (p.origin.east_m, p.origin.north_m));
        self.maps.write(vehicle.number(), MapFile { cells, world_file, origin });
    }
}

fn log_command(change: &CommandChange) {
    let CommandChange { by, from, to, kind, .. } = change;
    let [from, to] = [from, to].map(|name| name.as_deref().unwrap_or("nobody"));
    tracing::info!("command {kind:?} by {by}: before {from}, now {to}");
}

async fn next_request(console: &mut Option<Console>) -> PendingRequest {
    let request = match console {
        Some(console) => console.requests.recv().await,
        None => None,
    };
    match request {
        Some(request) => request,
        None => std::future::pending().await,
    }
}

/// Whether a frame that was dropped for this reason, or for none, is certainly one of a vehicle: anybody may have sent another one.
fn is_of_vehicle(dropped: Option<DropReason>) -> bool {
    use DropReason::{Duplicate, Late, NoBase, OldSession, Undecodable};
    dropped.is_none_or(|reason| matches!(reason, Duplicate | Late | NoBase | OldSession | Undecodable))
}
