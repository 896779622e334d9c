//! Waypoints as NMEA 0183 sentences, for an autopilot that reads them or for a file.
//!
//! Every second, while there is a waypoint, the driver writes
//!
//! ```text
//! $SCWPL,ddmm.mmmmm,N,dddmm.mmmmm,E,SC*hh                              waypoint, where the mission's origin is known
//! $SCRMB,A,0.00,L,,SC,ddmm.mmmmm,N,dddmm.mmmmm,E,miles,degrees,,V*hh   way to it
//! $PSCWP,east,north,depth*hh                                           metres still to go, depth or nothing
//! ```
//! and `$PSCHD*hh` while the vehicle holds its position. The driver reads positions (GGA, GNS, RMC, GLL), headings (HDT, THS, or else
//! the course while under way), depths of the water (DBS) and heights of the transducer above the sea floor (DPT, DBT); the vehicle's
//! depth is the difference of the two. A position, a heading or a depth that is not known, or not any more, is named.

use super::lasting::{Lasting, absence_text};
use super::soundings::Soundings;
use super::{Autopilot, Counters, Goal, Health, Outbox, Step};
use scenecast_core::gps::{Gps, GpsLanguage};
use scenecast_core::{LatLon, Lines, TangentPlane, nmea};
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A heading of a compass counts for this long.
const HEADING_LASTS: Duration = Duration::from_secs(10);

/// A heading that is missing for this long is named.
const UNKNOWN_AFTER: Duration = Duration::from_secs(3);

/// A state machine of lines.
#[derive(Debug)]
pub struct Nmea {
    gps: Gps,
    lines: Lines,
    contact: Contact,
    soundings: Soundings,
    /// Lasts while no compass gives a heading, and is noted after [`UNKNOWN_AFTER`].
    heading_absence: Lasting,
    /// Whether a magnetic heading was heard.
    hears_magnetic: bool,
    at: Option<(LatLon, Instant)>,
    /// Other sentences come in without a position.
    position_absence: Lasting,
    goal: Option<Goal>,
    has_order: bool,
    second: Instant,
    outbox: Outbox,
}

/// Whether sentences come in, and what was noted of it.
#[derive(Debug)]
struct Contact {
    /// Whether answers are expected; not of a file.
    answers: bool,
    silence: Duration,
    heard: Option<Instant>,
    /// Lasts while no sentence has ever come in, and is noted after `silence`.
    absence: Lasting,
    was_silent: bool,
}

impl Contact {
    fn new(answers: bool, silence: Duration) -> Self {
        Self { answers, silence, heard: None, absence: Lasting::default(), was_silent: false }
    }

    fn handle_sentence(&mut self, outbox: &mut Outbox, now: Instant) {
        if self.heard.is_none() || self.was_silent {
            outbox.note("the autopilot answers");
        }
        (self.heard, self.was_silent) = (Some(now), false);
    }

    /// Notices that no sentence comes in, or none any more.
    fn watch(&mut self, health: Health, outbox: &mut Outbox, now: Instant) {
        if health == Health::Awaited && self.absence.is_news(self.silence, now) {
            outbox.note(absence_text("sentence", self.silence));
        }
        if health == Health::Silent && !std::mem::replace(&mut self.was_silent, true) {
            outbox.count("silences");
            outbox.note("the autopilot does not answer any more");
        }
    }

    /// The health; `is_position_lost`: sentences come in without a position.
    fn health(&self, is_position_lost: bool, now: Instant) -> Health {
        match self.heard {
            _ if !self.answers => Health::InCommand,
            None => Health::Awaited,
            Some(at) if now.since(at) >= self.silence => Health::Silent,
            Some(_) if is_position_lost => Health::NotInCommand,
            Some(_) => Health::InCommand,
        }
    }
}

impl Nmea {
    /// `answers`: whether the vehicle reports its position; a silence of `silence` then counts.
    pub fn new(answers: bool, silence: Duration, now: Instant) -> Self {
        Self {
            gps: Gps::new(GpsLanguage::Nmea),
            lines: Lines::new(nmea::MAX_LINE),
            contact: Contact::new(answers, silence),
            soundings: Soundings::default(),
            heading_absence: Lasting::default(),
            hears_magnetic: false,
            at: None,
            position_absence: Lasting::default(),
            goal: None,
            has_order: false,
            second: now,
            outbox: Outbox::default(),
        }
    }

    fn write(&mut self, body: &str) {
        self.outbox.write(nmea::line(body).into_bytes());
    }

