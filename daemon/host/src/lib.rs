//! One host for each role, as a state machine without IO.
//!
//! A host joins a role ([`scenecast_vehicle::Vehicle`] or `scenecast_surface::Surface`) with its modem, its autopilot,
//! its persistent state and the hand-over to the mapper. The runtime drives the hosts with ports, disks and a clock;
//! the rehearsal drives the same hosts in virtual time. The owner of a host repeats three steps after each event:
//!
//! ```text
//! host.handle_*(.., now)                  bytes of a port, a frame of the camera, a map of the mapper, a timeout
//! while host.poll_event() is an event     act on it; Persist: make the state durable, then host.handle_persisted()
//! while host.poll_output(now) is bytes    write them to the modem's port; likewise poll_pilot_output() for the autopilot
//! ```
//!
//! and then waits until a port has bytes or `host.poll_timeout(now)` has come.
//!
//! | type | joins |
//! |---|---|
//! | [`LinkHost`] | any end of the link and a modem station; the only caller of a link's `poll_transmit` |
//! | [`VehicleHost`] | the vehicle's role, its modem and autopilot, persistence, the mapper |
//! | `DryRunTask` | the surface's knowledge and the vehicle's planner: what the vehicle would do |
//! | `SurfaceHost` | the surface's role, its modem, the instruments and the autopilot of the surface vehicle |

#[cfg(feature = "surface")]
mod dry_run;
mod link_end;
mod link_host;
mod pilot;
#[cfg(feature = "surface")]
mod surface_host;
mod vehicle_host;

#[cfg(feature = "surface")]
pub use crate::dry_run::DryRunTask;
#[cfg(feature = "surface")]
pub use crate::surface_host::{Follower, SurfaceHost, SurfaceHostEvent};
pub use crate::vehicle_host::{CameraPose, MeasuredPose, VehicleHost, VehicleHostEvent};
pub use link_end::{FrameCounts, LinkEnd};
pub use link_host::{FrameEvent, FrameOutcome, LinkHost, channel_station, modem_station};
pub use pilot::{PilotEvent, VehiclePilot};
