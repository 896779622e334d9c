//! Acoustic channel and modem emulators: seeded, in virtual time, without IO.
//!
//! Every `now` is the [`Duration`] since the start of the run. The caller owns the clock: it puts bytes on air with
//! [`Channel::transmit`], asks [`Channel::poll_timeout`] when something will have arrived, and collects it with
//! [`Channel::poll_arrival`]. Equal seeds and equal calls give equal results, bit for bit; every directed link, and every
//! purpose on it, has a random stream of its own.
//!
//! | module | is |
//! |---|---|
//! | [`Channel`] | who hears what and when: delay, half duplex, collisions, outages, corruption, duplicates, reordering |
//! | [`loss`] | loss models: independent, two and three states, signal to noise ratio, replay of a record |
//! | [`acoustics`] | absorption, spreading, ambient noise, sound speed, frame errors, each with its source |
//! | [`presets`] | conditions named by situation |
//! | [`usbl`] | range, bearing and elevation of a node that answers |
//! | [`modem`] | what a host sees of an S2C, a Micromodem or a byte pipe; [`modem::Basin`] joins them by a channel |
//!
//! ```
//! use sim_channel::{Channel, Duration, NodeId, ReceptionOutcome, NodePosition, presets};
//!
//! let mut channel = Channel::new(presets::calm_lake(), 7);
//! channel.place(NodeId(1), NodePosition::new(0.0, 0.0, 1.0));
//! channel.place(NodeId(2), NodePosition::new(800.0, 0.0, 20.0));
//! channel.transmit(NodeId(1), b"hello".to_vec(), Duration::from_millis(300), Duration::ZERO);
//! let at = channel.poll_timeout().unwrap();
//! let arrival = channel.poll_arrival(at).unwrap();
//! assert!(matches!(arrival.outcome, ReceptionOutcome::Delivered { .. }));
//! ```

#![warn(missing_docs)]

pub mod acoustics;
mod channel;
pub mod loss;
pub mod modem;
mod nodes;
mod random;
pub mod usbl;

pub use std::time::Duration;

pub use channel::{
    Arrival, Channel, ChannelConfig, Interferer, LossReason, Onset, Outage, OutageScope, ReceptionOutcome, presets,
};
pub use loss::LossModel;
pub use nodes::{NodeId, NodePosition, Track};
pub use random::RandomStream;
