//! The acoustic link.

use crate::key::section;
use crate::rule::{ANY, range};
use crate::setting::Authenticate;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use std::path::PathBuf;

section! {
    /// The acoustic link.
    link: Link {
        /// Bits per second that this end may put on air, as a mean over link.budget_window_s.
        budget_bps: u32 = 10_000, range(10.0, 1e7, "bit/s"), [Auv Asv Scenario];
        /// Length of the window in which the bits on air are limited to the budget.
        budget_window_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Auv Asv Scenario];
        /// Size of a full frame, the same at both ends. The modems s2c and micromodem have frame sizes of their own.
        frame_bytes: u32 = 256, range(32.0, 1024.0, "bytes"), [Auv Asv Scenario];
        /// Minimum share of the budget for each class while several classes have data to send. The shares add up to 100
        /// % or less. A class that is left out keeps its default.
        shares: Shares = Shares::default(), range(0.0, 100.0, "%"), [Auv Asv Scenario];
        /// Background streams: data that is sent with spare capacity only, in this order. finer: the cells between
        /// those of a coarse map; exemplars: images of new labels that nobody requested; the name of a layer: that layer,
        /// if it has no share. A stream that is not listed is not sent. Without finer in the list, finer
        /// cells are sent before all background streams.
        background: BackgroundOrder = BackgroundOrder::default(), ANY, [Auv Asv Scenario];
        /// Time between two status reports of the vehicle.
        status_period_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Auv Scenario];
        /// Longest turn that the surface grants.
        max_turn_s: f64 = 14.0, range(1.0, 60.0, "s"), [Asv Scenario];
        /// Longest pause between two turns while neither end has data to send.
        max_idle_s: f64 = 10.0, range(0.5, 600.0, "s"), [Asv Scenario];
        /// Longest time between two discovery calls for unknown vehicles. 0: no discovery calls, so the surface works
        /// with the configured vehicles only.
        discovery_period_s: f64 = 300.0, range(0.0, 86_400.0, "s"), [Asv Scenario];
        /// Addresses of the vehicles that the surface works with from the start. Empty: vehicle.address only.
        vehicles: Vec<u8> = Vec::new(), range(1.0, 14.0, ""), [Asv];
        /// Assumed range, from which the wait for a reply follows until the first round trip has been measured.
        max_range_m: f64 = 3000.0, range(10.0, 20_000.0, "m"), [Asv Scenario];
        /// Time that a modem needs between receiving and transmitting.
        turn_around_s: f64 = 0.2, range(0.0, 10.0, "s"), [Auv Asv Scenario];
        /// File of the key of the mission (scenecast key new); on a vehicle, that of its own key (scenecast key derive).
        /// Empty: frames are not authenticated.
        key_file: Option<PathBuf> = None, ANY, [Auv Asv Scenario];
        /// Frames that the key authenticates, the same at both ends. all: both directions;
        /// down: from the surface to the vehicle only, so that anybody can forge the map.
        authenticate: Authenticate = Authenticate::All, ANY, [Auv Asv Scenario];
        /// Whether authenticated frames are encrypted too, the same at both ends.
        encrypt: bool = false, ANY, [Auv Asv Scenario];
    }
}
