//! Fuzz targets of scenecast-protocol: `targets` says what must hold, `src/bin` runs it under libFuzzer.

pub mod targets;
