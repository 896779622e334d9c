//! The localisation relay: GPS and USBL into fixes of vehicles, and the surface above them.
//!
//! [`Relay`] takes the bytes of a GPS ([`gps`]: NMEA 0183 or gpsd's JSON) and what a USBL head tells ([`usbl`]), and
//! gives fixes in the world frame, the plane that touches the Earth at the mission's origin ([`geodesy`]). Nothing here
//! does IO.

mod filter;
mod follow;
mod geodesy;
mod gps;
mod gpsd;
mod line;
pub mod nmea;
mod relay;
mod usbl;
mod world_file;

pub use filter::{Estimate, PlaneFilter, Verdict};
pub use follow::Follow;
pub use geodesy::{LatLon, TangentPlane, wrap_rad};
pub use gps::{Gps, GpsFault, GpsFix, GpsLanguage};
pub use line::Lines;
pub use relay::{Relay, RelayConfig, RelayFault};
pub use usbl::{Mounting, UsblFault, UsblSighting};
pub use world_file::world_file;
