//! `scenecast demo`: a rehearsal in real time, with the operator's page.

use super::sim::WorldArguments;
use crate::mission_record::count;
use clap::Args;
use scenecast_console::report::report_reply;
use scenecast_console::{Console, bind, start};
use scenecast_core::palette::colour;
use scenecast_core::{Area, UserError, errln, outln};
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::{EndEvent, Mission, MissionOptions, Truth};
use scenecast_runtime::record::{SurfaceRecord, VehicleRecord, unix_nanos};
use scenecast_runtime::{DryRuns, Stop, block_on, keep_private, random_bits};
use scenecast_surface::record::EventTime;
use scenecast_surface::recorder::Recorder;
use scenecast_surface::state::{TrueClass, TruthInfo};
use scenecast_surface::{
    ClientRequest, LinkMeter, MissionFacts, Reply, SurfaceRequest, former_labels, handle_request, snapshot,
};
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Run a simulated mission in real time, with the operator's page.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast demo --speed 4, then open http://127.0.0.1:8460")]
pub(super) struct Demo {
    /// Port of the operator's page on 127.0.0.1
    #[arg(long, default_value_t = 8460, allow_negative_numbers = true)]
    port: u16,
    /// Mission seconds per second of wall time
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// Do not serve the page
    #[arg(long)]
    no_console: bool,
    #[command(flatten)]
    world: WorldArguments,
}

impl Demo {
    pub(super) fn run(mut self) -> Result<(), UserError> {
        if !(0.01..=1000.0).contains(&self.speed) {
            return Err(UserError::Input(format!("--speed {} is not allowed; allowed: 0.01 to 1000", self.speed)));
        }
        // The operator is the person at the page.
        self.world.sets.insert(0, "operator.script=none".to_owned());
        let config = self.world.config()?;
        let world = self.world.world(&config)?;
        let mission = Mission::new(config, MissionOptions { world, seed: self.world.seed, record: None })?;
        run_demo(mission, self.speed, (!self.no_console).then_some(self.port))
    }
}

/// Wall time between two steps.
const TICK: Duration = Duration::from_millis(50);
/// Maximum wall time of a step: after it the page is served, even if the mission is late.
const MAX_STEP: Duration = Duration::from_millis(200);
/// Mission time that passes between two readings of the wall clock.
const STRIDE: Duration = Duration::from_millis(250);
/// Wall time between two snapshots for the page while the mission has no events.
const PUBLISH_INTERVAL: Duration = Duration::from_secs(1);

/// Runs a mission at `speed` mission seconds per second of wall time and serves the operator's page on `port`, until it
/// is interrupted; without a page, until the survey has ended and the link has drained.
pub fn run_demo(mission: Mission, speed: f64, port: Option<u16>) -> Result<(), UserError> {
    keep_private();
    block_on(async move {
        let stop = Stop::or_hang_up()?;
        let console = match port {
            Some(port) => {
                let listener = bind(&format!("127.0.0.1:{port}"), "--port", Vec::new(), "").await?;
                outln!("the operator's page is at http://127.0.0.1:{port} (end with Ctrl-C)");
                Some(start(listener))
            }
            None => None,
        };
        RunningDemo::new(mission, speed).run(console, stop).await
    })
}

/// The speed of a mission: the demanded one, and the one that the machine reaches.
struct Pace {
    demanded: f64,
    /// Wall time and mission time at the start of the present measurement.
    since: (std::time::Instant, Instant),
    measured: f64,
}

impl Pace {
    /// Wall time of a measurement.
    const PERIOD: Duration = Duration::from_secs(4);
    /// Share of the demanded speed from which it counts as reached.
    const REACHED: f64 = 0.95;

    fn new(demanded: f64, now: Instant) -> Self {
        Self { demanded, since: (std::time::Instant::now(), now), measured: demanded }
    }