    fn say_goal(&mut self) {
        let Some(goal) = self.goal else { return self.write("PSCHD") };
        if let Some(place) = goal.place {
            let fields = nmea::place_fields(place);
            self.write(&format!("SCWPL,{fields},SC"));
            let miles = goal.east_m.hypot(goal.north_m) / 1852.0;
            let bearing = goal.east_m.atan2(goal.north_m).to_degrees().rem_euclid(360.0);
            self.write(&format!("SCRMB,A,0.00,L,,SC,{fields},{miles:.3},{bearing:.1},,V"));
        }
        let depth = goal.depth_m.map_or(String::new(), |d| format!("{d:.1}"));
        self.write(&format!("PSCWP,{:.1},{:.1},{depth}", goal.east_m, goal.north_m));
    }

    fn handle_place_of_vehicle(&mut self, place: LatLon, now: Instant) {
        if self.position_absence.end() {
            self.outbox.note("the autopilot reports its position again");
        }
        let heading_rad = self.heading_rad(now);
        if let Some((before, at)) = self.at.replace((place, now)) {
            let (dx_m, dy_m) = TangentPlane::new(before).to_plane(place);
            let passed = now.since(at);
            if dx_m.hypot(dy_m) > 20.0 * passed.as_secs_f64().max(0.1) {
                self.outbox.count("jumps");
                self.outbox
                    .note(format!("the position jumps by {:.0} m: this is no way of the vehicle", dx_m.hypot(dy_m)));
                return self.push_step(0.0, 0.0, heading_rad, passed, now);
            }
            if let Some(goal) = &mut self.goal {
                (goal.east_m, goal.north_m) = (goal.east_m - dx_m, goal.north_m - dy_m);
            }
            self.push_step(dx_m, dy_m, heading_rad, Duration::ZERO, now);
        }
    }

    /// Where the bow points: an old heading of a compass is better than the course, which may be astern.
    fn heading_rad(&mut self, now: Instant) -> Option<f64> {
        let compass = self.gps.compass_rad(HEADING_LASTS, now);
        if compass.is_some() {
            self.heading_absence.end();
        } else if self.heading_absence.is_news(UNKNOWN_AFTER, now) {
            self.outbox.count("headings_unknown");
            let magnetic = if self.hears_magnetic { "; HDM and HDG are magnetic and not used" } else { "" };
            self.outbox.note(format!(
                "the vehicle's GPS reports no heading (HDT or THS): its course counts while it is under way, and images have no pose \
                 otherwise{magnetic}"
            ));
        }
        compass.or_else(|| self.gps.course_rad(now))
    }

    fn push_step(&mut self, dx_m: f64, dy_m: f64, heading_rad: Option<f64>, unseen: Duration, now: Instant) {
        let altitude_m = self.soundings.height_m(now);
        let depth_m = self.soundings.depth_m(&mut self.outbox, now);
        self.outbox
            .walk_measured(Step { dx_m, dy_m, heading_rad, depth_m, altitude_m, unseen, ..Step::default() }, now);
    }

    /// Soundings, and magnetic headings, which are only noticed.
    fn handle_sensor(&mut self, fields: &[&str], now: Instant) {
        let formatter = fields.first().and_then(|field| field.get(2..)).unwrap_or_default();
        self.hears_magnetic |= matches!(formatter, "HDM" | "HDG");
        self.soundings.handle(formatter, fields, &mut self.outbox, now);
    }

    /// Notices that other sentences come in without a position.
    fn watch_position(&mut self, now: Instant) {
        if self.is_position_lost(now) && self.position_absence.is_news(Duration::ZERO, now) {
            self.outbox.count("position_losses");
            self.outbox.note("the autopilot reports no position any more");
        }
    }

    /// Whether it has reported positions, and does not any more; of a receiver that never had one `Gps` gives the reason.
    fn is_position_lost(&self, now: Instant) -> bool {
        self.at.is_some_and(|(_, at)| now.since(at) >= self.contact.silence)
    }
}

