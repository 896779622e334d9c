#![no_main]

use libfuzzer_sys::fuzz_target;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{S2c, S2cConfig};

fuzz_target!(|data: &[u8]| {
    sim_channel_fuzz::channel(S2c::new(S2cConfig::new(2)), data);
    sim_channel_fuzz::channel(Micromodem::new(MicromodemConfig::new(2)), data);
});
