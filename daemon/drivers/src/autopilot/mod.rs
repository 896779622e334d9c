//! Autopilots: state machines between the vehicle's role and the bytes of its flight controller.
//!
//! Waypoints go out, steps of the track come in, fixes go out. None of them does IO; `scenecast-runtime` moves their bytes.
//!
//! | kind | is |
//! |---|---|
//! | [`Mavlink`] | ArduSub as on a BlueROV2, ArduRover on a surface vehicle: MAVLink over serial or UDP |
//! | [`Nmea`] | NMEA 0183 sentences for other vehicles, or for a file |
//! | [`Rehearsed`] | a simulated vehicle |

mod lasting;
pub mod mavlink;
mod nmea;
mod outbox;
mod plausible;
mod soundings;

pub use mavlink::Mavlink;
pub use nmea::Nmea;
pub use outbox::Outbox;
pub use plausible::{Jump, Plausible};

use scenecast_core::LatLon;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Where the autopilot is to take the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// East of where the vehicle is now, metres.
    pub east_m: f64,
    /// North of where the vehicle is now, metres.
    pub north_m: f64,
    /// Depth below the surface, metres; `None`: as it is.
    pub depth_m: Option<f64>,
    /// The same place on the Earth, where that is known.
    pub place: Option<LatLon>,
}

impl Goal {
    /// Whether it is anywhere at all.
    fn is_finite(&self) -> bool {
        self.east_m.is_finite() && self.north_m.is_finite() && self.depth_m.is_none_or(f64::is_finite)
    }
}

/// A step of the track, as the autopilot measured it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Step {
    pub dx_m: f64,
    pub dy_m: f64,
    /// Heading clockwise from north, radians; `None` if it is not measured.
    pub heading_rad: Option<f64>,
    /// Depth below the surface, metres; `None` if it is not measured.
    pub depth_m: Option<f64>,
    /// Rotation about the forward axis, starboard down, radians; 0 if it is not measured.
    pub roll_rad: f64,
    /// Rotation about the starboard axis, bow up, radians; 0 if it is not measured.
    pub pitch_rad: f64,
    /// Height above the sea floor, metres, where it is measured.
    pub altitude_m: Option<f64>,
    /// Time without a credible report, in which the motion is unknown; the step covers the rest.
    pub unseen: Duration,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Health {
    /// No message was received yet.
    Awaited,
    /// It answered once, and does not any more.
    Silent,
    /// It answers but does not follow waypoints: it is disarmed, in a mode of the pilot's, or reports another target.
    NotInCommand,
    InCommand,
}

impl Health {
    /// Name in the log and for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Awaited => "awaited",
            Self::Silent => "silent",
            Self::NotInCommand => "not in command",
            Self::InCommand => "in command",
        }
    }

    /// Whether no autopilot carries out the vehicle's decisions.
    pub fn is_silent(self) -> bool {
        matches!(self, Self::Awaited | Self::Silent)
    }
}

/// Counters of an autopilot by name, for people.
pub type Counters = BTreeMap<&'static str, u64>;

/// An autopilot. `now` never goes back.
pub trait Autopilot: Send {
    /// The port was opened; earlier messages are forgotten.
    fn handle_open(&mut self, now: Instant);

    /// Bytes from its port, in pieces of any size. Anything may be in them. Returns whether the autopilot itself is certainly the
    /// sender, and no camera or ground station.
    fn handle_bytes(&mut self, bytes: &[u8], now: Instant) -> bool;

    fn handle_timeout(&mut self, now: Instant);

    fn poll_timeout(&self) -> Instant;

    fn outbox(&mut self) -> &mut Outbox;

    fn poll_output(&mut self) -> Option<Vec<u8>> {
        self.outbox().outputs.pop_front()
    }

    /// The next step of the track.
    fn poll_step(&mut self) -> Option<Step> {
        self.outbox().steps.pop_front()
    }

    /// Something that a person should read.
    fn poll_note(&mut self) -> Option<String> {
        self.outbox().notes.pop_front()
    }

    /// Sets the goal; `None`: hold position. The host repeats it about every second, as the autopilot may restart.
    fn set_goal(&mut self, goal: Option<Goal>, now: Instant);

    /// Where on the Earth the vehicle is, as known from fixes, with its standard deviation in metres.
    fn handle_place(&mut self, place: LatLon, sigma_m: f64, now: Instant);

    fn health(&self, now: Instant) -> Health;

    fn counters(&self) -> Counters;
}
