//! The bytes and the energy of the vehicle's transmissions.

use super::frames_log::FramesLog;
use super::mission::Mission;
use scenecast_protocol::link::{DropReason, LinkStats, PeerView, TransmitKind};
use scenecast_protocol::map::StateReplica;
use scenecast_protocol::schedule::Class;
use serde::Serialize;

/// Bytes that the vehicle put on air, by use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Uplink {
    pub map: u64,
    pub status: u64,
    /// Headers, acknowledgement statements and integrity checks.
    pub overhead: u64,
    /// Copies of frames that were sent before.
    pub repeated: u64,
    /// Everything else: layers of the map and exemplars.
    pub other: u64,
}

impl Uplink {
    /// The bytes by the counters of the vehicle's end.
    pub fn of(stats: &LinkStats) -> Self {
        let of = |class| stats.bytes_by_class.get(&class).copied().unwrap_or(0);
        let [map, status, overhead] = [Class::Map, Class::Status, Class::Overhead].map(of);
        let all: u64 = stats.bytes_by_class.values().sum();
        Self { map, status, overhead, repeated: stats.repeated_bytes, other: all - map - status - overhead }
    }

    pub fn all(&self) -> u64 {
        self.map + self.status + self.overhead + self.repeated + self.other
    }

    /// The part of all bytes that is map, 0..=1.
    pub fn map_share(&self) -> f64 {
        self.map as f64 / self.all().max(1) as f64
    }
}

/// Copies of the vehicle's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Repeats {
    /// Number of copies that the vehicle put on air.
    pub frames: u64,
    /// Number of frames that the surface received although it had them, copies by the channel included.
    pub arrived_twice: u64,
}

impl Repeats {
    /// The copies by the surface's view of the vehicle and by the log of the frames.
    pub fn of<R: StateReplica>(view: Option<PeerView<'_, R>>, frames: &FramesLog) -> Self {
        let twice = view.and_then(|v| v.stats().dropped.get(&DropReason::Duplicate).copied());
        let frames = frames.up.get(TransmitKind::Repeat.name()).map_or(0, |sum| sum.frames);
        Self { frames, arrived_twice: twice.unwrap_or(0) }
    }
}

impl Mission {
    /// Energy that the modem of an end transmits so many bits with, joules; `None` if it is not counted.
    pub(crate) fn joules(&self, bits: u64) -> Option<f64> {
        Some(bits as f64 * scenecast_config::joules_per_bit(&self.config, self.modem())?)
    }

    /// Energy that the modems of vehicle and surface have transmitted with, joules; `None` if it is not counted.
    pub fn energy_j(&self) -> Option<[f64; 2]> {
        let [up, down] = self.bits_on_air().map(|bits| self.joules(bits));
        Some([up?, down?])
    }

    /// The vehicle's energy divided by the bits of the map that the surface has acknowledged, joules; `None` without any, or if
    /// energy is not counted.
    pub fn energy_per_map_bit_j(&self) -> Option<f64> {
        per_map_bit(self.energy_j()?[0], self.vehicle().stats())
    }
}

/// The energy divided by the bits of the map that the surface has acknowledged; `None` without any.
pub(crate) fn per_map_bit(joules: f64, stats: &LinkStats) -> Option<f64> {
    let delivered = stats.delivered_by_class.get(&Class::Map).copied().filter(|&bytes| bytes > 0)?;
    Some(joules / (delivered * 8) as f64)
}
