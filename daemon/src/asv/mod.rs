//! The surface: holds the operator's map of each vehicle, sends each its directive.

#[cfg(test)]
mod calls;
mod desk;
mod orders;
mod pauses;
pub mod position;
mod settings;
mod surface;

pub use desk::{Desk, ExemplarState};
pub use orders::{FenceOrder, LimitsOrder};
pub use settings::{SettingsDesk, SettingsOrder};
pub use surface::{Surface, SurfaceOutput};
