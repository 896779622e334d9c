//! One flight: a lawnmower survey of 600 s with a camera of 6.4 x 4.8 m at 0.5 frames/s.

use crate::floor::{Floor, View};
use crate::relief::Relief;
use scenecast_motion::Motion;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_registration::{CameraImage, FrameGraph, FrameInput, Registrar, Tally};
use scenecast_scoring::{PointPair, RigidFit};
use std::time::Instant;

/// The conditions of a flight.
#[derive(Clone, Copy)]
pub struct Case {
    pub name: &'static str,
    drift: f64,
    /// Amplitude of the compass deviation, degrees.
    deviation_deg: f64,
    /// Standard deviation of the altitude, as a share of it.
    altitude_noise: f64,
    relief_m: f64,
    /// Lamp, snow, blur and noise.
    is_murky: bool,
    frames: usize,
}

/// The result of a flight: errors in cells, times in milliseconds.
pub struct Outcome {
    pub dead: f64,
    pub placed: f64,
    pub p95: f64,
    /// Of the graph of all frames after the flight.
    pub solved: f64,
    pub ms: f64,
    pub slowest_ms: f64,
    pub tally: Tally,
}

const CELL_M: f64 = 0.25;
const COLUMNS: usize = 640;
const ROWS: usize = 480;
const METRES_PER_PIXEL: f64 = 0.01;
const ALTITUDE_M: f64 = 4.0;
const LEG_M: f64 = 4.5;

impl Case {
    pub fn all() -> Vec<Self> {
        let plain = Self {
            name: "1 %",
            drift: 0.01,
            deviation_deg: 0.0,
            altitude_noise: 0.0,
            relief_m: 0.0,
            is_murky: false,
            frames: 300,
        };
        let hard = Self { name: "hard", deviation_deg: 3.0, altitude_noise: 0.02, is_murky: true, ..plain };
        let relief = |name, relief_m| Self { name, relief_m, ..plain };
        vec![
            plain,
            Self { name: "3 %", drift: 0.03, ..plain },
            hard,
            relief("relief .1 m", 0.1),
            relief("relief .3 m", 0.3),
            relief("relief .45 m", 0.45),
            relief("relief .6 m", 0.6),
            relief("relief 1 m", 1.0),
        ]
    }

    /// 1000 frames in murky water.
    pub fn long() -> Self {
        Self {
            name: "long",
            drift: 0.01,
            deviation_deg: 0.0,
            altitude_noise: 0.0,
            relief_m: 0.0,
            is_murky: true,
            frames: 1000,
        }
    }
}

/// Flies once. Each `kind` has another relief.
pub fn fly(floor: &Floor, case: &Case, seed: u64, kind: u64) -> Outcome {
    let mut random = Random(seed);
    let relief = Relief::new(case.relief_m, kind);
    let legs = legs(floor);
    let mut motion = Motion::new(legs[0].0, legs[0].1, 0.5, case.drift, seed);
    let mut registrar = Registrar::new(case.drift);
    let (mut dead, mut offset) = (legs[0], (0.0, 0.0));
    let mut next = 1;
    let phase = random.unit() * std::f64::consts::TAU;
    let [mut believed, mut placed] = [const { Vec::new() }; 2];
    let (mut times, mut graph) = (Vec::new(), FrameGraph::default());
    for frame in 0..case.frames {
        for _ in 0..if frame == 0 { 0 } else { 4 } {
            let at = (dead.0 + offset.0, dead.1 + offset.1);
            let target = legs[next % legs.len()];
            next += usize::from((target.0 - at.0).hypot(target.1 - at.1) < 0.3);
            motion.set_target(Some(legs[next % legs.len()]));
            let step = motion.step(at, 0.5);
            // The odometry has the axes of the compass.
            let (sin, cos) = deviation(case, phase, motion.heading_rad).sin_cos();
            dead = (dead.0 + cos * step.dx_m + sin * step.dy_m, dead.1 + cos * step.dy_m - sin * step.dx_m);
        }
        let scale = 1.0 + case.altitude_noise * random.normal();
        let image = photograph((floor, &relief), case, &motion, scale, &mut random);
        let input = FrameInput {
            image: CameraImage::grey(COLUMNS, ROWS, &image).expect("the size of the image"),
            metres_per_pixel: METRES_PER_PIXEL,
            dead_reckoned: MapPoint::new(dead.0, dead.1),
            compass_rad: motion.heading_rad + deviation(case, phase, motion.heading_rad),
        };
        let start = Instant::now();
        let found = registrar.handle_frame(&input);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        graph.add(&found);
        let pose = found.pose;
        offset = (pose.at().x_m - dead.0, pose.at().y_m - dead.1);
        let true_at = (motion.x_m, motion.y_m);
        believed.push((dead, true_at));
        placed.push((pose.at().xy(), true_at));
    }
    let mut errors = errors_cells(&placed);
    if std::env::var_os("ERRORS").is_some() {
        errors.iter().enumerate().for_each(|(i, error)| eprintln!("{i} {error:.3}"));
    }
    let placed_rms = rms(&errors);
    errors.sort_by(f64::total_cmp);
    let solved: Vec<PointPair> =
        graph.solve().iter().zip(&placed).map(|(pose, (_, true_at))| (pose.at().xy(), *true_at)).collect();
    Outcome {
        dead: rms(&errors_cells(&believed)),
        placed: placed_rms,
        solved: rms(&errors_cells(&solved)),
        p95: errors[errors.len() * 95 / 100],
        ms: times.iter().sum::<f64>() / times.len() as f64,
        slowest_ms: times.iter().copied().fold(0.0, f64::max),
        tally: registrar.tally(),
    }
}

