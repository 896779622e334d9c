//! Things that lie and grow on the floor: corals of several growth forms, boulders, rubble, shells, pits.

use super::fields::{Colour, ramp};
use super::ground::Spot;
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
    /// Mean radius, metres.
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
