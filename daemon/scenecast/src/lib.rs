//! The `scenecast` command: one binary for the vehicle, the surface, rehearsals and offline work.

pub mod commands;
#[cfg(feature = "rehearsal")]
pub mod mission_record;
