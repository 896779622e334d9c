//! Streams a label map from an underwater vehicle to a surface station over an acoustic modem, within a bit budget and
//! without IO.
//!
//! A modem carries a few hundred bytes a minute, and loses many of them. This crate makes the most of such a link: the
//! surface holds a copy of the vehicle's map, which converges even if frames are lost, late or duplicated, and each order
//! of the surface comes into force once. No call reads a clock or touches a port: bytes and time are arguments.
//!
//! # The five types that matter
//!
//! | type | purpose |
//! |---|---|
//! | [`VehicleLink`] | the vehicle's end: it takes labels, layers, a status and objects, and hands out orders |
//! | [`SurfaceLink`] | the surface's end for up to 14 vehicles: it grants turns, issues orders and holds a replica of each map |
//! | [`ModemProfile`](mac::ModemProfile) | the numbers of a modem: frame size, bit rate, turn-around, medium access |
//! | [`Slot`](directive::Slot) | an order: weights, hold, settings, budget, requests, fix, limits, fence |
//! | [`VehicleStatus`](wire::VehicleStatus) | the vehicle's report about itself: position, path, decisions, backlog |
//!
//! # The host loop
//!
//! A host joins one end with a modem. It drives both ends alike:
//!
//! ```text
//!    received frame      frame has left     map, status, orders
//!          |                    |                    |
//!          v                    v                    v
//!    handle_frame   handle_transmit_outcome   set_map, set_status, issue
//!          |                    |                    |         (each with `now`)
//!    +-----v--------------------v--------------------v-----+
//!    |             VehicleLink  or  SurfaceLink            |
//!    +-----|--------------------|--------------------|-----+
//!          v                    v                    v
//!      poll_event         poll_transmit         poll_timeout
//!          |                    |                    |
//!          v                    v                    v
//!   until it is `None`   a frame to transmit   sleep until then, or until the next input
//! ```
//!
//! 1. After each input, take events from `poll_event` until there are none, then frames from `poll_transmit`.
//! 2. When the modem has transmitted a frame, call `handle_transmit_outcome`.
//! 3. Then wait for the next input, or for the time of `poll_timeout`, and ask for frames again.
//!
//! Here both hosts run in virtual time, over a channel without delay or loss. The example `own_modem` has the same loop
//! with threads and the system's clock.
//!
//! ```
//! use scenecast_protocol::directive::{Constraints, OrderStatus, Slot, SlotState};
//! use scenecast_protocol::link::SlotInboxState;
//! use scenecast_protocol::mac::{Access, MasterConfig, ModemProfile};
//! use scenecast_protocol::map::Cell;
//! use scenecast_protocol::map_codec::Codec;
//! use scenecast_protocol::schedule::Shares;
//! use scenecast_protocol::wire::{CellEdge, VehicleStatus};
//! use scenecast_protocol::{Address, Instant, MissionId};
//! use scenecast_protocol::{SurfaceConfig, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink};
//! use std::time::Duration;
//!
//! let modem = ModemProfile {
//!     frame_bytes: 64,
//!     bit_rate_bps: 1000.0,
//!     overhead_bits: 0,
//!     turn_around: Duration::from_millis(200),
//!     access: Access::Shared,
//! };
//! let (address, mission, window) = (Address::vehicle(1).unwrap(), MissionId(7), Duration::from_secs(10));
//! let config = VehicleConfig {
//!     address,
//!     mission,
//!     cell_edge: CellEdge::default(),
//!     origin: None,
//!     modem,
//!     budget_bps: 400,
//!     budget_window: window,
//!     shares: Shares::default(),
//!     status_period: Duration::from_secs(30),
//!     authenticity: None,
//! };
//! let mut now = Instant::ZERO;
//! let mut vehicle = VehicleLink::new(config, Codec::Auto, 1, SlotInboxState::default(), now);
//! let config = SurfaceConfig {
//!     name: Default::default(),
//!     abort_lifetime: None,
//!     mission,
//!     cell_edge: CellEdge::default(),
//!     origin: None,
//!     modem,
//!     budget_bps: 400,
//!     budget_window: window,
//!     shares: Shares::default(),
//!     master: MasterConfig::default(),
//!     vehicles: vec![address],
//!     discovery_period: None,
//!     authenticity: None,
//! };
//! let mut surface: SurfaceLink = SurfaceLink::new(config, 2, now);
//!
//! vehicle.set_map((0..100).map(|i| (Cell::new(i % 10, i / 10), 1 + (i / 40) as u8)), now);
//! surface.issue(address, Slot::Constraints(Constraints { hold: true, abort: false }), now).unwrap();
//!
//! let end = now + Duration::from_secs(60);
//! while now < end {
//!     while let Some(event) = vehicle.poll_event() {
//!         if let VehicleEvent::Slot { id, .. } = event {
//!             vehicle.decide(id, SlotState::Applied, now);
//!             vehicle.handle_persisted(); // after `persistent_state` is on disk
//!         }
//!     }
//!     while surface.poll_event().is_some() {}
//!     vehicle.set_status(VehicleStatus::default());
//!     if let Some(frame) = surface.poll_transmit(now) {
//!         now = now + modem.airtime(frame.bytes.len());
//!         surface.handle_transmit_outcome(now);
//!         vehicle.handle_frame(&frame.bytes, now);
//!     } else if let Some(frame) = vehicle.poll_transmit(now) {
//!         now = now + modem.airtime(frame.bytes.len());
//!         vehicle.handle_transmit_outcome(now);
//!         surface.handle_frame(&frame.bytes, now);
//!     } else {
//!         let timers = [vehicle.poll_timeout(), surface.poll_timeout(now)];
//!         let next = timers.into_iter().flatten().map(|(at, _)| at).filter(|at| *at > now).min();
//!         now = next.unwrap_or(now + Duration::from_millis(200));
//!     }
//! }
//! let view = surface.vehicle(address).unwrap();
//! assert_eq!(view.replica().shown(), vehicle.map());
//! assert_eq!(view.slots().next().unwrap().status, OrderStatus::Applied);
//! assert!(vehicle.is_converged());
//! ```
//!
//! # Duties of the host
//!
//! * A random seed for each start of an end. Session numbers and nonces come from it.
//! * A monotonic clock. The clocks of the two ends need not agree.
//! * A durable store for [`VehicleLink::persistent_state`] before [`VehicleLink::handle_persisted`]; a restarted vehicle
//!   passes it to [`VehicleLink::new`]. So an order is never applied twice.
//! * One call of `handle_transmit_outcome` for each frame, in the order of transmission. A modem that owns the medium,
//!   or polls, differs as [`Access`](mac::Access) states.
//!
//! # Modules
//!
//! | module | content |
//! |---|---|
//! | [`link`] | the two ends, their events and counters |
//! | [`map`] | the label map and its layers: source at the vehicle, replica at the surface |
//! | [`map_codec`] | changes of a map in chunks of a few bytes, also for files |
//! | [`directive`] | the operator's orders in eight versioned slots |
//! | [`object`] | data larger than a frame, with an erasure code |
//! | [`exemplar`] | an image of one label as an object |
//! | [`schedule`] | the bit budget, the shares of the classes, background streams |
//! | [`mac`] | turns on a shared medium, and the profile of a modem |
//! | [`seal`] | mission key, session keys and tags |
//! | [`wire`] | headers, chunks, acknowledgements, status: the bytes of `WIRE.md` |
//! | [`coordinates`] | map frame and world frame as types |
//! | [`time`] | time as an argument |

#![warn(missing_docs)]
// Received bytes must not panic. Modules that index state the reason where they are declared.
#![cfg_attr(
    not(test),
    deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

mod bytes;
pub mod coordinates;
pub mod directive;
pub mod exemplar;
#[allow(clippy::indexing_slicing)] // A cell's place is less than the size of its tile.
mod grid;
pub mod link;
pub mod mac;
pub mod map;
pub mod map_codec;
pub mod object;
pub mod schedule;
pub mod seal;
pub mod time;
pub mod wire;

pub use link::{
    SurfaceConfig, SurfaceEvent, SurfaceLink, Transmit, TransmitKind, VehicleConfig, VehicleEvent, VehicleLink, Wakeup,
};
pub use time::Instant;
pub use wire::{Address, MissionId};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExample;
