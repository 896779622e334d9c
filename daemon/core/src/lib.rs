//! Shared types of the daemon's crates: coordinates, sensor sentences, pictures of label maps, the error for people.
//!
//! Internal to scenecast. No IO but standard output ([`out!`]): bytes and time come in as arguments.

mod area;
mod body;
pub mod drop_counts;
mod error;
mod geodesy;
pub mod gps;
pub mod label_picture;
mod lines;
mod micromodem_rate;
mod modem_units;
pub mod nmea;
mod outlines;
mod output;
pub mod palette;
mod port_address;
mod principal;
mod printable;
pub mod tuning_table;
mod usbl_line;
mod world_file;

pub use area::Area;
pub use body::BodyOffset;
pub use error::UserError;
pub use geodesy::{LatLon, MAX_DISTANCE_M, TangentPlane, wrap_rad};
pub use lines::Lines;
pub use micromodem_rate::{CYCLE_INIT, MicromodemRate, OVERHEAD_BITS};
pub use modem_units::{S2C_BURST_FRAME_BYTES, S2C_INSTANT_BYTES};
pub use outlines::{fence_of, outline_of, place_of};
pub use output::{write_error, write_or_exit};
pub use port_address::PortAddress;
pub use principal::{ClientName, Giver, Principal, Role};
pub use printable::printable;
pub use usbl_line::{ModemAddress, UsblLine};
pub use world_file::{WGS84_AUX_XML, world_file};
