#![no_main]

use libfuzzer_sys::fuzz_target;
use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};

fuzz_target!(|data: &[u8]| {
    for interpreter in [Interpreter::At, Interpreter::Net] {
        let config = S2cConfig { interpreter, baud: None, boot_ms: 1, remote: 2, ..S2cConfig::new(1) };
        sim_channel_fuzz::host(S2c::new(config), data);
    }
});
