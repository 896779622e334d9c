//! Counts of a registration, for reports.

use serde::{Deserialize, Serialize};

/// The evidence that frames were placed by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames in all, with and without a match.
    pub frames: u32,
    /// Frames that were matched with the frame before.
    pub chained: u32,
    /// Frames that were matched with at least one earlier frame.
    pub looped: u32,
    /// Matches with earlier frames, of which a frame can have several.
    pub loops: u32,
    /// Attempts at a match with earlier frames.
    pub attempts: u32,
    /// Matches that contradicted the pose, and were not used.
    pub contradicted: u32,
    /// Frames that were placed by dead reckoning and compass alone.
    pub unseen: u32,
}
