//! The true motion of a simulated vehicle, its drifting odometry, and an audit of its track against a fence.
//!
//! Internal to scenecast: rehearsals and tests use it; no crate that goes to sea does. No IO.

mod motion;
mod track_audit;

pub use motion::{Motion, Odometry};
pub use track_audit::{length_m, stretches_outside};
