//! Drivers of acoustic modems and of autopilots: state machines between frames, waypoints and the bytes of a port.
//!
//! Internal to scenecast. No IO: bytes and time come in as arguments.

pub mod autopilot;
pub mod modem;
