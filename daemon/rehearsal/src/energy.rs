//! The energy of the transmissions of a mission.

use super::mission::Mission;
use scenecast_protocol::link::LinkStats;
use scenecast_protocol::schedule::Class;

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
