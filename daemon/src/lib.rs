//! The scenecast daemon: the roles at sea, their drivers and runtime, the operator's console, the rehearsal and the tools.

pub mod asv;
pub mod auv;
pub mod cli;
pub mod config;
pub mod console;
pub mod ctl;
mod ends;
mod figures;
pub mod modem;
pub mod picture;
mod problem;
pub mod rehearsal;
pub mod runtime;

pub use problem::Problem;
