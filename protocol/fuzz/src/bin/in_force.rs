#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| scenecast_fuzz::targets::in_force(data));
