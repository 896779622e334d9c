//! The vehicle: it maps the sea floor, sends the map to the surface and carries out orders.
//!
//! [`Mapper`] turns camera frames into a label map and may run on a thread of its own; [`ForeignMap`] does the same with
//! labels of another program. [`Vehicle`] holds the link to
//! the surface, estimates the position and chooses waypoints. Neither does IO.

mod assemble;
mod checkpoint;
pub mod exemplar;
mod failsafe;
mod foreign;
mod frame;
mod levels;
mod mapper;
mod navigator;
mod picker;
pub mod planning;
mod producer;
mod registration;
mod relief;
mod steering;
mod track;
mod vehicle;

pub use assemble::{assemble, link_config};
pub use checkpoint::{RestoreError, Restored};
pub use failsafe::{Failsafe, FailsafePolicy};
pub use foreign::{ForeignMap, ForeignRestoreError, ForeignSource, ForeignUpdate, LabelChanges};
pub use frame::Frame;
pub use mapper::{MapUpdate, Mapper, SeenFrame, SharedExemplars};
pub use navigator::{FixVerdict, LastPlace, Navigator};
pub use producer::MapProducer;
pub use registration::{FoundFrame, RegisteredFrame};
pub use scenecast_registration::CameraFinding;
pub use steering::{Course, Footprint, Steering};
pub use vehicle::{
    AppliedSlot, Durable, Evidence, KeptKeys, LostOrders, MapSelection, MappedFrame, Vehicle, VehicleDisk,
    VehicleOutput,
};