/// The distance of each point from its true place after the best rigid fit of all, cells.
fn errors_cells(track: &[PointPair]) -> Vec<f64> {
    let fit = RigidFit::new(track);
    let distance = |&(at, (x, y)): &PointPair| {
        let (fit_x, fit_y) = fit.apply(at);
        (fit_x - x).hypot(fit_y - y) / CELL_M
    };
    track.iter().map(distance).collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Amplitude times a harmonic of the heading, radians.
fn deviation(case: &Case, phase: f64, heading_rad: f64) -> f64 {
    case.deviation_deg.to_radians() * (heading_rad + phase).sin()
}

/// The ends of east-west legs, from the south and back again.
fn legs(floor: &Floor) -> Vec<(f64, f64)> {
    let [width, height] = floor.size_m();
    let (west, east) = (2.4, width - 2.4);
    let rows = ((height - 6.4) / LEG_M) as usize + 1;
    let mut legs = Vec::new();
    for row in (0..rows).chain((1..rows.max(2) - 1).rev()) {
        let y = 3.2 + row as f64 * LEG_M;
        let ends = [(west, y), (east, y)];
        legs.extend(if (legs.len() / 2).is_multiple_of(2) { ends } else { [ends[1], ends[0]] });
    }
    legs
}

fn photograph(
    (floor, relief): (&Floor, &Relief),
    case: &Case,
    motion: &Motion,
    scale: f64,
    random: &mut Random,
) -> Vec<u8> {
    let view = View {
        x_m: motion.x_m,
        y_m: motion.y_m,
        heading_rad: motion.heading_rad,
        metres_per_pixel: scale * METRES_PER_PIXEL,
        altitude_m: ALTITUDE_M,
        columns: COLUMNS,
        rows: ROWS,
    };
    let mut light = floor.view(&view, relief);
    if case.is_murky {
        blur(&mut light);
        for (i, value) in light.iter_mut().enumerate() {
            let right = (i % COLUMNS) as f32 / COLUMNS as f32 - 0.42;
            let down = (i / COLUMNS) as f32 / ROWS as f32 - 0.55;
            let lamp = 0.25 + 0.9 * (-4.0 * (right * right + down * down)).exp();
            *value = 0.7 * lamp * *value + 3.0 * random.normal() as f32;
        }
        snow(&mut light, random);
        for (x, y) in [(100, 80), (300, 350), (520, 200), (420, 60), (200, 250)] {
            blob(&mut light, (x, y), 12, -30.0);
        }
    }
    light.iter().map(|value| value.round().clamp(0.0, 255.0) as u8).collect()
}

/// A motion blur of 5 pixels along the track.
fn blur(light: &mut [f32]) {
    let source = light.to_vec();
    for (i, value) in light.iter_mut().enumerate() {
        let at = |k: usize| source[(i + k * COLUMNS).saturating_sub(2 * COLUMNS).min(source.len() - 1)];
        *value = (0..5).map(at).sum::<f32>() / 5.0;
    }
}

fn snow(light: &mut [f32], random: &mut Random) {
    for _ in 0..120 {
        let at = ((random.unit() * COLUMNS as f64) as usize, (random.unit() * ROWS as f64) as usize);
        blob(light, at, 1 + (random.unit() * 4.0) as usize, 60.0);
    }
}

fn blob(light: &mut [f32], (x, y): (usize, usize), radius: usize, by: f32) {
    for row in y.saturating_sub(radius)..(y + radius).min(ROWS) {
        for column in x.saturating_sub(radius)..(x + radius).min(COLUMNS) {
            light[row * COLUMNS + column] += by;
        }
    }
}

/// SplitMix64.
pub struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (radius, angle) = ((-2.0 * (1.0 - self.unit()).ln()).sqrt(), std::f64::consts::TAU * self.unit());
        radius * angle.cos()
    }
}
