//! The bytes and the energy of the vehicle's transmissions.

use super::mission::Mission;
use scenecast_config::MapStream;
use scenecast_protocol::link::{DropReason, TransmitKind};
use scenecast_protocol::schedule::Class;
use serde::Serialize;

/// Bytes that the vehicle put on air, by use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Uplink {
    pub map: u64,
    pub status: u64,
    /// Headers, acknowledgement statements and integrity checks.
    pub overhead: u64,
    /// Copies of earlier frames.
    pub repeated: u64,
    /// Layers and images.
    pub other: u64,
}

impl Uplink {
    pub fn of(mission: &Mission) -> Self {
        let stats = mission.vehicle().stats();
        let of = |class| stats.bytes_by_class.get(&class).copied().unwrap_or(0);
        let [map, status, overhead] = [mission.map_class(), Class::Status, Class::Overhead].map(of);
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
    pub fn of(mission: &Mission) -> Self {
        let view = mission.surface().view(mission.address());
        let twice = view.and_then(|v| v.stats().dropped.get(&DropReason::Duplicate).copied());
        let frames = mission.frames().up.get(TransmitKind::Repeat.name()).map_or(0, |sum| sum.frames);
        Self { frames, arrived_twice: twice.unwrap_or(0) }
    }
}

impl Mission {
    /// The class that carries the map: a whole PNG file counts as an image.
    pub(crate) fn map_class(&self) -> Class {
        match self.config.map.stream {
            MapStream::Delta => Class::Map,
            MapStream::WholePng => Class::Exemplar,
        }
    }

    /// Energy that the modems of vehicle and surface have transmitted with, joules; `None` if it is not counted.
    pub fn energy_j(&self) -> Option<[f64; 2]> {
        let joules = scenecast_config::joules_per_bit(&self.config, self.modem())?;
        Some(self.bits_on_air().map(|bits| bits as f64 * joules))
    }

    /// The vehicle's energy divided by the bits of the map that the surface has acknowledged, joules; `None` without any, or if
    /// energy is not counted.
    pub fn energy_per_map_bit_j(&self) -> Option<f64> {
        let delivered =
            self.vehicle().stats().delivered_by_class.get(&self.map_class()).copied().filter(|&bytes| bytes > 0)?;
        Some(self.energy_j()?[0] / (delivered * 8) as f64)
    }
}
