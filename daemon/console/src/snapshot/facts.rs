//! Facts of the mission that the surface does not have, and mission time in the API.

use crate::state::{Origin, StorageInfo};
use crate::truth::Truth;
use scenecast_config::{self as config, Config};
use scenecast_core::LatLon;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use std::sync::Arc;

/// Facts of the mission that the surface does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionFacts {
    /// The name that people use.
    pub name: String,
    /// A random name of this mission at this surface, which a restart does not change. A browser keeps its data under it.
    pub run: String,
    /// Seconds of mission time for each second of the clock.
    pub speed: f64,
    /// Mission time at which the survey ended, seconds.
    pub ended_s: Option<f64>,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Longest pause between two turns of an idle link, seconds.
    pub idle_s: f64,
    /// Interval between two contacts to expect before one was measured, seconds.
    pub first_interval_s: f64,
    /// Bits on air of a full frame.
    pub frame_bits: u64,
    /// Energy of a bit on air, joules; `None` if energy is not counted.
    pub joules_per_bit: Option<f64>,
    /// The configured place of x = y = 0 on the Earth.
    pub origin: Option<Origin>,
    /// The folder in which the surface keeps its state, if it has one.
    pub storage: Option<StorageInfo>,
    /// The true classes of a simulated sea floor, once they are known.
    pub truth: Option<Arc<Truth>>,
}

impl MissionFacts {
    /// A mission that begins or continues; `run` is a random number for each mission.
    pub fn new(config: &Config, modem: &ModemProfile, run: u64, speed: f64) -> Self {
        Self {
            name: config.mission.name.clone(),
            run: format!("{:08x}", run as u32),
            speed,
            ended_s: None,
            cell_m: config::cell_m(config),
            idle_s: config.link.max_idle_s,
            first_interval_s: config.link.max_idle_s + config.link.max_turn_s,
            frame_bits: modem.bits_on_air(modem.frame_bytes),
            joules_per_bit: config::joules_per_bit(config, modem),
            origin: configured_origin(config),
            storage: None,
            truth: None,
        }
    }
}

fn configured_origin(config: &Config) -> Option<Origin> {
    // At a pole there is no east.
    let LatLon { lat_deg, lon_deg } = config.mission.origin_deg.filter(|o| o.lat_deg.abs() < 90.0)?;
    Some(Origin { lat_deg, lon_deg })
}

/// Mission time in the API, rounded to a hundredth of a second.
pub(crate) fn seconds(at: Instant) -> f64 {
    (at.as_secs_f64() * 100.0).round() / 100.0
}
