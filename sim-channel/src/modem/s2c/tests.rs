//! Behaviour of the S2C at the host's port.

mod burst;
mod faults;
mod instant;
mod rig;
mod soak;
mod start_up;