impl Autopilot for Nmea {
    fn handle_open(&mut self, now: Instant) {
        self.lines.clear();
        self.gps.handle_open();
        self.second = now;
    }

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant) -> bool {
        let mut lines = Vec::new();
        self.lines.push(bytes, |line| lines.push(line.to_vec()));
        for line in lines {
            for fields in nmea::sentences(&line).filter_map(|sentence| nmea::fields(sentence).ok()) {
                self.handle_sensor(&fields, now);
                self.contact.handle_sentence(&mut self.outbox, now);
            }
            for fix in self.gps.handle_bytes(&[&line[..], b"\n"].concat(), now) {
                self.handle_place_of_vehicle(fix.place, now);
            }
            if let Some(note) = self.gps.poll_note() {
                self.outbox.note(note);
            }
        }
        // Any sounder has sentences.
        false
    }

    fn handle_timeout(&mut self, now: Instant) {
        if now < self.second {
            return;
        }
        self.second = now + Duration::from_secs(1);
        if self.has_order {
            self.say_goal();
        }
        let health = self.health(now);
        if health == Health::NotInCommand {
            self.watch_position(now);
        }
        self.contact.watch(health, &mut self.outbox, now);
    }

    fn poll_timeout(&self) -> Instant {
        self.second
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn set_goal(&mut self, goal: Option<Goal>, _now: Instant) {
        self.goal = goal.filter(Goal::is_finite);
        self.has_order = true;
    }

    fn handle_place(&mut self, _place: LatLon, _sigma_m: f64, _now: Instant) {}

    fn health(&self, now: Instant) -> Health {
        self.contact.health(self.is_position_lost(now), now)
    }

    fn counters(&self) -> Counters {
        let mut counters = self.outbox.counters.clone();
        counters.extend(self.gps.faults().map(|(fault, n)| (fault.name(), n)));
        counters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(s)
    }

    fn said(pilot: &mut Nmea) -> Vec<String> {
        std::iter::from_fn(|| pilot.poll_output()).map(|l| String::from_utf8(l).unwrap()).collect()
    }

    #[test]
    fn a_waypoint_is_sent_each_second_with_right_checksums() {
        let mut pilot = Nmea::new(false, Duration::from_secs(5), at(0.0));
        pilot.handle_timeout(at(0.0));
        assert!(said(&mut pilot).is_empty(), "nothing is ordered yet");
        let place = LatLon::new(29.5, 34.92);
        pilot.set_goal(Some(Goal { east_m: 30.0, north_m: 40.0, depth_m: Some(12.0), place }), at(1.0));
        pilot.handle_timeout(at(1.0));
        let lines = said(&mut pilot);
        assert_eq!(lines[0], "$SCWPL,2930.00000,N,03455.20000,E,SC*51\r\n");
        assert!(lines[1].starts_with("$SCRMB,A,0.00,L,,SC,2930.00000,N,03455.20000,E,0.027,36.9,,V*"), "{}", lines[1]);
        assert!(lines[2].starts_with("$PSCWP,30.0,40.0,12.0*"));
        assert!(lines.iter().all(|l| nmea::fields(l.as_bytes()).is_ok() && l.len() <= 82), "{lines:?}");
        pilot.set_goal(None, at(2.0));
        pilot.handle_timeout(at(2.0));
        assert_eq!(said(&mut pilot), [nmea::line("PSCHD")]);
    }

    #[test]
    fn positions_become_steps_and_silence_is_counted() {
        let mut pilot = Nmea::new(true, Duration::from_secs(5), at(0.0));
        let plane = TangentPlane::new(LatLon::new(29.5, 34.92).unwrap());
        for s in 0..3u32 {
            let place = nmea::place_fields(plane.to_place(f64::from(s), 0.0));
            let gga = nmea::line(&format!("GPGGA,0000{s:02},{place},1,9,1,0,M,0,M,,"));
            let depth = nmea::line("SDDBS,,f,12.0,M,,F")
                + &nmea::line(["SDDBT,,f,3.5,M,,F", "SDDPT,4.5,0.2", "SDDPT,,"][s as usize]);
            pilot.handle_bytes((nmea::line("HEHDT,90.0,T") + &depth + &gga).as_bytes(), at(f64::from(s)));
        }
        let steps: Vec<Step> = std::iter::from_fn(|| pilot.poll_step()).collect();
        assert_eq!(steps.len(), 2);
        assert_eq!([steps[0].altitude_m, steps[1].altitude_m], [Some(4.5), None], "the last sounder has no bottom");
        assert!((steps[0].dx_m - 1.0).abs() < 0.03 && steps[0].depth_m == Some(7.5), "{steps:?}");
        for s in 3..12 {
            pilot.handle_timeout(at(f64::from(s)));
        }
        assert_eq!((pilot.health(at(12.0)), pilot.counters()["silences"]), (Health::Silent, 1));
    }

    /// The steps and the lines of a vehicle that sends these sentences each second, beside a position 1 m further east.
    fn dive(seconds: u32, sentences: impl Fn(u32) -> Vec<&'static str>) -> (Vec<Step>, Vec<String>) {
        let mut pilot = Nmea::new(true, Duration::from_secs(5), at(0.0));
        let plane = TangentPlane::new(LatLon::new(29.5, 34.92).unwrap());
        for s in 0..seconds {
            let place = nmea::place_fields(plane.to_place(f64::from(s), 0.0));
            let gga = nmea::line(&format!("GPGGA,00{:02}{:02},{place},1,9,1,0,M,0,M,,", s / 60, s % 60));
            let lines: String = sentences(s).into_iter().map(nmea::line).chain([gga]).collect();
            pilot.handle_bytes(lines.as_bytes(), at(f64::from(s)));
            pilot.handle_timeout(at(f64::from(s)));
        }
        (std::iter::from_fn(|| pilot.poll_step()).collect(), std::iter::from_fn(|| pilot.poll_note()).collect())
    }

    #[test]
    fn a_missing_heading_is_named_once_and_no_default_replaces_it() {
        let (steps, notes) = dive(40, |s| if s < 5 { vec!["HEHDT,90.0,T"] } else { vec!["HCHDM,80.0,M"] });
        let known = steps.iter().filter(|step| step.heading_rad.is_some()).count();
        assert!(known == 13 && steps[0].heading_rad == Some(90f64.to_radians()), "{steps:?}");
        let named: Vec<&String> = notes.iter().filter(|note| note.contains("no heading (HDT or THS)")).collect();
        assert!(named.len() == 1 && named[0].ends_with("HDM and HDG are magnetic and not used"), "{notes:?}");
        let (steps, notes) = dive(40, |s| if s % 6 == 0 { vec!["HEHDT,90.0,T"] } else { vec![] });
        assert!(notes.len() == 1 && steps.iter().all(|step| step.heading_rad.is_some()), "{notes:?}");
    }

    #[test]
    fn a_height_above_the_depth_of_the_water_is_not_used_and_named() {
        // A second sounder, which measures the depth of another place.
        let (steps, notes) =
            dive(30, |_| vec!["HEHDT,90.0,T", "SDDBS,,f,14.0,M,,F", "SDDBT,,f,4.0,M,,F", "IIDBT,,f,40.0,M,,F"]);
        assert!(steps.iter().all(|s| s.depth_m == Some(10.0) && s.altitude_m == Some(4.0)), "{steps:?}");
        assert!(notes.len() == 2 && notes[1].contains("40.0 m, is greater than the depth of the water"), "{notes:?}");
        let (steps, _) = dive(30, |_| vec!["HEHDT,90.0,T", "IIDBT,,f,40.0,M,,F", "SDDBS,,f,14.0,M,,F"]);
        assert!(steps.iter().all(|s| s.depth_m.is_none() && s.altitude_m.is_none()), "{steps:?}");
    }

    #[test]
    fn a_position_that_stops_takes_it_out_of_command() {
        let mut pilot = Nmea::new(true, Duration::from_secs(5), at(0.0));
        let mut healths = Vec::new();
        for s in 0..30u32 {
            let now = at(f64::from(s));
            let quality = if (6..20).contains(&s) { "0,00,99.9" } else { "1,09,0.9" };
            let gga = nmea::line(&format!("GPGGA,0000{s:02},2930.0,N,03455.2,E,{quality},0,M,0,M,,"));
            pilot.handle_bytes((nmea::line("HEHDT,90.0,T") + &gga).as_bytes(), now);
            pilot.handle_timeout(now);
            healths.push(pilot.health(now));
        }
        assert_eq!(healths.iter().filter(|health| **health == Health::NotInCommand).count(), 10);
        assert_eq!([healths[9], healths[10], healths[20]].map(|h| h == Health::InCommand), [true, false, true]);
        let notes: Vec<String> = std::iter::from_fn(|| pilot.poll_note()).collect();
        let expected = [
            "the autopilot answers",
            "the autopilot reports no position any more",
            "the autopilot reports its position again",
        ];
        assert_eq!(notes, expected);
    }

    #[test]
    fn the_first_measured_depth_is_no_jump_from_a_default() {
        let (steps, notes) = dive(20, |s| match s {
            0..5 => vec!["HEHDT,90.0,T"],
            _ => vec!["HEHDT,90.0,T", "SDDBS,,f,14.0,M,,F", "SDDBT,,f,4.0,M,,F"],
        });
        assert!(steps[..4].iter().all(|step| step.depth_m.is_none()), "{steps:?}");
        assert!(steps[4..].iter().all(|step| step.depth_m == Some(10.0)), "{steps:?}");
        assert_eq!(notes, ["the autopilot answers"]);
    }
}
