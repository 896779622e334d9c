//! The vehicle: sees, maps, tells, obeys.
//!
//! [`Mapper`] turns camera frames into labels and may live on a thread of its own; [`Vehicle`] speaks with the surface,
//! keeps the position estimate and chooses waypoints. Neither does IO.

mod assemble;
mod checkpoint;
pub mod exemplar;
mod guard;
mod mapper;
mod navigator;
mod picker;
pub mod planning;
mod relief;
mod steering;
mod vehicle;

pub use assemble::assemble;
pub use checkpoint::{RestoreError, Restored};
pub use guard::{Guard, Habits};
pub use mapper::{MapUpdate, Mapper, SharedExemplars};
pub use navigator::{FixVerdict, Navigator};
pub use steering::{Course, Footprint, Steering};
pub use vehicle::{AppliedSlot, Durable, LastPlace, Vehicle, VehicleOutput};