    /// Mission seconds per second of wall time, with two digits where the machine is too slow.
    fn reached(&mut self, now: Instant) -> f64 {
        let wall = self.since.0.elapsed();
        if wall >= Self::PERIOD {
            self.measured = now.since(self.since.1).as_secs_f64() / wall.as_secs_f64();
            self.since = (std::time::Instant::now(), now);
        }
        if self.measured >= Self::REACHED * self.demanded {
            return self.demanded;
        }
        let unit = 10f64.powf(self.measured.max(1e-3).log10().floor() - 1.0);
        (self.measured / unit).round() * unit
    }
}

/// Draws the true classes in a thread of its own, since a large sea floor takes seconds.
fn make_truth(mission: &Mission) -> JoinHandle<Result<Option<Truth>, UserError>> {
    let (world, area, cell_m) = (mission.world().clone(), mission.pictured_area(), mission.cell_m());
    std::thread::spawn(move || Truth::new(&world, &area, cell_m))
}

/// The true classes as the page shows them.
fn shown(truth: Truth) -> scenecast_surface::Truth {
    let Area { west, south, east, north } = truth.area;
    let class = |(value, name)| {
        let [red, green, blue] = colour(value);
        TrueClass { value, name, colour: format!("#{red:02x}{green:02x}{blue:02x}") }
    };
    let classes = truth.classes.into_iter().map(class).collect();
    let info = TruthInfo { west_m: west, south_m: south, east_m: east, north_m: north, classes };
    scenecast_surface::Truth { info, picture: truth.png.into() }
}

struct RunningDemo {
    mission: Mission,
    /// Makes the picture of the true classes.
    truth: Option<JoinHandle<Result<Option<Truth>, UserError>>>,
    meter: LinkMeter,
    facts: MissionFacts,
    /// What a surface would keep on its disk.
    recorder: Recorder,
    pace: Pace,
    counted: [u64; 2],
    published: Option<std::time::Instant>,
    records: (SurfaceRecord, VehicleRecord),
    dry_runs: DryRuns,
}

impl RunningDemo {
    fn new(mut mission: Mission, speed: f64) -> Self {
        let facts = MissionFacts::new(mission.config(), mission.modem(), random_bits(), speed);
        let window = Duration::from_secs_f64(mission.config().link.budget_window_s);
        let meter = LinkMeter::new(window, mission.now());
        let pace = Pace::new(speed, mission.now());
        let truth = Some(make_truth(&mission));
        let mut recorder = Recorder::default();
        recorder.begin(mission.surface_mut(), 0, 0, EventTime::default());
        mission.keep_end_events();
        // In the present folder, so that it is found after the demo.
        let (config, folder) = (mission.settings(), Path::new("records"));
        let surface = SurfaceRecord::rehearsed(&config, folder, mission.seed());
        let records = (surface, VehicleRecord::rehearsed(&config, folder, speed, mission.seed()));
        let dry_runs = DryRuns::new(config);
        Self { meter, pace, truth, mission, facts, recorder, counted: [0; 2], published: None, records, dry_runs }
    }

    async fn run(mut self, mut console: Option<Console>, mut stop: Stop) -> Result<(), UserError> {
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut before = std::time::Instant::now();
        loop {
            tokio::select! {
                () = stop.asked() => return self.finish(),
                _ = tick.tick() => {}
            }
            // A machine that is too slow for the speed must not try to catch up, or each step
            // takes longer than the last.
            let passed = before.elapsed().min(MAX_STEP + TICK);
            before = std::time::Instant::now();
            self.fly(self.mission.now() + passed.mul_f64(self.pace.demanded))?;
            count(&mut self.meter, &mut self.counted, &self.mission);
            let changed = !self.mission.take_events().is_empty();
            match &mut console {
                Some(console) => self.serve(console, changed),
                None if self.mission.is_drained() => return self.finish(),
                None if self.is_due() => self.publish(None),
                None => {}
            }
        }
    }

    /// Ends the records, and prints where they are.
    fn finish(mut self) -> Result<(), UserError> {
        self.publish(None);
        self.records.0.finish();
        self.records.1.finish(Some(self.mission.images()));
        Ok(())
    }

