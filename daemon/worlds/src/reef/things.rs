//! Things that lie and grow on the floor: corals of several growth forms, boulders, rubble, shells, a small wooden wreck.

use super::WRECK;
use super::fields::{Colour, blend, fbm, ramp, scale};
use super::ground::Spot;
use super::layout::{Berth, Region};
use super::patterns::patterns;
use crate::noise::Noise;

/// The growth form of a coral, or the kind of another thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A dome with winding grooves.
    Brain,
    /// A smooth or lumpy dome.
    Massive,
    /// Knobs and branches with pale tips, seen from above.
    Branching,
    /// A thicket of long branches.
    Staghorn,
    /// A flat plate above the floor, with a pale rim.
    Plate,
    /// A thin crust on the rock.
    Crust,
    /// A leathery lobed soft coral.
    Soft,
    Boulder,
    /// A stick of dead coral.
    Stick,
    Shell,
    /// A pit that a ray has dug into the sand.
    Pit,
    Urchin,
}

/// One thing at its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing {
    pub x: f32,
    pub y: f32,
    /// Mean radius across the long axis, metres; the outline varies around it.
    pub radius_m: f32,
    /// Height of the floor under its middle.
    pub base_m: f32,
    pub form: Form,
    pub tone: Colour,
    /// Cosine and sine of its long axis.
    pub turn: [f32; 2],
    /// Length of the long axis in lengths of the short one.
    pub aspect: f32,
    pub key: u64,
}

impl Thing {
    /// The largest distance from the middle that it covers, metres.
    pub(super) fn reach_m(&self) -> f32 {
        self.radius_m * 1.3 * self.aspect.max(1.0)
    }

    /// Whether it is large enough to have a class of its own; others have that of the floor below them.
    pub(super) fn has_class(&self) -> bool {
        !matches!(self.form, Form::Stick | Form::Shell | Form::Pit)
    }

    /// Whether its height adds to that of whatever is below it, as that of a cloth does.
    pub(super) fn follows_floor(&self) -> bool {
        matches!(self.form, Form::Crust | Form::Stick | Form::Shell | Form::Urchin | Form::Pit)
    }

    /// Whether it changes the floor's height only, and not its colour.
    pub(super) fn is_pit(&self) -> bool {
        self.form == Form::Pit
    }

    /// The thing's surface at a place, if it covers the place.
    #[inline]
    pub(super) fn spot(&self, noise: &Noise, x: f32, y: f32) -> Option<Spot> {
        let (dx, dy) = (x - self.x, y - self.y);
        let along = (dx * self.turn[0] + dy * self.turn[1]) / (self.radius_m * self.aspect);
        let abeam = (dy * self.turn[0] - dx * self.turn[1]) / self.radius_m;
        let square = along * along + abeam * abeam;
        if square > 1.69 {
            return None;
        }
        let off = (self.key & 0xFF) as f32;
        let lobes = match self.form {
            Form::Crust | Form::Soft | Form::Pit => 1.1,
            Form::Boulder | Form::Staghorn => 0.9,
            Form::Stick | Form::Shell | Form::Urchin => 0.2,
            _ => 0.8,
        };
        let bend =
            0.6 * noise.value(along * 1.6 + off, abeam * 1.6) + 0.4 * noise.value(along * 3.9, abeam * 3.9 + off) - 0.5;
        // Turf and sediment gnaw at every edge.
        let gnaw = (noise.value(x / 0.11 + off, y / 0.11) + 0.4 * noise.value(x / 0.035 + off, y / 0.035) - 0.7)
            * (0.035 / self.radius_m.max(0.03)).min(0.5);
        // Lobes end before the reach does, so that nothing is cut off.
        let end = 0.6 * ramp(1.0, 1.3, square.sqrt());
        let d = square.sqrt() * (1.0 + lobes * bend) + gnaw + end;
        if d >= 1.0 {
            return None;
        }
        let mut spot = self.surface(noise, [x, y], d);
        spot.height_m += self.base_m;
        Some(spot)
    }
}

/// Half of the length and of the beam, metres.
const HALF_LENGTH_M: f32 = 5.6;
const HALF_BEAM_M: f32 = 1.75;

const WOOD: Colour = [0.115, 0.100, 0.072];
const RUST: Colour = [0.175, 0.098, 0.055];
const SILT: Colour = [0.215, 0.162, 0.108];

impl Berth {
    /// Whether the wreck may cover a part of the region.
    pub(super) fn touches(&self, region: &Region) -> bool {
        let reach = HALF_LENGTH_M + 0.6;
        let near = |low: f32, high: f32, at: f32| at + reach > low && at - reach < high;
        near(region.west, region.east, self.x) && near(region.south, region.north, self.y)
    }

