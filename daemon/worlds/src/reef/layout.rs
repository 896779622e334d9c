//! The habitats of the reef: which of them lies where, and how high the floor rises.

use super::fields::{fbm, ramp};
use crate::noise::Noise;
use scene_model::random::{CounterRng, derive};

/// The middle of the world, metres.
const MIDDLE: [f32; 2] = [60.0, 40.0];

/// A rectangle of the world, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub west: f32,
    pub south: f32,
    pub east: f32,
    pub north: f32,
}

/// The shares of the habitats at a position, 0 to 1 each; the rest is sand.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Habitat {
    /// Metres above the nominal floor.
    pub relief_m: f32,
    /// Height of the reef's own lumps, metres.
    pub lump_m: f32,
    pub channel: f32,
    pub grass: f32,
    pub rubble: f32,
    pub reef: f32,
    /// Share of the reef under thickets of branching coral.
    pub thicket: f32,
    /// Share of the reef that is bare rock with boulders and algae.
    pub rock: f32,
}

impl Habitat {
    /// The values between two neighbours: `t` = 0 gives `self`, 1 gives `other`.
    #[inline]
    pub(super) fn towards(&self, other: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + t * (b - a);
        Self {
            relief_m: mix(self.relief_m, other.relief_m),
            lump_m: mix(self.lump_m, other.lump_m),
            channel: mix(self.channel, other.channel),
            grass: mix(self.grass, other.grass),
            rubble: mix(self.rubble, other.rubble),
            reef: mix(self.reef, other.reef),
            thicket: mix(self.thicket, other.thicket),
            rock: mix(self.rock, other.rock),
        }
    }
}

/// The place of the wreck and the direction of its keel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Berth {
    pub x: f32,
    pub y: f32,
    /// Cosine and sine of the keel's direction.
    pub turn: [f32; 2],
}

/// The plan of the world: reef on one side of a sand channel, meadows on the other, patches of each on both.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    noise: Noise,
    /// Signs of the axes of the plan, so that the reef lies on any side.
    flip: [f32; 2],
    /// Direction across the channel, from the meadows to the reef.
    across: [f32; 2],
    offset: f32,
    pub berth: Berth,
}

impl Layout {
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = CounterRng::new(derive(seed, 1));
        let mut between = |low: f64, high: f64| low + (high - low) * rng.unit();
        let mut sign = || if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let flip = [sign(), sign()];
        let (sin, cos) = between(0.2, 0.75).sin_cos();
        let place = [between(10.5, 12.5) as f32, between(-10.5, -8.0) as f32];
        let (keel_sin, keel_cos) = between(0.0, std::f64::consts::PI).sin_cos();
        let berth = Berth {
            x: MIDDLE[0] + flip[0] * place[0],
            y: MIDDLE[1] + flip[1] * place[1],
            turn: [keel_cos as f32, keel_sin as f32],
        };
        let offset = between(0.0, 200.0) as f32;
        Self { noise: Noise::new(derive(seed, 2)), flip, across: [cos as f32, sin as f32], offset, berth }
    }

    pub(super) fn at(&self, x: f32, y: f32) -> Habitat {
        let (n, o) = (&self.noise, self.offset);
        let wide = |at: f32| 6.0 * (n.value(x / 7.3 + at, y / 7.3) - 0.5);
        let fine = |at: f32| 1.7 * (fbm(n, x / 1.9 + at, y / 1.9, 3) - 0.5);
        let scour = self.clear_of_wreck(x, y);
        // The relief follows the wide bends only, because it has no ragged edges.
        let smooth = [x + wide(o), y + wide(o + 61.0)];
        let [x, y] = [smooth[0] + fine(o), smooth[1] + fine(o + 61.0)];
        let (exposure, bed) = self.exposure_and_bed(x, y, 2);
        let (rise, dip) = self.exposure_and_bed(smooth[0], smooth[1], 1);
        let [a, b] = askew(x, y);
        let channel = 1.0 - ramp(-0.5, 0.7, bed);
        let clear = (1.0 - channel) * scour;
        let reef = ramp(0.22, 0.40, exposure) * clear;
        let rubble = ramp(0.00, 0.16, exposure) * (1.0 - reef) * clear;
        let grass = ramp(0.04, 0.26, -exposure) * ramp(0.24, 0.42, n.value(b / 5.5 + 11.0, a / 5.5 + o)) * clear;
        let kind = 0.75 * n.value(b / 6.5 + 33.0, a / 6.5 + o) + 0.25 * n.value(a / 2.6, b / 2.6 + 50.0);
        let (thicket, rock) = (reef * ramp(0.58, 0.63, kind), reef * (1.0 - ramp(0.33, 0.38, kind)));
        let slow = n.value(smooth[0] / 27.0 + o, smooth[1] / 27.0) - 0.5;
        let relief_m = 2.0 * ramp(-0.1, 0.8, rise) + slow - 1.1 * (1.0 - ramp(-2.0, 2.4, dip));
        let lump_m =
            reef * 0.55 * (fbm(n, x / 1.5 + 9.0, y / 1.5, 3) - 0.5) + 0.05 * rubble * n.value(x / 0.9, y / 0.9);
        Habitat { relief_m, lump_m, channel, grass, rubble, reef, thicket, rock }
    }

    /// Exposure, which decides between meadow, sand, rubble and reef, and the distance from the channel's edge. The trend
    /// of both is the plan's, their patches are noise.
    fn exposure_and_bed(&self, x: f32, y: f32, octaves: u32) -> (f32, f32) {
        let (n, o) = (&self.noise, self.offset);
        let [a, b] = askew(x, y);
        let (u, v) = (self.flip[0] * (x - MIDDLE[0]), self.flip[1] * (y - MIDDLE[1]));
        let p = u * self.across[0] + v * self.across[1];
        let q = v * self.across[0] - u * self.across[1];
        // In the middle of the world a reef and a meadow are certain.
        let near = |east: f32, north: f32| {
            let (dx, dy) = (u - east, v - north);
            1.0 / (1.0 + (dx * dx + dy * dy) / 30.0)
        };
        let trend = 0.45 * p / (p * p + 36.0).sqrt() + 0.45 * near(8.5, 5.5) - 0.45 * near(-9.0, -4.0);
        let exposure = trend + 1.8 * (fbm(n, a / 14.0 + o, b / 14.0 + 7.0, octaves) - 0.5);
        let bed = (p + 1.0 - 5.0 * (n.value(q / 13.0 + o, 3.5) - 0.5)).abs() - 1.9 - 1.6 * n.value(q / 9.0, o);
        (exposure, bed)
    }

    /// 0 within a few metres of the wreck, where the floor is scoured sand, and 1 away from it.
    fn clear_of_wreck(&self, x: f32, y: f32) -> f32 {
        let [along, abeam] = self.berth.to_hull(x, y);
        let (a, b) = (along / 7.0, abeam / 3.4);
        ramp(0.85, 1.25, (a * a + b * b).sqrt() + 0.3 * (self.noise.value(x / 1.3, y / 1.3 + 20.0) - 0.5))
    }
}

/// Noise is blocky along its axes, so its axes lie askew.
fn askew(x: f32, y: f32) -> [f32; 2] {
    [0.83 * x + 0.557 * y, 0.83 * y - 0.557 * x]
}

impl Berth {
    /// Metres along the keel and to port of it.
    #[inline]
    pub(super) fn to_hull(self, x: f32, y: f32) -> [f32; 2] {
        let (dx, dy) = (x - self.x, y - self.y);
        [dx * self.turn[0] + dy * self.turn[1], dy * self.turn[0] - dx * self.turn[1]]
    }
}
