#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sim_channel_fuzz::s2c(data));
