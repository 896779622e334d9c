#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| scenecast_runtime_fuzz::store_target::store(data));
