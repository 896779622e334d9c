//! Fuzz targets of scenecast-protocol: `targets` states the properties, `src/bin` runs them under libFuzzer.

pub mod targets;
