//! How far the vehicle's position is off, with and without the localisation relay.
//!
//! The parts are those that go to sea: sentences of a GPS are read, the relay fuses them with the USBL head's measurements, the
//! fix is written and read as on the wire, and the vehicle's navigator takes it late. Simulated are the way, the sensors,
//! the loss on the link and the time that a fix waits for its turn.

mod picture;
mod ship;

pub use picture::picture;

use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::{Fix, Slot, VersionedSlot};
use scenecast_protocol::time::Instant;
use scenecast_surface::position::UsblSighting;
use scenecast_vehicle::{FixVerdict, Navigator};
use serde::Serialize;
use ship::Ship;
use sim_channel::usbl::{UsblConfig, UsblHead};
use sim_channel::{NodePosition, RandomStream};
use std::collections::BTreeMap;
use std::time::Duration;

/// Length of the way, metres.
const TRACK_M: u32 = 3000;
/// Metres a second, and so seconds a metre.
const SPEED_M_S: f64 = 1.0;
/// Drift of the vehicle's own reckoning a metre of way.
const DRIFT: f64 = 0.01;
const FIX_PERIOD_S: u32 = 10;
/// Probability that a fix is lost on its way down.
const LOSS: f64 = 0.1;
/// Longest that a fix waits for its turn, seconds.
const MAX_WAIT_S: f64 = 8.0;
const DEPTH_M: f64 = 30.0;
const SOUND_M_S: f64 = 1500.0;

/// One way over 3 km.
#[derive(Debug, Clone, Default)]
pub struct Tracks {
    /// Where the vehicle was, each second.
    pub truth: Vec<(f64, f64)>,
    /// Where it would have believed to be without fixes.
    pub reckoned: Vec<(f64, f64)>,
    /// Where it believed to be with them.
    pub relayed: Vec<(f64, f64)>,
    /// Fixes that it was sent, and whether it used them.
    pub fixes: Vec<((f64, f64), bool)>,
    /// Where the surface vehicle was.
    pub ship: Vec<(f64, f64)>,
}

impl Tracks {
    fn mean_error(&self, believed: &[(f64, f64)]) -> f64 {
        let off = |((x, y), (bx, by)): (&(f64, f64), &(f64, f64))| (x - bx).hypot(y - by);
        self.truth.iter().zip(believed).map(off).sum::<f64>() / self.truth.len().max(1) as f64
    }
}

/// Mean errors of a run over the track, metres.
#[derive(Debug, Clone, Serialize)]
pub struct LocalisationRun {
    pub seed: u64,
    /// Error by dead reckoning alone.
    pub without_m: f64,
    pub with_m: f64,
    /// Error with the relay when one fix of ten is an outlier.
    pub with_outliers_m: f64,
    /// Of the run with outliers: fixes sent, used, and kept from use by the relay and the vehicle, by reason.
    pub outliers: BTreeMap<&'static str, u64>,
}

/// All runs and their means.
#[derive(Debug, Clone, Serialize)]
pub struct Localisation {
    pub runs: Vec<LocalisationRun>,
    /// Means over the runs, metres: `without`, `with`, `with_outliers`.
    pub mean_m: BTreeMap<&'static str, f64>,
    /// Error with the relay over that without: the means.
    pub ratio: f64,
    /// Error with outliers over that without outliers: the means.
    pub outlier_ratio: f64,
    /// The least favourable ratios of a single run: `with`, `with_outliers`.
    pub max: BTreeMap<&'static str, f64>,
    /// Whether `ratio` is at most 1/3 and `outlier_ratio` at most 1.2.
    pub reached: bool,
}

/// Runs over `seeds` ways from `seed` on.
pub fn localisation(seed: u64, seeds: u64, progress: &mut dyn FnMut(f64)) -> Localisation {
    let mut runs = Vec::new();
    for i in 0..seeds {
        runs.push(run(seed + i));
        progress((i + 1) as f64 / seeds as f64);
    }
    let mean = |of: &dyn Fn(&LocalisationRun) -> f64| runs.iter().map(of).sum::<f64>() / runs.len().max(1) as f64;
    let worst = |of: &dyn Fn(&LocalisationRun) -> f64| round(runs.iter().map(of).fold(0.0, f64::max));
    let (without, with, dirty) = (mean(&|r| r.without_m), mean(&|r| r.with_m), mean(&|r| r.with_outliers_m));
    let (ratio, outlier_ratio) = (round(with / without), round(dirty / with));
    Localisation {
        mean_m: [("without", round(without)), ("with", round(with)), ("with_outliers", round(dirty))].into(),
        ratio,
        outlier_ratio,
        max: [
            ("with", worst(&|r| r.with_m / r.without_m)),
            ("with_outliers", worst(&|r| r.with_outliers_m / r.with_m)),
        ]
        .into(),
        reached: ratio <= 1.0 / 3.0 && outlier_ratio <= 1.2,
        runs,
    }
}

