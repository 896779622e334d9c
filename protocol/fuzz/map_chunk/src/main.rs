//! Arbitrary bytes as a map chunk; `corpus/` is replayed by the ordinary tests of scenecast-protocol.
#![no_main]

mod check;

use libfuzzer_sys::fuzz_target;
use scenecast_protocol::{map, map_codec};

fuzz_target!(|data: &[u8]| check::check(data));
