//! Depths, headings, heights above the sea floor and velocities that no vehicle can reach so fast.
//!
//! One false value must not end a mission or bend a map, nor must an autopilot that moves its home and so the zero of its depths. A
//! value that jumps is not used until it has stayed for a while; until then only its changes count. Of a depth that was right before, only
//! the changes count from then on.

use super::Step;
use scenecast_core::Reminder;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Bounds of one measured quantity.
struct Bounds {
    name: &'static str,
    counter: &'static str,
    unit: &'static str,
    /// Change in a second that a vehicle can make.
    rate: f64,
    /// Change at once that is no jump: noise, and steps of the sea floor.
    margin: f64,
    /// A value that stays for this time is right.
    persists: Duration,
    /// The least value that there is.
    least: f64,
    /// The size of a whole turn, for angles.
    turn: Option<f64>,
    /// Whether a value that jumps and stays, after others that agreed, has another zero.
    has_zero: bool,
}

const DEPTH: Bounds = Bounds {
    name: "depth",
    counter: "depth_jumps",
    unit: "m",
    rate: 3.0,
    margin: 2.0,
    persists: Duration::from_secs(3),
    least: 0.0,
    turn: None,
    has_zero: true,
};

const HEIGHT: Bounds = Bounds {
    name: "height above the sea floor",
    counter: "height_jumps",
    unit: "m",
    rate: 5.0,
    margin: 3.0,
    persists: Duration::from_secs(1),
    least: 0.0,
    turn: None,
    has_zero: false,
};

const HEADING: Bounds = Bounds {
    name: "heading",
    counter: "heading_jumps",
    unit: "degrees",
    rate: 180.0,
    margin: 45.0,
    persists: Duration::from_secs(1),
    least: f64::NEG_INFINITY,
    turn: Some(360.0),
    has_zero: false,
};

const VELOCITY_EAST: Bounds = Bounds {
    name: "velocity east",
    counter: "velocity_jumps",
    unit: "m/s",
    rate: 5.0,
    margin: 2.0,
    persists: Duration::from_secs(1),
    least: f64::NEG_INFINITY,
    turn: None,
    has_zero: false,
};

const PLACE_NORTH: Bounds = Bounds {
    name: "position north",
    counter: "position_jumps",
    unit: "m",
    rate: 20.0,
    margin: 5.0,
    persists: Duration::from_secs(1),
    least: f64::NEG_INFINITY,
    turn: None,
    has_zero: false,
};

/// Longitudes begin anew once around the Earth: 360 degrees of 111.32 km.
const PLACE_EAST: Bounds = Bounds { name: "position east", turn: Some(360.0 * 111_320.0), ..PLACE_NORTH };

const VELOCITY_NORTH: Bounds = Bounds { name: "velocity north", ..VELOCITY_EAST };

/// A value that was not used.
#[derive(Debug, PartialEq)]
pub struct Jump {
    /// The name of its counter.
    pub counter: &'static str,
    /// What people should read, ever more rarely while jumps go on.
    pub note: Option<String>,
}

/// One quantity as it was measured.
#[derive(Debug, Default)]
struct Series {
    /// The last value that was used.
    used: Option<(f64, Instant)>,
    /// Since when the used values follow each other.
    since: Option<Instant>,
    /// What is subtracted from measured values.
    zero: f64,
    /// The first and the last of the values that agree with each other, and not with the used one.
    other: Option<[(f64, Instant); 2]>,
    /// Limits the notes about jumps, which become rarer while jumps go on.
    jumps: Reminder,
    /// Notes of values that have stayed, and of zeros that have moved.
    settled: Reminder,
}

impl Series {
    /// Values that have followed each other for this time were right.
    const PROVEN: Duration = Duration::from_secs(10);

