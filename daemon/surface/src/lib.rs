//! The surface: it holds the operator's map of each vehicle and sends each vehicle its directive. It does no IO.
//!
//! Whoever shows the surface to others publishes a [`Snapshot`] after each change, and hands it their requests by
//! [`handle_request`] between two steps. Therefore no client can delay the link.

mod aims;
mod annotations;
mod assemble;
mod command;
mod exemplar_cache;
pub mod fit;
mod floor_views;
mod given_orders;
mod in_force;
mod label_book;
mod link_meter;
mod log;
mod logging;
mod map_cells;
mod map_changes;
mod map_in_view;
pub mod messages;
mod orders;
pub mod position;
pub mod record;
pub mod recorder;
mod refusal;
mod reported_orders;
mod request;
mod send_orders;
mod snapshot;
pub mod state;
mod surface;
mod track;
mod vehicle_record;

pub use aims::{Ground, Place, Purpose};
pub use annotations::{AnnotationRefusal, Annotations};
pub use assemble::{assemble, link_config};
pub use command::{
    COMMAND_SILENCE, Command, CommandAction, CommandChange, CommandChangeKind, CommandHolder, CommandRefusal,
    CommandRequest, OrderKind,
};
pub use exemplar_cache::{ExemplarCache, LabelExemplars, OpenRequest, RequestKind, RequestState, StoredExemplar};
pub use floor_views::{FloorPlace, FloorViews, floor_list};
pub use given_orders::{GivenOrders, SentOrder, SettingsRecord};
pub use label_book::LabelBook;
pub use link_meter::LinkMeter;
pub use log::{AUTOPILOT_SILENT, LogEntry, LogKind, MissionLog, NO_FAULT};
pub use map_cells::{CellLayer, MapCaption, MapCells, tile_place};
pub use map_changes::LabelGains;
pub use orders::{
    AgainOrder, AreaOrder, AreasOrder, BudgetOrder, CONSTRAINT_NAMES, CommandOrder, CommandOrderAction,
    ConstraintsAction, ConstraintsOrder, DestinationOrder, DismissOrder, DraftOrder, DryRunOrder, ExemplarAction,
    ExemplarOrder, FenceOrder, LabelOrder, LimitsOrder, MarkerOrder, NoteOrder, OrderChanges, RemoveMarkerOrder,
    RestoreOrder, SettingsOrder, SharesOrder, TakeOverOrder, UtilityOrder, member_in_words, order_name, value_in_words,
};
pub use refusal::{OrderRefusal, Weighed};
pub use request::{ClientRequest, Reply, SurfaceRequest, archived_cells, cell_layers, former_labels, handle_request};
pub use scenecast_core::{ClientName, Giver, Principal, Role};
pub use snapshot::{MissionFacts, Snapshot, Truth, measured_origin, principal_info, snapshot};
pub use surface::{Surface, SurfaceOutput};
pub use track::{RegistrationRecord, Track};
pub use vehicle_record::{EarlierView, RunLabels, VehicleRecord};

#[cfg(test)]
mod command_tests;
