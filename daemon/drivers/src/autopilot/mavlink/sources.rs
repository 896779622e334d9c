//! What a MAVLink network has for this end: the component that is the autopilot, the best height above the sea floor, texts for
//! people.
//!
//! A vehicle has many: companion computers, cameras and gimbals share the autopilot's system number, and a ground station and other
//! vehicles share its network. Only the autopilot's heartbeat says ArduPilot. Source: <https://mavlink.io/en/services/heartbeat.html>.

use super::MavlinkConfig;
use scenecast_protocol::time::Instant;
use std::collections::BTreeSet;
use std::mem::discriminant;
use std::time::Duration;

/// Counter of frames of other systems.
pub(super) const OTHER_SYSTEMS: &str = "other_systems";
/// Counter of frames of other components of the autopilot's system.
pub(super) const OTHER_COMPONENTS: &str = "other_components";
/// Counter of messages of another vehicle with the same numbers.
pub(super) const OTHER_VEHICLE: &str = "other_vehicle";

/// MAV_AUTOPILOT_ARDUPILOTMEGA, in the field `autopilot` of HEARTBEAT.
const ARDUPILOT: u8 = 3;
/// MAV_AUTOPILOT_INVALID: what all but autopilots should say.
const NO_AUTOPILOT: u8 = 8;
/// MAV_COMP_ID_AUTOPILOT1: the usual component of an autopilot.
const FIRST_AUTOPILOT: u8 = 1;
/// Antenna tracker, ground station, onboard computer, gimbal, ADS-B receiver, camera, charger, FLARM, servo, remote identification,
/// battery, parachute, log, display, IMU, GPS, winch: kinds (MAV_TYPE) that are no vehicle whatever autopilot they name.
const EQUIPMENT: [u8; 17] = [5, 6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42];
/// MAV_COMP_ID_CAMERA: components from here on are equipment, unless one is configured as the autopilot.
const FIRST_EQUIPMENT: u8 = 100;

/// Whether a heartbeat is the autopilot's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Claim {
    Autopilot,
    /// Of something else, with the name of its counter.
    Passed(&'static str),
}

/// The heartbeats that were heard.
#[derive(Debug, Default)]
pub(super) struct Sources {
    /// Systems and components that people were told of.
    named: BTreeSet<(u8, u8)>,
}

impl Sources {
    /// Most sources that are named.
    const MAX_NAMED: usize = 16;

    /// Whose heartbeat of a system and component it is, by its kind and autopilot, and what people should know of it, once.
    /// `current` is the component that is the autopilot and not silent.
    pub(super) fn judge(
        &mut self,
        config: &MavlinkConfig,
        (system, component): (u8, u8),
        (kind, autopilot): (u8, u8),
        current: Option<u8>,
    ) -> (Claim, Option<String>) {
        let is_equipment = EQUIPMENT.contains(&kind) || component >= FIRST_EQUIPMENT;
        let says_ardupilot = autopilot == ARDUPILOT && !is_equipment;
        if system != config.system {
            let note = || {
                let own = config.system;
                format!("system {system} is an ArduPilot too, and passed over: autopilot.system is {own}")
            };
            return (Claim::Passed(OTHER_SYSTEMS), self.once((system, component), says_ardupilot, note));
        }
        let is_autopilot = match config.component {
            Some(configured) => component == configured,
            None => {
                says_ardupilot && current.is_none_or(|current| component == current || component == FIRST_AUTOPILOT)
            }
        };
        if is_autopilot {
            return (Claim::Autopilot, None);
        }
        let is_of_other_make = !matches!(autopilot, ARDUPILOT | NO_AUTOPILOT) && component == FIRST_AUTOPILOT;
        let note = || match current.or(config.component) {
            _ if is_of_other_make => format!(
                "component {component} of system {system} has autopilot number {autopilot}, which is not ArduPilot (3): it is passed over"
            ),
            Some(used) => format!(
                "two autopilots answer as system {system}: component {used} is used, and component {component} passed over; autopilot.component chooses another one"
            ),
            None => format!("component {component} of system {system} is passed over"),
        };
        let is_named = says_ardupilot || is_of_other_make;
        (Claim::Passed(OTHER_COMPONENTS), self.once((system, component), is_named, note))
    }

