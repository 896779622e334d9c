//! Offline work: the scene model over files, label maps in files, tuning and vocabularies, as commands.
//!
//! Internal to scenecast.

mod annotated_images;
pub mod commands;
mod progress;
mod scene;
mod zopfli;

pub use progress::{Progress, ProgressForm, print_figures};
pub use zopfli::Zopfli;
