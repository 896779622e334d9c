//! The last contact with a vehicle, as it is stored.

use scenecast_core::UsblLine;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The last contact with a vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StoredContact {
    pub last_received: Option<u64>,
    /// The longest usual pause between two frames, microseconds.
    pub pause: Option<u64>,
    /// When the last pose came in; pose and report as on the wire.
    pub status: Option<(u64, Vec<u8>, Vec<u8>)>,
    pub usbl: Option<StoredRange>,
}

/// A measurement of the surface's modem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredRange {
    pub at: u64,
    pub remote: u16,
    pub range_m: Option<f64>,
    pub direction_rad: Option<(f64, f64)>,
    pub accuracy: f64,
    pub age_s: f64,
}

impl StoredContact {
    /// The status and when its pose came in.
    pub(crate) fn status(&self) -> Option<(VehicleStatus, Instant)> {
        let (at, pose, report) = self.status.as_ref()?;
        let mut status = VehicleStatus::default();
        status.read_pose(pose).ok()?;
        status.read_report(report).ok()?;
        Some((status, Instant::from_micros(*at)))
    }

    /// The last measurement of the surface's modem, and its time.
    pub(crate) fn range(&self) -> Option<(UsblLine, Instant)> {
        let StoredRange { at, remote, range_m, direction_rad, accuracy, age_s } = *self.usbl.as_ref()?;
        let line = UsblLine { remote: remote.try_into().ok()?, range_m, direction_rad, accuracy, age_s };
        Some((line, Instant::from_micros(at)))
    }

    /// The longest usual pause between two frames.
    pub(crate) fn pause(&self) -> Option<Duration> {
        self.pause.map(Duration::from_micros)
    }
}