    /// The value to use in place of a measured one, and the jump if it is another one.
    fn check(&mut self, measured: f64, bounds: &Bounds, now: Instant) -> (f64, Option<Jump>) {
        let value = measured - self.zero;
        let Some((used, _)) = self.used.filter(|used| !bounds.can_follow(*used, (value, now))) else {
            (self.used, self.other) = (Some((value, now)), None);
            self.since.get_or_insert(now);
            return (value, None);
        };
        let before = self.other.filter(|[_, last]| bounds.can_follow(*last, (value, now)));
        let [first, last] = before.unwrap_or([(value, now); 2]);
        let moved = used + value - last.0;
        let tracked = moved.max(bounds.least);
        let (value, other, note) = if now.since(first.1) < bounds.persists {
            let note = if before.is_none() { self.note((used, value), bounds, now) } else { None };
            (tracked, Some([first, (value, now)]), note)
        } else if bounds.has_zero && self.since.is_some_and(|since| first.1.since(since) >= Self::PROVEN) {
            self.zero += value - tracked;
            let Bounds { name, unit, .. } = bounds;
            let note = format!("the zero of the {name} has moved by {:.1} {unit}: only its changes count", self.zero);
            (tracked, None, self.settled.handle(now).map(|_| note))
        } else {
            self.since = Some(now);
            let note = format!("the {} has stayed near {value:.1} {} and is used", bounds.name, bounds.unit);
            (value, None, self.settled.handle(now).map(|_| note))
        };
        (self.used, self.other) = (Some((value, now)), other);
        (value, Some(Jump { counter: bounds.counter, note }))
    }

    fn note(&mut self, (used, value): (f64, f64), bounds: &Bounds, now: Instant) -> Option<String> {
        let Bounds { name, unit, .. } = bounds;
        let more = match self.jumps.handle(now)? {
            1 => String::new(),
            n => format!("; it has jumped {n} times: check this sensor"),
        };
        Some(format!("the {name} jumps from {used:.1} to {value:.1} {unit}, which is not used unless it stays{more}"))
    }
}

impl Bounds {
    /// Whether a later value can follow an earlier one.
    fn can_follow(&self, (before, at): (f64, Instant), (value, now): (f64, Instant)) -> bool {
        let change = match self.turn {
            Some(turn) => (value - before + turn / 2.0).rem_euclid(turn) - turn / 2.0,
            None => value - before,
        };
        change.abs() <= self.margin + self.rate * now.since(at).as_secs_f64()
    }
}

/// The measured quantities of a track.
#[derive(Debug, Default)]
pub struct Plausible {
    depth: Series,
    height: Series,
    heading: Series,
    velocity: [Series; 2],
    place: [Series; 2],
}

impl Plausible {
    /// The depth that the sensor measures at the surface, metres; `None` while its last values are in doubt.
    #[must_use]
    pub fn depth_zero_m(&self) -> Option<f64> {
        self.depth.other.is_none().then_some(self.depth.zero)
    }

    /// Takes a position, metres north and east in any frame. Returns the jump that was found.
    pub fn check_place(&mut self, (north, east): (f64, f64), now: Instant) -> Option<Jump> {
        let [of_north, of_east] = &mut self.place;
        let (_, north_jump) = of_north.check(north, &PLACE_NORTH, now);
        let (_, east_jump) = of_east.check(east, &PLACE_EAST, now);
        // One line for both.
        north_jump.or(east_jump)
    }

    /// Whether the last position is one that no vehicle can reach so fast, and has not stayed yet.
    #[must_use]
    pub fn is_place_in_doubt(&self) -> bool {
        self.place.iter().any(|series| series.other.is_some())
    }

    /// The velocity east and north, metres a second, as far as it can be, and the jumps that were found.
    pub fn check_velocity(&mut self, (east, north): (f64, f64), now: Instant) -> ((f64, f64), Vec<Jump>) {
        let [of_east, of_north] = &mut self.velocity;
        let (east, east_jump) = of_east.check(east, &VELOCITY_EAST, now);
        let (north, mut north_jump) = of_north.check(north, &VELOCITY_NORTH, now);
        // One line for both.
        if east_jump.as_ref().is_some_and(|jump| jump.note.is_some()) {
            north_jump.iter_mut().for_each(|jump| jump.note = None);
        }
        ((east, north), [east_jump, north_jump].into_iter().flatten().collect())
    }

