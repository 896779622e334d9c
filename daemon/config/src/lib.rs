//! Typed settings from files, `--set` options and defaults.
//!
//! Internal to scenecast. Text becomes types in [`load`] and nowhere else. Each key is described once, in `sections/`; the
//! files in `config/`, the reference and the JSON Schema are made from these descriptions. Apart from reading files the
//! crate does no IO.

mod check;
mod derived;
mod key;
mod key_file;
mod load;
mod modem;
mod print;
mod reference;
mod regular_file;
mod rule;
mod schema;
mod sections;
mod setting;
mod token_file;

pub use derived::{
    authenticity, cell_m, joules_per_bit, modem_profile, survey_depth_m, tuning_table, vehicle_address, vehicle_names,
};
pub use key::{Key, Role};
pub use key_file::{load_key, read_key};
pub use load::load;
pub use modem::{full_frame_bytes, modem_port};
pub use print::{print, shipped_files};
pub use reference::reference;
pub use regular_file::{open_regular, read_regular, read_regular_text};
pub use rule::Rule;
pub use schema::schema;
pub use sections::{
    Autopilot, Bands, Camera, Channel, Config, Console, Labels, Link, Map, Mission, Modem, Navigation, Operator,
    Position, Ros2, Runtime, Scene, SurfaceSection, Survey, VehicleSection,
};
pub use setting::{
    Authenticate, AutopilotKind, BandRange, BirthRule, CalibrationSource, CameraSource, CameraStamps, Debounce,
    DepthSource, GpsPort, HostPort, LabelMessage, LabelSource, LayerName, MapCells, ModemKind, NavigationSource,
    OperatorScript, PageOrigin, Remap, RestoreOrders, RosName, RosTransport, S2cMode, SceneLabels, StartMode, Votes,
    WorldKind, ZenohEndpoint,
};
pub use token_file::{TokenGrant, load_tokens, read_token, read_tokens};
