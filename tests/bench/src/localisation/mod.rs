//! The error of the vehicle's position, with and without the localisation relay.
//!
//! The code is that of the sea: sentences of a GPS are read, the relay fuses them with the USBL head's measurements,
//! the fix is encoded and decoded, and the vehicle's navigator takes it late. The track, the sensors, the losses of the
//! link and the time that a fix waits for its turn are simulated.

mod command;
mod plot;
mod ship;

pub(crate) use command::LocalisationBench;
pub use plot::localisation_plot;

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

/// Length of the track, metres.
const TRACK_M: u32 = 3000;
/// Speed of the vehicle, metres a second; at 1 a second is a metre.
const SPEED_M_S: f64 = 1.0;
/// Drift of dead reckoning per metre of track.
const DRIFT: f64 = 0.01;
const FIX_PERIOD_S: u32 = 10;
/// Probability that a fix is lost in the channel.
const LOSS: f64 = 0.1;
/// Maximum time that a fix waits for its turn, seconds.
const MAX_WAIT_S: f64 = 8.0;
const DEPTH_M: f64 = 30.0;
const SOUND_M_S: f64 = 1500.0;

/// The tracks of one run over 3 km.
#[derive(Debug, Clone, Default)]
pub struct Tracks {
    /// True position of the vehicle, each second.
    pub truth: Vec<(f64, f64)>,
    /// Estimated position without fixes, each second.
    pub reckoned: Vec<(f64, f64)>,
    /// Estimated position with fixes, each second.
    pub relayed: Vec<(f64, f64)>,
    /// Fixes that were sent, and whether the vehicle used each.
    pub fixes: Vec<((f64, f64), bool)>,
    /// Position of the surface vehicle, each second.
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
    /// Counts of the run with outliers: fixes sent, used, and refused by the relay or the vehicle, by reason.
    pub outliers: BTreeMap<&'static str, u64>,
}

/// The errors of all runs, and their means.
#[derive(Debug, Clone, Serialize)]
pub struct Localisation {
    pub runs: Vec<LocalisationRun>,
    /// Means over the runs, metres: `without`, `with`, `with_outliers`.
    pub mean_m: BTreeMap<&'static str, f64>,
    /// Ratio of the mean error with the relay to the one without.
    pub ratio: f64,
    /// Ratio of the mean error with outliers to the one without outliers.
    pub outlier_ratio: f64,
    /// The largest ratios of a single run: `with`, `with_outliers`.
    pub max: BTreeMap<&'static str, f64>,
    /// Whether `ratio` is at most 1/3 and `outlier_ratio` at most 1.2.
    pub reached: bool,
}

/// Runs `seeds` tracks, with the seeds from `seed` on.
pub fn localisation(seed: u64, seeds: u64, progress: &mut dyn FnMut(f64)) -> Localisation {
    let mut runs = Vec::new();
    for i in 0..seeds {
        runs.push(run(seed + i));
        progress((i + 1) as f64 / seeds as f64);
    }
    let mean = |of: &dyn Fn(&LocalisationRun) -> f64| runs.iter().map(of).sum::<f64>() / runs.len().max(1) as f64;
    let max_ratio = |of: &dyn Fn(&LocalisationRun) -> f64| round(runs.iter().map(of).fold(0.0, f64::max));
    let (without, with, dirty) = (mean(&|r| r.without_m), mean(&|r| r.with_m), mean(&|r| r.with_outliers_m));
    let (ratio, outlier_ratio) = (round(with / without), round(dirty / with));
    Localisation {
        mean_m: [("without", round(without)), ("with", round(with)), ("with_outliers", round(dirty))].into(),
        ratio,
        outlier_ratio,
        max: [
            ("with", max_ratio(&|r| r.with_m / r.without_m)),
            ("with_outliers", max_ratio(&|r| r.with_outliers_m / r.with_m)),
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
    let (clean, _) = run_with_outliers(seed, 0.0);
    let (dirty, outliers) = run_with_outliers(seed, 0.1);
    LocalisationRun {
        seed,
        without_m: round(clean.mean_error(&clean.reckoned)),
        with_m: round(clean.mean_error(&clean.relayed)),
        with_outliers_m: round(dirty.mean_error(&dirty.relayed)),
        outliers,
    }
}

/// A track of 3 km in which a share of the fixes are outliers: in equal parts echoes at the head, GPS errors, and
/// errors that the surface cannot detect.
pub fn run_with_outliers(seed: u64, outliers: f64) -> (Tracks, BTreeMap<&'static str, u64>) {
    LocalisationTrial::new(seed, outliers).fly()
}

/// The fault of a fix.
#[derive(Clone, Copy)]
enum Outlier {
    /// An echo with this bearing and elevation, radians.
    Echo(f64, f64),
    /// An error of the GPS: direction and distance, each 0..1.
    Astray(f64, f64),
    /// An undetected error of the fix, metres east and north.
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
    /// Always draws the same number of values, so that runs with and without outliers have the same noise.
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

/// A fix in transit to the vehicle.
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
                self.ship.disturb_gps(direction, distance);
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

    /// The head measures the vehicle, and the relay sends a fix.
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
        let reported_at = now + UsblConfig::default().latency;
        let Some(mut fix) = self.ship.sight(&sighting, DEPTH_M, reported_at) else { return };
        if let Some(Outlier::Fooled(east, north)) = draw.outlier {
            fix.position = WorldPoint::new(fix.position.east_m + east, fix.position.north_m + north);
        }
        *self.counts.entry("sent").or_default() += 1;
        if draw.is_lost {
            return;
        }
        let wait = draw.wait_s;
        let leaves = reported_at + Duration::from_secs_f64(wait);
        let slot = VersionedSlot::encode(1, &Slot::Fix(Fix { age_s: fix.age_s + wait, ..fix }));
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

/// Heading after a distance, radians clockwise from north: legs of 400 m, 50 m apart, that advance to the north.
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

/// Sensors whose error grows by the drift with the distance, for any shape of the track: they do not measure a slowly
/// turning current, and compass and log each have an error of a third of the drift.
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
        let path_m = dx.hypot(dy);
        self.current_towards += 0.01 * path_m.sqrt() * self.rng.normal();
        let (sin, cos) = self.compass.sin_cos();
        let (x, y) = ((dx * cos - dy * sin) * (1.0 + self.log), (dx * sin + dy * cos) * (1.0 + self.log));
        let unseen = DRIFT * path_m;
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
        let (tracks, _) = run_with_outliers(3, 0.1);
        let (x, y) = *tracks.truth.last().unwrap();
        let (rx, ry) = *tracks.reckoned.last().unwrap();
        let drift = (x - rx).hypot(y - ry) / f64::from(TRACK_M);
        assert!((0.005..0.015).contains(&drift), "{drift} of the track");
        assert_eq!(run_with_outliers(3, 0.1).0.relayed, tracks.relayed);
    }
}
