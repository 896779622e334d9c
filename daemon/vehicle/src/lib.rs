//! The vehicle: it maps the sea floor, sends the map to the surface and carries out orders.
//!
//! [`Mapper`] turns camera frames into a label map and may run on a thread of its own; [`ForeignMap`] does the same with
//! labels of another program. [`Vehicle`] holds the link to
//! the surface, estimates the position and chooses waypoints. Neither does IO.

mod assemble;
mod cells;
mod changes;
mod checkpoint;
pub mod exemplar;
mod failsafe;
mod foreign;
mod frame;
mod mapper;
mod mosaic;
mod navigator;
mod picker;
mod placer;
pub mod planning;
mod registration;
mod steering;
mod track;
mod vehicle;

pub use assemble::{assemble, footprint, link_config, steering};
pub use changes::{LabelChanges, MapChanges, MapProducer, SeenCell, SeenFrame, SharedExemplars};
pub use checkpoint::{RestoreError, Restored};
pub use failsafe::{Failsafe, FailsafePolicy};
pub use foreign::{ForeignMap, ForeignRestoreError, ForeignSource};
pub use frame::Frame;
pub use mapper::Mapper;
pub use mosaic::FloorTile;
pub use navigator::{FixVerdict, LastPlace, Navigator};
pub use placer::FoundFrame;
pub use registration::RegisteredFrame;
pub use scenecast_registration::CameraFinding;
pub use steering::{Alternative, Course, Footprint, Steering};
pub use vehicle::{
    AppliedSlot, Durable, Evidence, KeptBudget, KeptGoals, KeptKeys, KeptLimits, KeptUtility, LostOrders, MapSelection,
    MappedFrame, Vehicle, VehicleDisk, VehicleOutput,
};
