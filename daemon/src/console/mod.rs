//! The operator's page and its HTTP API.
//!
//! The host's loop owns the [`Surface`](crate::asv::Surface). It pushes a [`Snapshot`] whenever something has changed, and
//! answers the [`Ask`]s of browsers between two steps, so no client can hold the link up.

mod answer;
mod assets;
mod base64;
mod guard;
mod link_meter;
mod place;
mod server;
mod snapshot;

pub use answer::{Ask, Reply, answer};
pub use link_meter::LinkMeter;
pub use server::{Console, Request, bind, start};
pub use snapshot::{MissionFacts, Snapshot, snapshot};