    /// Advances the mission to `until`, or as far as [`MAX_STEP`] allows.
    fn fly(&mut self, until: Instant) -> Result<(), UserError> {
        let end = Instant::from_secs_f64(self.mission.config().survey.duration_s);
        let began = std::time::Instant::now();
        while self.mission.now() < until && began.elapsed() < MAX_STEP {
            let next = until.min(self.mission.now() + STRIDE);
            if next >= end && self.facts.ended_s.is_none() {
                self.mission.advance(end)?;
                self.mission.end_survey();
                self.facts.ended_s = Some(end.as_secs_f64());
            }
            self.mission.advance(next)?;
        }
        Ok(())
    }

    /// Shows the true classes once their picture is made.
    fn take_truth(&mut self) {
        let Some(made) = self.truth.take_if(|thread| thread.is_finished()) else { return };
        match made.join() {
            Ok(Ok(truth)) => self.facts.truth = truth.map(|truth| Arc::new(shown(truth))),
            Ok(Err(error)) => errln!("scenecast: the page cannot show the true classes: {error}"),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    fn serve(&mut self, console: &mut Console, mut changed: bool) {
        self.take_truth();
        let mut answers = Vec::new();
        while let Ok((request, reply)) = console.requests.try_recv() {
            if matches!(request.request, SurfaceRequest::DryRun(..)) {
                let (surface, now) = (self.mission.surface(), self.mission.now());
                self.dry_runs.answer(surface, &request.request, self.facts.cell_m, now, reply);
                continue;
            }
            answers.push((reply, self.answer(request)));
            changed = true;
        }
        if changed || self.is_due() {
            self.publish(Some(console));
        }
        // Who reads the state after the reply finds the order in it.
        for (reply, answer) in answers {
            // A browser that closed its connection needs no reply.
            let _ = reply.send(answer);
        }
    }

    /// Whether the state was published so long ago that it is to be published again.
    fn is_due(&self) -> bool {
        self.published.is_none_or(|at| at.elapsed() >= PUBLISH_INTERVAL)
    }

    /// Shows the state on the page, and records it.
    fn publish(&mut self, console: Option<&Console>) {
        let now = self.mission.now();
        self.published = Some(std::time::Instant::now());
        self.meter.handle_budgets(self.mission.surface());
        self.facts.speed = self.pace.reached(now);
        self.remember();
        for (at, event) in self.mission.take_end_events() {
            match event {
                EndEvent::Surface(event) => {
                    self.facts.stamps.observe(at.as_secs_f64(), unix_nanos());
                    self.records.0.handle_frame(&event, &self.facts.stamps);
                }
                EndEvent::Vehicle(event) => self.records.1.handle_event(&event, at),
            }
        }
        self.facts.stamps.observe(now.as_secs_f64(), unix_nanos());
        let snapshot = Arc::new(snapshot(self.mission.surface(), &self.facts, &self.meter, now));
        self.records.0.observe(self.mission.surface(), &snapshot);
        self.records.1.observe(self.mission.vehicle(), now);
        self.records.1.observe_images(Some(self.mission.images()));
        if let Some(console) = console {
            console.snapshots.send_replace(snapshot);
        }
    }

    fn answer(&mut self, request: ClientRequest) -> Reply {
        if let SurfaceRequest::FormerLabels(vehicle, cell) = request.request {
            return former_labels(self.recorder.memory().vehicle(vehicle), cell);
        }
        if request.request == SurfaceRequest::Report {
            let folders = [self.records.0.folder(), self.records.1.folder()];
            return report_reply(&folders.into_iter().flatten().map(Path::to_owned).collect::<Vec<_>>());
        }
        let now = self.mission.now();
        handle_request(self.mission.surface_mut(), request, self.facts.cell_m, now)
    }

    /// Follows the surface's knowledge, as its store would.
    fn remember(&mut self) {
        let time = EventTime { mission_us: self.mission.now().as_micros(), unix_ms: 0 };
        self.recorder.observe(self.mission.surface_mut(), None, time);
    }
}