    /// The step with values that can be, and the jumps that were found.
    pub fn check(&mut self, step: Step, now: Instant) -> (Step, Vec<Jump>) {
        let (depth_m, depth_jump) = step.depth_m.map(|depth_m| self.depth.check(depth_m, &DEPTH, now)).unzip();
        let check_heading = |rad: f64| match self.heading.check(rad.to_degrees(), &HEADING, now) {
            (_, None) => (rad, None),
            (degrees, jump) => (degrees.to_radians(), jump),
        };
        let (heading_rad, heading_jump) = step.heading_rad.map(check_heading).unzip();
        let (altitude_m, height_jump) =
            step.altitude_m.map(|height_m| self.height.check(height_m, &HEIGHT, now)).unzip();
        let jumps = [depth_jump, heading_jump, height_jump].into_iter().flatten().flatten().collect();
        (Step { depth_m, heading_rad, altitude_m, ..step }, jumps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_velocity_that_jumps_is_used_once_it_stays() {
        let mut plausible = Plausible::default();
        let mut check = |velocity, tenths| plausible.check_velocity(velocity, at(tenths));
        assert_eq!(check((0.1, -0.2), 0).0, (0.1, -0.2));
        let (velocity, jumps) = check((15.0, -9.0), 1);
        assert!((velocity.0 - 0.1).hypot(velocity.1 + 0.2) < 1e-9 && jumps.len() == 2, "{velocity:?}");
        let notes: Vec<&String> = jumps.iter().filter_map(|jump| jump.note.as_ref()).collect();
        assert!(notes.len() == 1 && notes[0].starts_with("the velocity east jumps from 0.1 to 15.0 m/s"), "{notes:?}");
        assert_eq!(check((0.2, -0.3), 2), ((0.2, -0.3), Vec::new()), "it was one false value");
        let used: Vec<f64> = (3..20).map(|tenths| check((6.0, -0.3), tenths).0.0).collect();
        assert!(used[..10].iter().all(|v| *v < 1.0) && used[10..].iter().all(|v| *v == 6.0), "{used:?}");
    }

    fn at(tenths: u32) -> Instant {
        Instant::from_secs_f64(f64::from(tenths) / 10.0)
    }

    /// The depths that are used of measured ones, ten a second, and the notes.
    fn used(depths: impl IntoIterator<Item = f64>) -> (Vec<f64>, Vec<String>) {
        let mut plausible = Plausible::default();
        let mut notes = Vec::new();
        let steps = (0..).zip(depths).map(|(i, depth_m)| {
            let (step, jumps) = plausible.check(Step { depth_m: Some(depth_m), ..Step::default() }, at(i));
            notes.extend(jumps.into_iter().filter_map(|jump| jump.note));
            step.depth_m.unwrap()
        });
        (steps.collect(), notes)
    }

    #[test]
    fn one_false_depth_is_not_used_and_named_with_both_values() {
        let (depths, notes) = used((0..40).map(|i| if i == 20 { 42.0 } else { 5.0 }));
        assert_eq!(depths, [5.0; 40]);
        assert_eq!(notes, ["the depth jumps from 5.0 to 42.0 m, which is not used unless it stays"]);
    }

    #[test]
    fn after_a_lasting_jump_of_the_depth_only_changes_count() {
        let sunk = |i: i32| 0.02 * f64::from(i - 200);
        let (depths, notes) = used((0..2000).map(|i| if i < 200 { 5.0 } else { 42.0 + sunk(i) }));
        for (i, depth) in (200..).zip(&depths[200..]) {
            assert!((depth - 5.0 - sunk(i)).abs() < 1e-9, "{i}: {depth}");
        }
        assert_eq!(notes[1..], ["the zero of the depth has moved by 37.0 m: only its changes count"]);
    }

    #[test]
    fn a_zero_that_moves_back_is_followed() {
        let mut plausible = Plausible::default();
        let mut zeros = Vec::new();
        for i in 0..600 {
            let depth_m = if (200..400).contains(&i) { 42.0 } else { 5.0 };
            let (step, _) = plausible.check(Step { depth_m: Some(depth_m), ..Step::default() }, at(i));
            assert_eq!(step.depth_m, Some(5.0));
            zeros.push(plausible.depth_zero_m());
        }
        assert_eq!(
            [zeros[199], zeros[201], zeros[399], zeros[401], zeros[599]],
            [Some(0.0), None, Some(37.0), None, Some(0.0)]
        );
    }

    #[test]
    fn a_first_depth_that_was_wrong_is_replaced_after_three_seconds() {
        let (depths, notes) = used((0..100).map(|i| if i < 20 { 0.0 } else { 12.0 }));
        assert_eq!(depths.iter().position(|depth| *depth == 12.0), Some(50));
        assert_eq!(notes[1..], ["the depth has stayed near 12.0 m and is used"]);
    }

    #[test]
    fn the_fastest_dive_is_no_jump_even_after_a_silence() {
        let depths: Vec<f64> = (0..200).map(|i| 0.25 * f64::from(i)).collect();
        assert_eq!(used(depths.clone()), (depths, vec![]));
        let mut plausible = Plausible::default();
        for (tenths, depth_m) in [(0, 5.0), (200, 60.0)] {
            let (step, jumps) = plausible.check(Step { depth_m: Some(depth_m), ..Step::default() }, at(tenths));
            assert_eq!((step.depth_m, jumps), (Some(depth_m), vec![]));
        }
    }

    #[test]
    fn a_sensor_that_jumps_often_is_named_ever_more_rarely() {
        let (depths, notes) = used((0..2000).map(|i| if i % 10 == 5 { 42.0 } else { 5.0 }));
        assert!(depths.iter().all(|depth| *depth == 5.0));
        assert_eq!(notes.len(), 3);
        assert!(notes[1].ends_with("it has jumped 60 times: check this sensor"), "{}", notes[1]);
    }

    #[test]
    fn heights_that_alternate_are_named_twice_a_minute_at_most() {
        let mut plausible = Plausible::default();
        let mut notes = Vec::new();
        for i in 0..3000 {
            // A ledge: 3 m and 9 m above the sea floor, two seconds each.
            let altitude_m = Some(if i / 20 % 2 == 0 { 3.0 } else { 9.0 });
            let (_, jumps) = plausible.check(Step { altitude_m, ..Step::default() }, at(i));
            notes.extend(jumps.into_iter().filter_map(|jump| jump.note));
        }
        assert!(notes.len() <= 10, "{} in five minutes", notes.len());
        assert!(notes.iter().any(|note| note.ends_with("check this sensor")), "{notes:?}");
    }

    #[test]
    fn headings_are_compared_across_north_and_heights_by_themselves() {
        let mut plausible = Plausible::default();
        let mut check = |tenths, heading_deg: f64, altitude_m| {
            let step = Step { heading_rad: Some(heading_deg.to_radians()), altitude_m, ..Step::default() };
            let (step, jumps) = plausible.check(step, at(tenths));
            (step.heading_rad.unwrap().to_degrees().round(), step.altitude_m, jumps.len())
        };
        assert_eq!(check(0, 350.0, Some(4.0)), (350.0, Some(4.0), 0));
        assert_eq!(check(1, 10.0, None), (10.0, None, 0));
        assert_eq!(check(2, 170.0, Some(30.0)), (10.0, Some(4.0), 2));
        assert_eq!(check(3, 12.0, Some(4.5)), (12.0, Some(4.5), 0));
    }
}
