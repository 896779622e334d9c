//! A whole mission in virtual time: the hosts of the sea, with a simulated sea floor, channel and vehicle.

mod baseline;
mod carrier;
mod fidelity;
mod frames_log;
mod instruments;
pub mod link_bench;
mod link_rig;
mod meter;
mod mission;
pub mod modem_bench;
pub mod modem_rig;
mod outputs;
pub mod planning_bench;
mod quality;
mod report;
mod script;
mod virtual_time;
mod world;

pub use baseline::{WholeReplica, WholeSource};
pub use fidelity::{FidelityRow, fidelity, fidelity_panels};
pub use frames_log::{FramesLog, Repeats, Uplink};
pub use instruments::{Instruments, Receiver, SimulatedAutopilot, simulated_autopilot};
pub use link_rig::LinkRig;
pub use meter::Delays;
pub use mission::{EndEvent, FrameErrors, MapInformation, MapQuality, Mission, MissionOptions};
pub use outputs::write_outputs;
pub use quality::{Curve, Line, Panel, quality_plot};
pub use report::{Report, report};
pub use scenecast_worlds::View;
pub use virtual_time::VirtualTime;
pub use world::{Truth, World, true_classes};

#[cfg(test)]
mod conformance_tests;
#[cfg(test)]
mod discovery_tests;
#[cfg(test)]
mod storm_tests;
