//! The operator's page, its HTTP API, and the client of that API.
//!
//! The host owns the [`Surface`](scenecast_surface::Surface). It publishes a [`Snapshot`] after each change and calls
//! [`handle_request`] for waiting requests between two steps. Therefore no client can delay the link.
//!
//! The modules do not depend on each other in circles: the types of the API ([`state`], [`orders`], [`fit`]) are at the
//! bottom; `snapshot` and `request` fill them from the surface; `http` serves them; [`client`] reads them.

pub mod client;
mod export;
pub mod fit;
mod http;
mod layers;
mod link_meter;
pub mod messages;
pub mod orders;
mod replay;
pub mod report;
mod request;
mod snapshot;
pub mod state;
mod tiles;
mod truth;

pub use export::{CellLayer, ExportError, MapCaption, MapCells, MapFormat};
pub use http::{Console, ConsoleListener, PendingRequest, bind, gzip, page_files, start};
pub use link_meter::LinkMeter;
pub use orders::OrderChanges;
pub use replay::{Recording, Replay};
pub use request::{ClientRequest, Reply, SurfaceRequest, archived_cells, former_labels, handle_request};
pub use snapshot::{MissionFacts, Snapshot, measured_origin, snapshot};
pub use tiles::TiledMap;
pub use truth::Truth;
