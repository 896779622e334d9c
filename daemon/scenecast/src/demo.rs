//! A rehearsal in real time, with the operator's page.

use scenecast_console::{Console, LinkMeter, MissionFacts, bind, handle_request, snapshot, start};
use scenecast_core::UserError;
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::Mission;
use scenecast_runtime::{Stop, block_on, random_bits};
use std::sync::Arc;
use std::time::Duration;

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
    block_on(async move {
        let stop = Stop::new()?;
        let console = match port {
            Some(port) => {
                let listener = bind(&format!("127.0.0.1:{port}"), "--port", Vec::new(), "").await?;
                println!("the operator's page is at http://127.0.0.1:{port} (end with Ctrl-C)");
                Some(start(listener))
            }
            None => None,
        };
        Demo::new(mission, speed).run(console, stop).await
    })
}

struct Demo {
    mission: Mission,
    meter: LinkMeter,
    facts: MissionFacts,
    counted: [u64; 2],
    published: Option<std::time::Instant>,
}

impl Demo {
    fn new(mission: Mission, speed: f64) -> Self {
        let facts = MissionFacts::new(mission.config(), mission.modem(), random_bits(), speed);
        let window = Duration::from_secs_f64(mission.config().link.budget_window_s);
        Self { meter: LinkMeter::new(window, Instant::ZERO), mission, facts, counted: [0; 2], published: None }
    }

    async fn run(mut self, mut console: Option<Console>, mut stop: Stop) -> Result<(), UserError> {
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut before = std::time::Instant::now();
        loop {
            tokio::select! {
                () = stop.asked() => return Ok(()),
                _ = tick.tick() => {}
            }
            // A machine that is too slow for the speed must not try to catch up, or each step
            // takes longer than the last.
            let passed = before.elapsed().min(MAX_STEP + TICK);
            before = std::time::Instant::now();
            self.fly(self.mission.now() + passed.mul_f64(self.facts.speed))?;
            self.count();
            let changed = !self.mission.take_events().is_empty();
            match &mut console {
                Some(console) => self.serve(console, changed),
                None if self.mission.is_drained() => return Ok(()),
                None => {}
            }
        }
    }

    /// Advances the mission to `until`, or as far as [`MAX_STEP`] allows.
    fn fly(&mut self, until: Instant) -> Result<(), UserError> {
        let end = Instant::from_secs_f64(self.mission.config().survey.duration_s);
        let began = std::time::Instant::now();
        while self.mission.now() < until && began.elapsed() < MAX_STEP {
            let next = until.min(self.mission.now() + STRIDE);
            if next >= end && !self.facts.ended {
                self.mission.advance(end)?;
                self.mission.end_survey();
                self.facts.ended = true;
            }
            self.mission.advance(next)?;
        }
        Ok(())
    }

    fn serve(&mut self, console: &mut Console, mut changed: bool) {
        let now = self.mission.now();
        while let Ok((request, reply)) = console.requests.try_recv() {
            let cell_m = self.facts.cell_m;
            // A browser that closed its connection needs no reply.
            let _ = reply.send(handle_request(self.mission.surface_mut(), request, cell_m, now));
            changed = true;
        }
        let due = self.published.is_none_or(|at| at.elapsed() >= PUBLISH_INTERVAL);
        if changed || due {
            self.published = Some(std::time::Instant::now());
            let snapshot = snapshot(self.mission.surface(), &self.facts, &self.meter, now);
            console.snapshots.send_replace(Arc::new(snapshot));
        }
    }

    /// Counts the bits that the surface received and sent, for the page's link panel.
    fn count(&mut self) {
        let now = self.mission.now();
        let totals = [self.mission.received_bits(), self.mission.audits()[1].total_bits()];
        if totals[0] > self.counted[0] {
            self.meter.received(totals[0] - self.counted[0], now);
        }
        if totals[1] > self.counted[1] {
            self.meter.sent(totals[1] - self.counted[1], now);
        }
        self.counted = totals;
    }
}