fn round(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

fn run(seed: u64) -> LocalisationRun {
    let (clean, _) = fly_with_outliers(seed, 0.0);
    let (dirty, outliers) = fly_with_outliers(seed, 0.1);
    LocalisationRun {
        seed,
        without_m: round(clean.mean_error(&clean.reckoned)),
        with_m: round(clean.mean_error(&clean.relayed)),
        with_outliers_m: round(dirty.mean_error(&dirty.relayed)),
        outliers,
    }
}

/// A way of 3 km in which a share of the fixes are outliers: in equal parts echoes at the head, a GPS that is led astray,
/// and fixes that are off although neither was noticed.
pub fn fly_with_outliers(seed: u64, outliers: f64) -> (Tracks, BTreeMap<&'static str, u64>) {
    LocalisationTrial::new(seed, outliers).fly()
}

/// The fault of a fix.
#[derive(Clone, Copy)]
enum Outlier {
    /// Bearing and elevation, radians, are those of an echo.
    Echo(f64, f64),
    /// The GPS is led astray: direction and distance, each 0..1.
    Astray(f64, f64),
    /// The relay was fooled: its fix is off by so much east and north, metres.
    Fooled(f64, f64),
}

/// The random events of a fix.
#[derive(Clone, Copy)]
struct FixDraw {
    outlier: Option<Outlier>,
    is_lost: bool,
    wait_s: f64,
}

impl FixDraw {
    /// As many draws whatever comes out, so that runs with and without outliers meet the same noise.
    fn draw(rng: &mut RandomStream, outliers: f64) -> Self {
        let [draw, kind, a, b, loss, wait] = [(); 6].map(|()| rng.uniform());
        let turn = a * std::f64::consts::TAU;
        let outlier = match (kind * 3.0) as u32 {
            0 => Outlier::Astray(a, b),
            1 => Outlier::Echo(turn, (1.0 - 2.0 * b).asin()),
            _ => Outlier::Fooled((15.0 + 185.0 * b) * turn.sin(), (15.0 + 185.0 * b) * turn.cos()),
        };
        Self { outlier: (draw < outliers).then_some(outlier), is_lost: loss < LOSS, wait_s: wait * MAX_WAIT_S }
    }
}

/// A fix on its way down.
struct UnderWay {
    slot: Vec<u8>,
    arrives: Instant,
    /// One-way propagation, which the link measures and adds to the age.
    travel: Duration,
}

struct LocalisationTrial {
    outliers: f64,
    rng: RandomStream,
    sensors: Sensors,
    head: UsblHead,
    ship: Ship,
    navigator: Navigator,
    reckoner: Navigator,
    under_way: Vec<UnderWay>,
    tracks: Tracks,
    counts: BTreeMap<&'static str, u64>,
}

impl LocalisationTrial {
    fn new(seed: u64, outliers: f64) -> Self {
        let usbl = UsblConfig { outlier_probability: 0.0, ..UsblConfig::default() };
        Self {
            outliers,
            rng: RandomStream::new(seed, &[7]),
            sensors: Sensors::new(seed),
            head: UsblHead::new(usbl, seed),
            ship: Ship::new(seed),
            navigator: Navigator::new(0.0, 0.0, DEPTH_M, DRIFT),
            reckoner: Navigator::new(0.0, 0.0, DEPTH_M, DRIFT),
            under_way: Vec::new(),
            tracks: Tracks::default(),
            counts: BTreeMap::new(),
        }
    }

    fn fly(mut self) -> (Tracks, BTreeMap<&'static str, u64>) {
        let mut at = (0.0, 0.0);
        for second in 1..=(f64::from(TRACK_M) / SPEED_M_S) as u32 {
            let now = Instant::from_secs_f64(f64::from(second));
            let heading = heading(f64::from(second) * SPEED_M_S);
            let step = (heading.sin() * SPEED_M_S, heading.cos() * SPEED_M_S);
            at = (at.0 + step.0, at.1 + step.1);
            let (dx, dy) = self.sensors.measure(step);
            for navigator in [&mut self.navigator, &mut self.reckoner] {
                navigator.handle_odometry(dx, dy, heading, DEPTH_M, now);
            }
            let draw = (second % FIX_PERIOD_S == 0).then(|| FixDraw::draw(&mut self.rng, self.outliers));
            if let Some(FixDraw { outlier: Some(Outlier::Astray(direction, distance)), .. }) = draw {
                self.ship.lead_astray(direction, distance);
            }
            self.ship.step(second, now);
            if let Some(draw) = draw {
                self.sight(at, &draw, now);
            }
            self.deliver(now);
            self.tracks.truth.push(at);
            self.tracks.reckoned.push(self.reckoner.position().xy());
            self.tracks.relayed.push(self.navigator.world().xy());
            self.tracks.ship.push(self.ship.at);
        }
        for (fault, n) in self.ship.relay.faults() {
            *self.counts.entry(fault.name()).or_default() += n;
        }
        *self.counts.entry("gps").or_default() += self.ship.relay.gps_outliers();
        (self.tracks, self.counts)
    }

    /// The head hears the vehicle, and the relay sends a fix.
    fn sight(&mut self, at: (f64, f64), draw: &FixDraw, now: Instant) {
        let from = NodePosition::new(self.ship.at.0, self.ship.at.1, 1.0);
        let target = NodePosition::new(at.0, at.1, DEPTH_M);
        let seen = self.head.measure(&from, &target, now.into());
        let mut sighting = UsblSighting {
            range_m: seen.range_m,
            bearing_rad: seen.bearing_rad,
            elevation_rad: seen.elevation_rad,
            accuracy_m: seen.accuracy_m,
            age_s: UsblConfig::default().latency.as_secs_f64(),
        };
        if let Some(Outlier::Echo(bearing_rad, elevation_rad)) = draw.outlier {
            (sighting.bearing_rad, sighting.elevation_rad) = (bearing_rad, elevation_rad);
        }
        let told = now + UsblConfig::default().latency;
        let Some(mut fix) = self.ship.sight(&sighting, DEPTH_M, told) else { return };
        if let Some(Outlier::Fooled(east, north)) = draw.outlier {
            fix.position = WorldPoint::new(fix.position.east_m + east, fix.position.north_m + north);
        }
        *self.counts.entry("sent").or_default() += 1;
        if draw.is_lost {
            return;
        }
        let wait = draw.wait_s;
        let leaves = told + Duration::from_secs_f64(wait);
        let slot = VersionedSlot::encode(1, 1, &Slot::Fix(Fix { age_s: fix.age_s + wait, ..fix }));
        let travel = Duration::from_secs_f64(seen.range_m / SOUND_M_S);
        self.under_way.push(UnderWay { slot, arrives: leaves + travel, travel });
    }

    fn deliver(&mut self, now: Instant) {
        for UnderWay { slot, arrives, travel } in self.under_way.extract_if(.., |u| u.arrives <= now) {
            let Ok(VersionedSlot { content: Some(Slot::Fix(fix)), .. }) = VersionedSlot::decode(&slot) else {
                continue;
            };
            let taken = arrives - travel - Duration::from_secs_f64(fix.age_s);
            let verdict = self.navigator.handle_fix(fix.position, fix.sigma_m, taken, now);
            let name = if verdict == FixVerdict::Used { "used" } else { "refused_by_vehicle" };
            *self.counts.entry(name).or_default() += 1;
            self.tracks.fixes.push((fix.position.xy(), verdict.is_used()));
        }
    }
}

/// Clockwise from north, after so many metres: legs of 400 m, 50 m apart, that advance to the north.
fn heading(way_m: f64) -> f64 {
    const LEG_M: f64 = 400.0;
    const STEP_M: f64 = 50.0;
    let lap = way_m % (2.0 * (LEG_M + STEP_M));
    let degrees = match lap {
        l if l < LEG_M => 90.0,
        l if l < LEG_M + STEP_M => 0.0,
        l if l < 2.0 * LEG_M + STEP_M => 270.0,
        _ => 0.0,
    };
    f64::to_radians(degrees)
}

/// Sensors whose error grows by the drift with the way whatever its shape: a current that they do not see, which turns
/// slowly, and beside it a compass and a log that are off by a third of the drift each.
struct Sensors {
    rng: RandomStream,
    current_towards: f64,
    compass: f64,
    log: f64,
}

impl Sensors {
    fn new(seed: u64) -> Self {
        let mut rng = RandomStream::new(seed, &[8]);
        let current_towards = rng.uniform() * std::f64::consts::TAU;
        let [compass, log] = [(); 2].map(|()| DRIFT / 3.0 * rng.normal());
        Self { rng, current_towards, compass, log }
    }

    fn measure(&mut self, (dx, dy): (f64, f64)) -> (f64, f64) {
        let way = dx.hypot(dy);
        self.current_towards += 0.01 * way.sqrt() * self.rng.normal();
        let (sin, cos) = self.compass.sin_cos();
        let (x, y) = ((dx * cos - dy * sin) * (1.0 + self.log), (dx * sin + dy * cos) * (1.0 + self.log));
        let unseen = DRIFT * way;
        (x - unseen * self.current_towards.sin(), y - unseen * self.current_towards.cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_relay_cuts_the_error_to_a_third_despite_outliers() {
        let found = localisation(1, 4, &mut |_| {});
        assert!(found.reached, "{found:?}");
    }

    #[test]
    fn dead_reckoning_drifts_by_its_percentage_repeatably() {
        let (tracks, _) = fly_with_outliers(3, 0.1);
        let (x, y) = *tracks.truth.last().unwrap();
        let (rx, ry) = *tracks.reckoned.last().unwrap();
        let drift = (x - rx).hypot(y - ry) / f64::from(TRACK_M);
        assert!((0.005..0.015).contains(&drift), "{drift} of the way");
        assert_eq!(fly_with_outliers(3, 0.1).0.relayed, tracks.relayed);
    }
}
