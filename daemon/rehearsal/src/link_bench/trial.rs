//! The measurements of one setting.

use super::bench::{LinkBench, LinkSetting, auv};
use super::tally::Summary;
use crate::virtual_time::VirtualTime;
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::{Fix, OrderStatus, Slot, SlotId, Utility};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::map::StateReplica;
use scenecast_protocol::time::Instant;
use sim_channel::RandomStream;
use std::time::Duration;

/// Bytes that wait at a vehicle under load: more than the longest turn carries.
const LOAD: usize = 20_000;
/// Time for the handshake and for the estimates of both ends to converge.
const WARM_UP: Duration = Duration::from_secs(120);
/// Time after which a trial is ended without a result.
const GIVE_UP_TIMEOUT: Duration = Duration::from_secs(900);

/// Durations and counts of the measurements.
#[derive(Debug, Clone, Copy)]
pub struct LinkEffort {
    /// Virtual time over which the efficiency is measured.
    pub saturated: Duration,
    pub directives: usize,
    /// Number of times that the source stops changing.
    pub stops: usize,
}

impl LinkEffort {
    pub const TABLE: Self = Self { saturated: Duration::from_secs(1200), directives: 60, stops: 40 };
}

/// Result of a saturated link.
#[derive(Debug, Clone, Copy)]
pub struct Flow {
    pub useful_bps: f64,
    /// Share of the vehicle's frames that the channel lost.
    pub loss: f64,
}

#[derive(Debug, Clone)]
pub struct Directives {
    pub applied: Summary,
    /// Times from issue until the surface knows of the application, seconds.
    pub known: Summary,
}

/// Convergence of the replica after the source stopped.
#[derive(Debug, Clone)]
pub struct Convergence {
    /// Times from the last change to equality, seconds.
    pub time: Summary,
    /// Share of stops with equality within the bound.
    pub within: f64,
}

impl LinkBench {
    /// Ends under load after their handshake.
    pub fn under_load(setting: &LinkSetting, seed: u64) -> Self {
        let mut bench = Self::new(setting, seed);
        bench.vehicles.iter_mut().for_each(|v| v.load = Some(LOAD));
        bench.run(WARM_UP);
        bench
    }

    /// Number of useful bytes at the replica so far.
    fn useful_bytes(&self) -> f64 {
        self.view().map_or(0.0, |v| v.replica().useful_bytes())
    }

    /// Useful bit/s over `time`, with a fix each `fix_every` if it is given.
    pub fn measure_flow(&mut self, time: Duration, fix_every: Option<Duration>) -> Result<Flow, IssueError> {
        let (began, before, until) = (self.now, self.useful_bytes(), self.now + time);
        self.tally = Default::default();
        while self.now < until {
            if fix_every.is_some() {
                let fix = Fix { position: WorldPoint::new(10.0, -20.0), sigma_m: 1.0, age_s: 0.5 };
                self.surface.end_mut().issue(auv(), Slot::Fix(fix), self.now)?;
            }
            self.run((fix_every.unwrap_or(time)).min(until.since(self.now)));
        }
        let useful_bps = (self.useful_bytes() - before) * 8.0 / self.now.since(began).as_secs_f64();
        Ok(Flow { useful_bps, loss: self.tally.up.loss() })
    }

    /// Issues `count` directives, each a random time after the surface knows that the last one was applied.
    pub fn measure_directives(&mut self, count: usize, rng: &mut RandomStream) -> Result<Directives, IssueError> {
        let (mut applied, mut known) = (Vec::new(), Vec::new());
        for _ in 0..count {
            self.run(Duration::from_secs_f64(1.0 + rng.uniform() * 30.0));
            let issued = self.now;
            let weights = [(1, 50), (2, -20), (3, 100), (7, 5)].into_iter().collect();
            let slot = Slot::Utility(Utility { weights, ..Utility::default() });
            let version = self.surface.end_mut().issue(auv(), slot, issued)?;
            self.run_until(issued + GIVE_UP_TIMEOUT, |w| {
                w.view().is_some_and(|v| v.slots().any(|s| s.status == OrderStatus::Applied))
            });
            known.push(self.now.since(issued).as_secs_f64());
            let at = self.vehicle().applied.get(&(SlotId::Utility, version)).copied();
            applied.push(at.unwrap_or(self.now).since(issued).as_secs_f64());
        }
        Ok(Directives { applied: Summary::of(applied), known: Summary::of(known) })
    }

    /// Stops the source `count` times at a random moment with a random number of bytes waiting, and waits for equality.
    pub fn measure_convergence(&mut self, count: usize, loss: f64, rng: &mut RandomStream) -> Convergence {
        let mut times = Vec::new();
        let mut within = 0;
        for _ in 0..count {
            self.vehicle().load = Some(LOAD);
            self.run(Duration::from_secs_f64(20.0 + rng.uniform() * 30.0));
            let keep = (8.0 * 500f64.powf(rng.uniform())) as usize;
            let (time, bytes) = self.stop_and_converge(keep);
            let bound = base_s(loss) + 1.5 * bytes as f64 * 8.0 / (10_000.0 * (1.0 - loss));
            within += usize::from(time <= bound);
            times.push(time);
        }
        Convergence { time: Summary::of(times), within: within as f64 / count as f64 }
    }

    /// Stops the source with `keep` bytes waiting; returns the seconds until the replica is equal, and
    /// the bytes that it lacked.
    fn stop_and_converge(&mut self, keep: usize) -> (f64, usize) {
        let stopped: Instant = self.now;
        let vehicle = self.vehicle();
        vehicle.load = None;
        vehicle.host.end_mut().source_mut().take_back(keep);
        let bytes = self.missing();
        let mut seen = None;
        self.run_until(stopped + GIVE_UP_TIMEOUT, |w| {
            let version = w.view().map(|v| v.replica().version());
            seen.replace(version) != Some(version) && w.missing() == 0
        });
        (self.now.since(stopped).as_secs_f64(), bytes)
    }

    /// Number of bytes that the replica lacks.
    fn missing(&self) -> usize {
        let target = self.vehicles[0].host.end().source().target();
        self.view().map_or(usize::MAX, |v| v.replica().missing(target))
    }
}

/// The part of the bound of convergence that does not depend on the backlog, seconds: 10, 20, 60 at 10, 30, 50 %.
pub fn base_s(loss: f64) -> f64 {
    match loss {
        l if l <= 0.1 => 10.0,
        l if l <= 0.3 => 10.0 + (l - 0.1) / 0.2 * 10.0,
        l => (20.0 + (l - 0.3) / 0.2 * 40.0).min(60.0),
    }
}
