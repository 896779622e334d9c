//! The scenecast daemon: the roles at sea, their drivers and runtime, the operator's console, the rehearsal and the tools.

pub mod cli;
pub mod console;
pub mod ctl;
pub mod modem_sim;
pub mod port;
pub mod rehearsal;
pub mod runtime;
mod scene;
