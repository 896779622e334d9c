//! The localisation relay: it turns GPS and USBL measurements into fixes of the vehicles, and keeps the surface above
//! them.
//!
//! [`Relay`] takes the bytes of a GPS receiver (NMEA 0183 or the JSON of gpsd) and the measurements of a USBL head, and
//! gives fixes in the world frame, the plane that touches the Earth at the mission's origin. It does no IO.

mod filter;
mod relay;
mod usbl;

pub use filter::{Estimate, MeasurementVerdict, PlaneFilter};
pub use relay::{Follow, Relay, RelayConfig, RelayFault};
pub use usbl::{Mounting, UsblFault, UsblSighting};
