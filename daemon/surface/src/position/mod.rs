//! The localisation relay: GPS and USBL into fixes of vehicles, and the surface above them.
//!
//! [`Relay`] takes the bytes of a GPS ([`gps`]: NMEA 0183 or gpsd's JSON) and what a USBL head tells ([`usbl`]), and
//! gives fixes in the world frame, the plane that touches the Earth at the mission's origin ([`geodesy`]). Nothing here
//! does IO.

mod filter;
mod follow;
mod relay;
mod usbl;

pub use filter::{Estimate, MeasurementVerdict, PlaneFilter};
pub use follow::Follow;
pub use relay::{Relay, RelayConfig, RelayFault};
pub use usbl::{Mounting, UsblFault, UsblSighting};
