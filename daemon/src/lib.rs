//! The scenecast daemon: the roles at sea, their drivers and runtime, the operator's console, the rehearsal and the tools.

pub mod asv;
pub mod autopilot;
pub mod auv;
pub mod cli;
pub mod config;
pub mod console;
pub mod ctl;
mod ends;
pub mod modem;
pub mod modem_sim;
pub mod port;
pub mod rehearsal;
pub mod runtime;
mod scene;
