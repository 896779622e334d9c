//! The operator's page and its HTTP API.
//!
//! The host's loop owns the [`Surface`](scenecast_surface::Surface). It pushes a [`Snapshot`] whenever something has changed, and
//! answers the [`Ask`]s of browsers between two steps, so no client can hold the link up.

mod answer;
mod assets;
mod base64;
mod body;
pub mod client;
mod compress;
mod connections;
mod events;
mod export;
pub mod fit;
mod guard;
mod layers;
mod link_meter;
mod maps;
mod metrics;
mod openapi;
mod operations;
pub mod orders;
mod place;
mod server;
mod snapshot;
pub mod state;
mod token;

pub use answer::{Ask, Reply, answer};
pub use export::{Cells, Layer};
pub use link_meter::LinkMeter;
pub use server::{Console, Entrance, Request, bind, start};
pub use snapshot::{MissionFacts, Snapshot, snapshot};
