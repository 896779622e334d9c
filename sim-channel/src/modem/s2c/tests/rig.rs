//! Hosts at S2C modems in one basin.

pub(super) use crate::modem::tests::rig::{EmulatorRig, SECOND, keywords};

use crate::channel::ChannelConfig;
use crate::modem::Emulator;
use crate::modem::s2c::{S2c, S2cConfig};

impl EmulatorRig {
    pub(super) fn new(modems: u8, range_m: f64, config: ChannelConfig) -> Self {
        Self::of((1..=modems).map(S2cConfig::new).collect(), range_m, config)
    }

    pub(super) fn of(modems: Vec<S2cConfig>, range_m: f64, config: ChannelConfig) -> Self {
        let boxed = |modem: S2cConfig| (modem.address, Box::new(S2c::new(modem)) as Box<dyn Emulator>);
        Self::join(modems.into_iter().map(boxed).collect(), range_m, config)
    }

    pub(super) fn calm(modems: u8) -> Self {
        Self::new(modems, 1500.0, ChannelConfig::default())
    }
}
