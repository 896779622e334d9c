//! A whole mission in virtual time: the hosts of the sea, with a simulated sea floor, channel and vehicle.

mod baseline;
#[cfg(test)]
mod conformance_tests;
mod cpu_meter;
#[cfg(test)]
mod discovery_tests;
pub mod exemplar_bench;
mod fidelity;
mod frames_log;
pub mod inference_bench;
mod instruments;
pub mod link_bench;
mod localisation;
mod meter;
mod mission;
pub mod modem_bench;
pub mod modem_rig;
mod mosaic;
mod outputs;
mod panorama;
pub mod planning_bench;
mod quality;
pub mod raster_bench;
pub mod registration_bench;
mod report;
pub mod restart_bench;
mod script;
mod simulated_autopilot;
pub mod steering_bench;
#[cfg(test)]
mod storm_tests;
pub mod stranger_bench;
mod truth;
mod uplink;
mod virtual_time;
pub mod wide_bench;
mod world;

pub use fidelity::{FidelityRow, fidelity, fidelity_panels};
pub use frames_log::FramesLog;
pub use localisation::{Localisation, LocalisationRun, Tracks, localisation, localisation_plot, run_with_outliers};
pub use meter::Delays;
pub use mission::{MapInformation, MapQuality, Mission, MissionOptions};
pub use outputs::write_outputs;
pub use quality::{Curve, Line, Panel, quality_plot};
pub use report::{Report, report};
pub use scenecast_worlds::View;
pub use simulated_autopilot::{SimulatedAutopilot, simulated_autopilot};
pub use truth::Truth;
pub use uplink::{Repeats, Uplink};
pub use virtual_time::VirtualTime;
pub use world::World;