    /// The wreck at a place, and the share of the floor that it covers there.
    pub(super) fn spot(&self, noise: &Noise, x: f32, y: f32) -> Option<(Spot, f32)> {
        let [along, abeam] = self.to_hull(x, y);
        if along.abs() > HALF_LENGTH_M + 0.2 || abeam.abs() > HALF_BEAM_M + 0.4 {
            return None;
        }
        // Growth and rot leave no straight line.
        let ragged = |at: f32| 0.20 * (fbm(noise, x / 0.5 + at, y / 0.5, 3) - 0.5);
        let [along, abeam] = self.to_hull(x + ragged(5.0), y + ragged(77.0));
        let t = along / HALF_LENGTH_M;
        if t.abs() >= 1.0 {
            return None;
        }
        // A pointed bow and a rounder stern.
        let fullness = if t > 0.0 { 1.0 - t * t } else { 1.0 - t * t * t * t };
        let side =
            HALF_BEAM_M * fullness.sqrt() * (1.0 + 0.10 * (noise.value(along / 0.9, 4.0 + abeam.signum()) - 0.5));
        let from_wall = side - abeam.abs();
        if from_wall < -0.05 {
            return None;
        }
        // Silt fills the hull, deepest along the keel, and buries most of what has fallen.
        let [dent_m, sunk, hue] = patterns().sand.at(x + 311.0, y + 177.0);
        let [lump_m, lump, stain] = patterns().rock.at(x + 101.0, y + 53.0);
        let [_, fine, _] = patterns().grit.at(y + 31.0, x + 7.0);
        let mound = fbm(noise, x / 1.1, y / 1.1 + 33.0, 2);
        let silt_m = 0.30 * (from_wall / side).min(0.6) + 0.45 * (mound - 0.35) + dent_m;
        let silt = scale(SILT, (0.3 + 0.7 * sunk) * (0.7 + 0.3 * fine));
        let mut spot = Spot { height_m: silt_m, colour: blend(silt, RUST, 0.45 * ramp(0.4, 0.8, hue)), class: WRECK };
        let worn = scale(blend(WOOD, RUST, 0.7 * ramp(0.5, 0.8, stain)), (0.25 + 0.8 * lump) * (0.4 + 0.7 * fine));
        // Silt drifts over the edge of the hull in both directions.
        let mut cover = ramp(-0.05, 0.15 + 0.9 * mound * mound, from_wall);
        let mut put = |height_m: f32, colour: Colour| {
            let seen = ramp(-0.01, 0.02, height_m - spot.height_m);
            cover = cover.max(seen);
            spot.height_m += seen * (height_m - spot.height_m);
            spot.colour = blend(spot.colour, colour, seen);
        };
        let [heap_m, heap, _] = patterns().rubble.at(x + 51.0, y + 3.0);
        put(0.03 + 1.2 * heap_m + 0.7 * (mound - 0.45), scale(blend(WOOD, SILT, 0.35), 0.25 + 0.85 * heap));
        for timber in &TIMBERS {
            if let Some(height_m) = timber.height_m(along, abeam) {
                put(height_m + 0.4 * lump_m, worn);
            }
        }
        // The planking stands where it has not fallen, and leans outwards.
        let broken =
            0.6 * noise.value(along / 1.6 + 60.0, 3.0 + 5.0 * abeam.signum()) + 0.4 * noise.value(along / 0.4, 7.0);
        let standing = ramp(0.46, 0.60, broken);
        let thick = (0.05 + 0.14 * mound) * standing;
        if standing > 0.1 && from_wall < thick {
            let round = 1.0 - (2.0 * from_wall.max(0.0) / thick - 1.0).powi(2);
            put(0.20 + 0.30 * standing + 0.5 * thick * round + 0.7 * lump_m, worn);
        }
        // The boiler, half sunk, with its hoops.
        let (a, b) = ((along + 1.6 + 0.2 * abeam) / 0.85, (abeam - 0.25) / 0.43);
        if a.abs() < 0.97 + 0.1 * stain && b.abs() < 1.0 {
            let hoop = ramp(0.10, 0.06, (2.5 * a - (2.5 * a).round()).abs());
            let rust = scale(blend(RUST, WOOD, 0.8 * stain), (0.45 + 0.55 * lump) * (0.4 + 0.6 * fine));
            let top = (1.0 - b * b).sqrt();
            put(0.16 + 0.40 * top + 0.025 * hoop + 0.25 * lump_m, blend(rust, silt, 0.6 * ramp(0.6, 1.0, top) * hue));
        }
        spot.colour = scale(spot.colour, 0.8 + 0.4 * mound);
        Some((spot, cover))
    }
}

/// A fallen timber in the hull: a long beam with round edges, one end of which is buried.
struct Timber {
    /// The middle, metres along the keel and to port of it.
    at: [f32; 2],
    /// Cosine and sine of its direction against the keel.
    turn: [f32; 2],
    half_length_m: f32,
    half_width_m: f32,
    tilt: f32,
}

const fn timber(at: [f32; 2], turn: [f32; 2], half_length_m: f32, half_width_m: f32, tilt: f32) -> Timber {
    Timber { at, turn, half_length_m, half_width_m, tilt }
}

const TIMBERS: [Timber; 9] = [
    timber([0.4, -0.1], [0.995, 0.100], 2.7, 0.115, 0.03),
    timber([2.4, 0.5], [0.340, 0.940], 1.0, 0.085, 0.22),
    timber([3.1, -0.4], [-0.200, 0.980], 0.8, 0.075, 0.20),
    timber([1.1, -0.8], [0.500, -0.866], 0.9, 0.080, -0.25),
    timber([-3.2, 0.3], [0.100, 0.995], 1.1, 0.090, 0.18),
    timber([-3.9, -0.6], [0.640, 0.768], 0.9, 0.070, -0.20),
    timber([-0.4, 0.9], [0.940, -0.342], 1.3, 0.070, 0.10),
    timber([-2.6, -0.9], [0.906, 0.423], 0.8, 0.095, 0.15),
    timber([0.3, 0.5], [0.259, 0.966], 0.8, 0.070, -0.28),
];

impl Timber {
    fn height_m(&self, along: f32, abeam: f32) -> Option<f32> {
        let (dx, dy) = (along - self.at[0], abeam - self.at[1]);
        let t = dx * self.turn[0] + dy * self.turn[1];
        let across = (dy * self.turn[0] - dx * self.turn[1]) / self.half_width_m;
        if t.abs() > self.half_length_m || across.abs() > 1.0 {
            return None;
        }
        let round = (1.0 - across * across).sqrt();
        Some(0.20 + self.tilt * t + 1.3 * self.half_width_m * round)
    }
}
