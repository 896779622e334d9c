//! Fuzz targets of scenecast-runtime. The journal is private to the crate, so its source is a module here.

#[allow(dead_code, unused_imports, unexpected_cfgs)]
#[path = "../../src/journal/mod.rs"]
mod journal;

pub mod targets;