    fn once(&mut self, source: (u8, u8), is_named: bool, note: impl FnOnce() -> String) -> Option<String> {
        let is_new = is_named && self.named.len() < Self::MAX_NAMED && self.named.insert(source);
        is_new.then(note)
    }
}

/// A height counts for this long.
const LASTS: Duration = Duration::from_secs(2);

/// The message that a height is from, the best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum HeightSource {
    /// The one with the lowest number is the best.
    DistanceSensor(u8),
    Rangefinder,
    Altitude,
}

/// The last height of the best source that is not old.
#[derive(Debug, Default)]
pub(super) struct Altimeter {
    last: Option<(HeightSource, f64, Instant)>,
}

impl Altimeter {
    /// Takes a height; that of a better source stays until it is old. Out of range of one of several distance sensors is no
    /// sign about the others.
    pub(super) fn handle(&mut self, source: HeightSource, height_m: Option<f64>, now: Instant) {
        let height_m = height_m.filter(|m| m.is_finite() && *m > 0.0);
        let counts = self.last.is_none_or(|(last, _, at)| {
            let is_other_beam = height_m.is_none() && source != last && discriminant(&source) == discriminant(&last);
            (source <= last || now.since(at) >= LASTS) && !is_other_beam
        });
        if counts {
            self.last = height_m.map(|m| (source, m, now));
        }
    }

    /// Metres above the sea floor, if they were measured not long ago.
    pub(super) fn height_m(&self, now: Instant) -> Option<f64> {
        self.last.filter(|(_, _, at)| now.since(*at) < LASTS).map(|(_, height_m, _)| height_m)
    }

    pub(super) fn forget(&mut self) {
        self.last = None;
    }
}

/// The last texts that were passed on, and one that is not complete.
#[derive(Debug, Default)]
pub(super) struct Texts {
    told: Vec<(String, Instant)>,
    /// Number of the text, number of its next part, the parts so far.
    begun: Option<(u16, u8, String)>,
}

impl Texts {
    /// The same text is passed on once in this time, and so many different ones.
    const PERIOD: Duration = Duration::from_secs(600);
    const MAX: usize = 20;
    /// Most parts of a text.
    const MAX_PARTS: u8 = 8;

    /// Joins the parts of a text in several messages: its number and that of the part, and whether it is the last. Returns what is
    /// complete, and what was begun and misses parts.
    pub(super) fn join(&mut self, (number, part): (u16, u8), text: String, is_end: bool) -> Vec<String> {
        let begun = self.begun.take();
        let (mut out, text) = match begun {
            Some((begun, next, before)) if number != 0 && (begun, next) == (number, part) => {
                (Vec::new(), before + &text)
            }
            Some((_, _, before)) => (vec![before], text),
            None => (Vec::new(), text),
        };
        if number == 0 || is_end || part >= Self::MAX_PARTS {
            out.push(text);
        } else {
            self.begun = Some((number, part + 1, text));
        }
        out
    }

