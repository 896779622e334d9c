//! Fuzz targets of scenecast-runtime. The journal and the store are private to the crate, so their sources are modules here.

#[allow(dead_code)]
#[path = "../../src/store/batch.rs"]
mod batch;
pub mod files;
#[allow(dead_code, unused_imports, unexpected_cfgs)]
#[path = "../../src/journal/mod.rs"]
mod journal;
pub mod journal_target;
#[allow(dead_code)]
#[path = "../../src/store/log.rs"]
mod log;
pub mod store_target;
