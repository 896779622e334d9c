//! Faults of modems: how long after each the data flow again, at the ship and at the vehicle.

mod command;
mod link;

pub(crate) use command::FaultsBench;

use serde::{Deserialize, Serialize};
use sim_channel::RandomStream;
use std::time::Duration;

/// A kind of modem as its users set it up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LinkKind {
    /// EvoLogics S2C, all data in instant messages
    S2cIm,
    /// EvoLogics S2C, bulk data in bursts
    S2cBurst,
    /// WHOI Micromodem at packet rate 1
    Micromodem1,
    /// WHOI Micromodem at packet rate 5
    Micromodem5,
    /// A byte pipe
    Transparent,
}

impl LinkKind {
    pub(crate) const ALL: [Self; 5] =
        [Self::S2cIm, Self::S2cBurst, Self::Micromodem1, Self::Micromodem5, Self::Transparent];

    /// The kind and the speed of the port, and the keys of both ends beside these.
    fn set_up(self) -> (&'static str, u32, &'static str) {
        match self {
            Self::S2cIm => ("s2c", 19_200, "modem.s2c_mode=im"),
            Self::S2cBurst => ("s2c", 19_200, "modem.s2c_mode=burst"),
            Self::Micromodem1 => ("micromodem", 19_200, "modem.rate=1"),
            Self::Micromodem5 => ("micromodem", 115_200, "modem.rate=5"),
            Self::Transparent => ("transparent", 9600, "link.frame_bytes=64"),
        }
    }

    /// The longest time until data flow again, seconds.
    pub(crate) fn limit_s(self) -> f64 {
        match self {
            Self::S2cBurst | Self::Micromodem5 | Self::Transparent => 8.0,
            Self::S2cIm | Self::Micromodem1 => 10.0,
        }
    }
}

/// The end whose modem or port has a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum FaultyEnd {
    Ship,
    Auv,
}

impl FaultyEnd {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ship => "ship",
            Self::Auv => "auv",
        }
    }
}

/// Each fault as the emulator names it, and how long it lasts, seconds.
pub(crate) const FAULTS: [(&str, u64); 9] = [
    (NO_FAULT, 0),
    ("reboot", 0),
    ("brown_out", 0),
    ("half_line", 0),
    ("big_buffer", 0),
    ("garbage", 3),
    ("busy", 3),
    ("freeze", 5),
    ("unplug", 5),
];

/// What the others are compared with; the emulator is told nothing.
const NO_FAULT: &str = "none";

/// Time from the end of one fault to the next one, if all goes well.
const PAUSE: Duration = Duration::from_secs(22);
/// Time before the first fault.
const SETTLING: Duration = Duration::from_secs(25);

/// A fault of a run, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PlannedFault {
    name: &'static str,
    end: FaultyEnd,
    /// Since the start of the run.
    at: Duration,
    length: Duration,
}

/// Each fault at each end once, in an order and at times that are drawn.
fn plan(seed: u64) -> Vec<PlannedFault> {
    let mut rng = RandomStream::new(seed, &[0xFA17]);
    let ends = [FaultyEnd::Ship, FaultyEnd::Auv];
    let mut left: Vec<_> = FAULTS.iter().flat_map(|fault| ends.map(|end| (*fault, end))).collect();
    let mut at = SETTLING;
    std::iter::from_fn(|| {
        let ((name, seconds), end) = (!left.is_empty()).then(|| left.swap_remove(rng.below(left.len())))?;
        at += Duration::from_secs_f64(2.0 * rng.uniform());
        let fault = PlannedFault { name, end, at, length: Duration::from_secs(seconds) };
        at += fault.length + PAUSE;
        Some(fault)
    })
    .collect()
}

/// What came of a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Recovery {
    pub(crate) kind: LinkKind,
    pub(crate) run: u32,
    pub(crate) fault: String,
    pub(crate) end: FaultyEnd,
    /// Seconds from the end of the fault until the ship had data of the vehicle, and the vehicle a frame of the ship; `None`: not
    /// before the next fault.
    pub(crate) ship_s: Option<f64>,
    pub(crate) vehicle_s: Option<f64>,
}

impl Recovery {
    /// The slower end, seconds; infinite if an end did not recover.
    pub(crate) fn worst_s(&self) -> f64 {
        let of = |s: Option<f64>| s.unwrap_or(f64::INFINITY);
        of(self.ship_s).max(of(self.vehicle_s))
    }
}

/// The time from a moment to the next one of some times before `until`, all in seconds.
fn until_next(from: f64, times: &[f64], until: f64) -> Option<f64> {
    times.iter().copied().find(|at| *at > from && *at < until).map(|at| at - from)
}

/// The value below which 95 % of some values lie, the largest of fewer than twenty.
fn percentile_95(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((values.len() * 19).div_ceil(20).saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_has_each_fault_at_each_end_once() {
        let faults = plan(3);
        assert_eq!(faults.len(), 2 * FAULTS.len());
        assert_eq!(faults, plan(3));
        assert_ne!(faults, plan(4));
        assert!(faults.windows(2).all(|pair| pair[1].at >= pair[0].at + pair[0].length + PAUSE));
        let mut kinds: Vec<_> = faults.iter().map(|fault| (fault.name, fault.end)).collect();
        kinds.sort_unstable();
        kinds.dedup();
        assert_eq!(kinds.len(), faults.len());
    }

    #[test]
    fn a_recovery_ends_with_the_next_frame_before_the_next_fault() {
        let frames = [1.0, 9.0, 14.0, 40.0];
        assert_eq!(until_next(10.0, &frames, 30.0), Some(4.0));
        assert_eq!(until_next(15.0, &frames, 30.0), None);
        assert_eq!(percentile_95((1..=20).map(f64::from).collect()), 19.0);
        assert_eq!(percentile_95(vec![2.0, 7.0, 3.0]), 7.0);
    }
}
