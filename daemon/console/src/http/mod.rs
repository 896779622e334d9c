//! The HTTP server. `server` joins the parts: `operations` lists paths and handlers, `guard` admits requests, `connections`
//! bounds time and memory, `shared` is the state of the handlers.

mod access;
mod assets;
mod body;
mod compress;
mod connections;
mod edit_rate;
mod guard;
mod handlers;
mod openapi;
mod operations;
mod response;
mod seats;
mod server;
mod shared;

pub use assets::page_files;
pub use compress::gzip;
pub use server::{Console, ConsoleListener, bind, start};
pub use shared::PendingRequest;
