//! Acoustic channel and modem emulators: seeded, in virtual time, without IO.
//!
//! Every `now` is the [`Duration`] since the start of the run. The caller owns the clock: it puts bytes on air with
//! [`Channel::transmit`], asks [`Channel::poll_timeout`] when something will have arrived, and collects it with
//! [`Channel::poll_arrival`]. Equal seeds and equal calls give equal results, bit for bit.

pub mod acoustics;
mod channel;
pub mod loss;
pub mod modem;
mod node;
pub mod presets;
mod random;
mod talker;
mod track;
pub mod usbl;

pub use std::time::Duration;

pub use channel::{Arrival, Channel, ChannelConfig, LossReason, Onset, Outage, OutageScope, Outcome};
pub use loss::LossModel;
pub use node::{NodeId, Position};
pub use random::Stream;
pub use talker::Talker;
pub use track::Track;
