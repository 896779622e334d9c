//! The HTTP server. `server` joins the parts: `operations` lists paths and handlers, `guard` admits requests, `connections`
//! bounds time and memory, `shared` is the state of the handlers.

mod access;
mod connections;
mod guard;
mod handlers;
mod openapi;
mod operations;
mod page_files;
mod response;
mod server;
mod shared;

pub use page_files::page_files;
pub use response::gzip;
pub use server::{Console, ConsoleListener, bind, start};
pub use shared::PendingRequest;