    /// Whether a text is to be passed on.
    pub(super) fn is_news(&mut self, text: &str, now: Instant) -> bool {
        self.told.retain(|(_, at)| now.since(*at) < Self::PERIOD);
        let is_news = self.told.len() < Self::MAX && self.told.iter().all(|(told, _)| told != text);
        if is_news {
            self.told.push((text.to_owned(), now));
        }
        is_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const SUB: u8 = 12;

    fn config(component: Option<u8>) -> MavlinkConfig {
        MavlinkConfig { system: 1, component, arms: false, silence: Duration::from_secs(5) }
    }

    /// Whether it is taken for the autopilot, and whether it is named.
    fn judged(sources: &mut Sources, of: (u8, u8), says: (u8, u8), current: Option<u8>) -> (bool, bool) {
        let (claim, note) = sources.judge(&config(None), of, says, current);
        (claim == Claim::Autopilot, note.is_some())
    }

    #[test]
    fn only_a_heartbeat_of_ardupilot_is_the_autopilot() {
        let mut sources = Sources::default();
        assert_eq!(judged(&mut sources, (1, 1), (SUB, 3), None), (true, false));
        // Companion computer, camera, gimbal, ground station.
        for (component, kind, autopilot) in [(191, 18, 0), (191, SUB, 0), (100, 30, 8), (154, 26, 3), (190, 6, 8)] {
            assert_eq!(judged(&mut sources, (1, component), (kind, autopilot), None), (false, false), "{component}");
        }
        assert_eq!(judged(&mut sources, (1, 1), (2, 12), None), (false, true), "a PX4");
        assert_eq!(judged(&mut sources, (1, 1), (2, 12), None), (false, false), "it was named");
    }

    #[test]
    fn a_second_autopilot_takes_over_only_from_a_silent_one() {
        let mut sources = Sources::default();
        assert_eq!(judged(&mut sources, (1, 2), (SUB, 3), Some(1)), (false, true));
        assert_eq!(judged(&mut sources, (1, 2), (SUB, 3), Some(1)), (false, false));
        assert_eq!(judged(&mut sources, (1, 2), (SUB, 3), None), (true, false));
        assert_eq!(judged(&mut sources, (1, 1), (SUB, 3), Some(2)), (true, false), "the first autopilot by its number");
        assert_eq!(judged(&mut sources, (7, 1), (SUB, 3), Some(1)), (false, true), "another vehicle");
        let (claim, note) = sources.judge(&config(Some(2)), (1, 1), (SUB, 3), Some(2));
        assert_eq!((claim, note.is_some()), (Claim::Passed(OTHER_COMPONENTS), true));
        assert_eq!(sources.judge(&config(Some(9)), (1, 9), (18, 0), None).0, Claim::Autopilot, "as configured");
    }

    #[test]
    fn the_best_height_counts_until_it_is_old() {
        let at = |s: f64| Instant::from_secs_f64(s);
        let mut altimeter = Altimeter::default();
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(0.0));
        altimeter.handle(HeightSource::DistanceSensor(1), Some(4.0), at(0.1));
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(0.2));
        assert_eq!(altimeter.height_m(at(0.3)), Some(4.0));
        assert_eq!(altimeter.height_m(at(2.2)), None);
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(2.2));
        assert_eq!(altimeter.height_m(at(2.3)), Some(9.0));
        altimeter.handle(HeightSource::Rangefinder, None, at(2.4));
        assert_eq!(altimeter.height_m(at(2.5)), None, "out of range");
        // A second sensor that looks down, such as one of a longer range.
        for (number, height_m, is) in [
            (1, Some(4.0), Some(4.0)),
            (0, None, Some(4.0)),
            (0, Some(3.9), Some(3.9)),
            (1, None, Some(3.9)),
            (0, None, None),
        ] {
            altimeter.handle(HeightSource::DistanceSensor(number), height_m, at(2.6));
            assert_eq!(altimeter.height_m(at(2.7)), is, "{number} {height_m:?}");
        }
    }

    #[test]
    fn an_hour_of_warnings_is_logged_in_few_lines() {
        let mut texts = Texts::default();
        let told = |s: &u32| {
            texts.is_news(["PreArm: no GPS", "EKF variance"][(s % 2) as usize], Instant::from_secs_f64(f64::from(*s)))
        };
        assert_eq!((0..3600).filter(told).count(), 12);
        let all_different = |n: &u32| texts.is_news(&n.to_string(), Instant::from_secs_f64(5000.0));
        assert_eq!((0..1000).filter(all_different).count(), 20);
    }

    #[test]
    fn a_text_in_several_messages_is_one_text() {
        let mut texts = Texts::default();
        let mut join = |part, text: &str, is_end| texts.join(part, text.to_owned(), is_end);
        assert_eq!(join((0, 0), "alone", true), ["alone"]);
        assert!(join((7, 0), "a long ", false).is_empty());
        assert_eq!(join((7, 1), "text", true), ["a long text"]);
        assert!(join((8, 0), "cut ", false).is_empty());
        assert_eq!(join((9, 0), "next", true), ["cut ", "next"], "a part was lost");
    }

    #[test]
    fn equipment_is_no_second_autopilot() {
        let mut sources = Sources::default();
        for (component, kind) in [(156, 27), (100, 0), (1, 27), (154, 12)] {
            let (claim, note) = sources.judge(&config(None), (1, component), (kind, ARDUPILOT), Some(1));
            assert_eq!((claim, note), (Claim::Passed(OTHER_COMPONENTS), None), "{component} {kind}");
        }
    }
}
