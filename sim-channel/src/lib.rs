//! Underwater acoustic channels and modem emulators: seeded, in virtual time, without IO.
//!
//! Use it to test software for acoustic modems on a desk: put nodes into a [`Channel`], or emulated modems into a
//! [`Basin`](modem::Basin), and simulate hours of traffic in seconds. The simulation includes delay, half duplex,
//! collisions, fading, outages and the quirks of two makes of modem. The same seed and the same calls give the same
//! bytes at the same times.
//!
//! # The five types that matter
//!
//! | type | purpose |
//! |---|---|
//! | [`Channel`] | carries each frame to every other node, with delay, loss and collisions |
//! | [`ChannelConfig`] | the conditions: sound speed, [`LossModel`], corruption, [`Outage`]s; [`presets`] has eight |
//! | [`Arrival`] | the end of a frame at one node: the bytes, or the reason of the loss |
//! | [`Emulator`](modem::Emulator) | a modem: host bytes and arrivals go in, host bytes and transmissions come out |
//! | [`Basin`](modem::Basin) | a channel with the emulated modems in it; a host needs only this type |
//!
//! # The host loop
//!
//! No type here has a clock, a thread or a socket. The host passes time in, and asks when the next event is due:
//!
//! ```text
//!            bytes of a host                      virtual time
//!                  |                                    |
//!                  v                                    v
//!        handle_host_bytes(node, bytes, now)      advance(at) <-----+
//!                  |                                    |           |
//!   +--------------v------------------------------------v------+    |
//!   | Basin     Emulator --transmission--> Channel             |    |
//!   |           Emulator <---arrival------    |                |    |
//!   +--------------|------------------------------------|------+    |
//!                  v                                    v           |
//!        poll_host_bytes(node)                    poll_timeout() ---+
//!                  |                              time of the next event
//!                  v
//!            bytes to a host
//! ```
//!
//! ```
//! use sim_channel::modem::Basin;
//! use sim_channel::modem::s2c::{S2c, S2cConfig};
//! use sim_channel::{Channel, Duration, NodeId, NodePosition, presets};
//!
//! let (ship, vehicle) = (NodeId(1), NodeId(2));
//! let mut basin = Basin::new(Channel::new(presets::calm_lake(), 7));
//! basin.channel().place(ship, NodePosition::new(0.0, 0.0, 1.0));
//! basin.channel().place(vehicle, NodePosition::new(800.0, 0.0, 20.0));
//! basin.add(ship, Box::new(S2c::new(S2cConfig::new(1))));
//! basin.add(vehicle, Box::new(S2c::new(S2cConfig::new(2))));
//!
//! basin.handle_host_bytes(ship, b"AT*SENDIM,4,2,ack,dive\r", Duration::ZERO);
//! let (mut at_ship, mut at_vehicle) = (Vec::new(), Vec::new());
//! while let Some(at) = basin.poll_timeout().filter(|at| *at < Duration::from_secs(10)) {
//!     basin.advance(at);
//!     at_ship.extend(basin.poll_host_bytes(ship));
//!     at_vehicle.extend(basin.poll_host_bytes(vehicle));
//! }
//! assert_eq!(at_ship, b"OK\r\nDELIVEREDIM,2\r\n");
//! assert!(at_vehicle.starts_with(b"RECVIM,4,1,2,ack,") && at_vehicle.ends_with(b",dive\r\n"));
//! ```
//!
//! A [`Channel`] without modems has the same loop with [`transmit`](Channel::transmit),
//! [`poll_timeout`](Channel::poll_timeout) and [`poll_arrival`](Channel::poll_arrival). A host in real time sleeps until
//! `poll_timeout` and passes the time since its start.
//!
//! # Virtual time and seeds
//!
//! Every `now` is the [`Duration`] since the start of the run and never goes back. A call that is late runs the events
//! that were due, each at its own time. Each directed link has random streams of its own, one for the loss model, one for
//! faults and one for the flipped bits, so that traffic on one link does not change another link. Results are equal bit by
//! bit for equal seeds and calls on one platform; the loss models use `ln` and `exp`, which may differ in the last bit
//! between platforms.
//!
//! # Modules
//!
//! | module | content |
//! |---|---|
//! | [`presets`] | channel conditions named by situation, with their sources |
//! | [`loss`] | loss models: independent, two and three states, signal-to-noise ratio, tables, recorded losses |
//! | [`acoustics`] | absorption, spreading, ambient noise, sound speed, frame errors |
//! | [`usbl`] | range, bearing and elevation of a node that replied |
//! | [`modem`] | emulators of an EvoLogics S2C, a WHOI Micromodem and a byte pipe, and the basin |

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

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExample;
