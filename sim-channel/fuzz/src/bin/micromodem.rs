#![no_main]

use libfuzzer_sys::fuzz_target;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};

fuzz_target!(|data: &[u8]| {
    sim_channel_fuzz::host(Micromodem::new(MicromodemConfig { baud: None, ..MicromodemConfig::new(1) }), data);
});
