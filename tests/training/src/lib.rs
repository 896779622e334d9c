//! Procedural label maps, and the training of the `context` coder's prior on them.
//!
//! Every map comes from a seed alone; none is of a real place. [`MapScene`] draws a map, [`Survey`] explores it step by
//! step, [`lessons`] cuts changes out of both, and [`train_prior`] trains on the lessons.

mod lesson;
mod prior;
mod rng;
mod scene;
mod survey;

pub use lesson::{Lesson, lessons};
pub use prior::{PRIOR_SCENES, train_prior};
pub use rng::MapRng;
pub use scene::{MapScene, sampler_noise};
pub use survey::{Flips, Survey};
