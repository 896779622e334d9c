//! The surface: it holds the operator's map of each vehicle and sends each vehicle its directive. It does no IO.

mod annotations;
mod assemble;
mod command;
#[cfg(test)]
mod command_tests;
mod exemplar_cache;
mod in_force;
mod label_book;
mod log;
mod logging;
mod map_in_view;
mod orders;
pub mod position;
pub mod record;
pub mod recorder;
mod refusal;
mod send_orders;
mod settings;
mod surface;
mod track;
mod vehicle_record;

pub use annotations::{AnnotationRefusal, Annotations};
pub use assemble::{assemble, link_config};
pub use command::{
    COMMAND_SILENCE, Command, CommandAction, CommandChange, CommandChangeKind, CommandHolder, CommandRefusal,
    CommandRequest, OrderKind,
};
pub use exemplar_cache::{ExemplarCache, LabelExemplars, OpenRequest, RequestKind, RequestState, StoredExemplar};
pub use label_book::LabelBook;
pub use log::{AUTOPILOT_SILENT, LogEntry, LogKind, MissionLog, NO_FAULT};
pub use map_in_view::LabelGains;
pub use orders::{AreaOrder, AreasOrder, DestinationOrder, FenceOrder, LimitsOrder, order_name};
pub use refusal::{OrderRefusal, Weighed};
pub use scenecast_core::{ClientName, Giver, Principal, Role};
pub use settings::{SettingsOrder, SettingsRecord};
pub use surface::{Surface, SurfaceOutput};
pub use track::{RegistrationRecord, Track};
pub use vehicle_record::{EarlierView, SentOrder, VehicleRecord};
