//! The HTTP server. `server` joins the parts: `operations` lists paths and handlers, `guard` admits requests, `connections`
//! bounds time and memory, `shared` is the state of the handlers.

mod access;
mod connections;
mod guard;
mod handlers;
mod openapi;
mod operations;
mod response;
mod server;
mod shared;

pub use response::{gzip, page_files};
pub use server::{Console, ConsoleListener, bind, start};
pub use shared::PendingRequest;
