#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| scenecast_daemon_fuzz::s2c_driver(data));
