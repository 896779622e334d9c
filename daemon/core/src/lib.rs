//! Shared types of the daemon's crates: coordinates, sensor sentences, pictures of label maps, the error for people.
//!
//! Internal to scenecast. No IO but standard output ([`out!`]): bytes and time come in as arguments.

pub mod drop_counts;
mod geodesy;
pub mod gps;
pub mod label_picture;
mod lines;
mod modem_facts;
pub mod nmea;
mod output;
pub mod palette;
mod port_address;
mod principal;
mod program;
pub mod tuning_table;
mod utc;

pub use crate::nmea::{ModemAddress, UsblLine};
pub use crate::output::Reminder;
pub use geodesy::{
    Area, BodyOffset, LatLon, MAX_DISTANCE_M, PlaceError, TangentPlane, fence_of, outline_of, place_of, wrap_rad,
};
pub use label_picture::{WGS84_AUX_XML, world_file};
pub use lines::Lines;
pub use modem_facts::{CYCLE_INIT, MicromodemRate, OVERHEAD_BITS, S2C_BURST_FRAME_BYTES, S2C_INSTANT_BYTES};
pub use output::{Takes, UserError, one_line, printable, write_error, write_or_exit};
pub use port_address::{FlowControl, PortAddress, SerialFormat, SerialLine};
pub use principal::{ClientName, Giver, Principal, Role};
pub use program::{program, set_program};
pub use utc::utc_text;
