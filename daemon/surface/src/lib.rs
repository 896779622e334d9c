//! The surface: it holds the operator's map of each vehicle and sends each vehicle its directive. It does no IO.

mod album;
mod assemble;
mod desk;
mod orders;
mod pauses;
pub mod position;
mod requests;
mod settings;
mod surface;

pub use album::{Album, AskState, Asked, Page, Picture, Wish};
pub use assemble::assemble;
pub use desk::Desk;
pub use orders::{FenceOrder, LimitsOrder};
pub use settings::{SettingsDesk, SettingsOrder};
pub use surface::{Surface, SurfaceOutput};
