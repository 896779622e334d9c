//! Measurements that a change of scenecast is compared with, as commands of `scenecast-bench`.
//!
//! `scenecast bench` has those that answer a user's question with his own settings; these are in no release.

mod arguments;
mod console;
mod cpu_meter;
mod exemplar;
mod faults;
mod frame;
mod inference;
mod labels;
mod link_ends;
mod live;
mod localisation;
mod map_codec;
mod process;
mod program;
mod raster;
mod record;
mod registration;
mod restart;
mod steering;
mod stranger;
mod surfaces;
mod surveys;
mod train_prior;
mod wide;

pub use arguments::Arguments;
