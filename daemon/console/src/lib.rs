//! The operator's page, its HTTP API, and the client of that API.
//!
//! The host owns the [`Surface`](scenecast_surface::Surface), publishes its state to the page, and hands it the requests of the
//! page between two steps.
//!
//! The modules do not depend on each other in circles: the state, the requests and the orders come from the surface; `http`
//! serves them; [`client`] reads them.

mod bodies;
pub mod client;
mod export;
mod http;
mod recording;
mod replay;
pub mod report;
mod tiles;

pub use export::{ExportError, MapFormat};
pub use http::{Console, ConsoleListener, PendingRequest, bind, gzip, page_files, start};
pub use recording::{Recording, layer_text};
pub use replay::Replay;
pub use tiles::TiledMap;
