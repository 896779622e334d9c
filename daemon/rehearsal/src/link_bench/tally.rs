//! Account of the airtime and of the frames in the channel.

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
