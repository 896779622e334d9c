//! Account of the airtime and of the frames in the channel, and order statistics of samples.

use sim_channel::{LossReason, ReceptionOutcome};
use std::collections::BTreeMap;
use std::time::Duration;

/// Frames of one direction, counted at their destination.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameCount {
    /// Number of frames that arrived or were lost.
    pub sent: u64,
    /// Number of frames that the channel lost.
    pub lost: u64,
    /// Number of frames lost by a collision or to a destination that was transmitting.
    pub talked_over: u64,
}

impl FrameCount {
    /// Counts the outcome of a frame.
    pub fn count(&mut self, outcome: &ReceptionOutcome) {
        self.sent += 1;
        match outcome {
            ReceptionOutcome::Lost { reason: LossReason::SelfDeaf | LossReason::Collision, .. } => {
                self.talked_over += 1
            }
            ReceptionOutcome::Lost { .. } => self.lost += 1,
            ReceptionOutcome::Delivered { .. } => {}
        }
    }

    /// Share that the channel lost of the frames without collision.
    pub fn loss(&self) -> f64 {
        self.lost as f64 / (self.sent - self.talked_over).max(1) as f64
    }
}

/// Airtime by end and kind of frame, and frames by direction.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Time on air by sender (`surface`, `vehicle`) and kind of frame.
    pub airtime: BTreeMap<(&'static str, &'static str), Duration>,
    /// Number of frames that an end began within its turn-around after receiving a frame.
    pub early_frames: u64,
    /// Frames that the surface sent.
    pub down: FrameCount,
    /// Number of times that the surface reset the state of a vehicle, or completed a handshake.
    pub restarts: u64,
    /// Frames that the vehicles sent.
    pub up: FrameCount,
}

#[derive(Debug, Clone)]
pub struct Summary(Vec<f64>);

impl Summary {
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    /// The smallest value that a `share` of the sample does not exceed; 0 for an empty sample.
    pub fn quantile(&self, share: f64) -> f64 {
        let rank = (share * self.0.len() as f64).ceil() as usize;
        self.0.get(rank.max(1) - 1).copied().unwrap_or_default()
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    pub fn p95(&self) -> f64 {
        self.quantile(0.95)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let s = Summary::of((1..=20).rev().map(f64::from).collect());
        assert_eq!([s.median(), s.p95(), s.quantile(1.0)], [10.0, 19.0, 20.0]);
        assert_eq!(Summary::of(Vec::new()).median(), 0.0);
    }
}
