//! Typed settings from files, `--set` options and defaults.
//!
//! Internal to scenecast. Text becomes types in [`load`] and nowhere else. Each key is described once, in `sections/`; the
//! files in `config/`, the reference and the JSON Schema are made from these descriptions. Apart from reading files the
//! crate does no IO.

mod check;
mod derived;
mod load;
mod print;
mod rule;
mod secret_files;
mod sections;
mod setting;

pub use check::{full_frame_bytes, modem_port};
pub use derived::{
    authenticity, cell_m, frame_m, joules_per_bit, map_origin, modem_profile, survey_depth_m, tuning_table,
    vehicle_address, vehicle_names,
};
pub use load::load;
pub use print::{changed_settings, print, reference, schema, shipped_files};
pub use rule::Rule;
pub use secret_files::{
    TokenGrant, load_key, load_tokens, open_regular, read_key, read_regular, read_regular_text, read_text, read_token,
    read_tokens, utf16_fault,
};
pub use sections::key::{Key, Role};
pub use sections::{
    Autopilot, Bands, Camera, Channel, Config, Console, Labels, Link, Map, Mission, Modem, Navigation, Operator,
    Position, Record, Ros2, Runtime, Scene, SurfaceSection, Survey, VehicleSection,
};
pub use setting::{
    Authenticate, AutopilotKind, BandRange, BirthRule, CalibrationSource, CameraSource, CameraStamps, Debounce,
    DepthSource, GpsPort, HostPort, LabelMessage, LabelSource, LayerName, LegDirection, MapCells, ModemKind,
    NavigationSource, OperatorScript, PageOrigin, Remap, RestoreOrders, RosName, RosTransport, S2cMode, SceneLabels,
    StartMode, Votes, WorldKind, ZenohEndpoint,
};
