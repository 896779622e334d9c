//! Account of the airtime and of the frames on the medium.

use sim_channel::{LossReason, ReceptionOutcome};
use std::collections::BTreeMap;
use std::time::Duration;

/// Frames of one direction, counted at the end that they were meant for.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameCount {
    /// Frames that arrived or were lost.
    pub sent: u64,
    /// Lost by the water.
    pub lost: u64,
    /// Lost because two spoke at a time, or to one that spoke itself.
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

    /// Share that the water lost of those that nobody talked over.
    pub fn loss(&self) -> f64 {
        self.lost as f64 / (self.sent - self.talked_over).max(1) as f64
    }
}

/// Airtime by end and kind of frame, and frames by direction.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Time on air by sender (`surface`, `vehicle`) and kind of frame.
    pub airtime: BTreeMap<(&'static str, &'static str), Duration>,
    /// Frames that began sooner after a frame for the same end had come in than its modem turns around.
    pub early_frames: u64,
    /// From the surface.
    pub down: FrameCount,
    /// Times that the surface forgot the state of a vehicle, or met one.
    pub restarts: u64,
    /// From the vehicles.
    pub up: FrameCount,
}
