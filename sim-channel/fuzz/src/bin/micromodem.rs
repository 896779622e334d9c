#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| sim_channel_fuzz::micromodem(data));
