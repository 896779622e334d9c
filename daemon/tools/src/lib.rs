//! Offline work: the scene model over files, label maps in files, tuning and vocabularies, as commands.
//!
//! Internal to scenecast.

mod annotated_images;
pub mod commands;
mod figures;
mod progress;
mod scene;
mod seed_arguments;
mod zopfli;

pub use figures::print_figures;
pub use progress::{Progress, ProgressForm};
pub use seed_arguments::SeedArguments;
pub use zopfli::Zopfli;
