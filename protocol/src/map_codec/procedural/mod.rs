//! Maps made by chance, to train the coder's prior on and to measure with; none comes from a real place.

mod chance;
mod lesson;
mod scene;
mod survey;

pub use chance::Chance;
pub use lesson::{Lesson, lessons};
pub use scene::{Scene, sampler_noise};
pub use survey::{Flips, Survey};
