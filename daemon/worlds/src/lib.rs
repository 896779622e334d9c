//! Procedural worlds with known truth, and scores of maps against it.
//!
//! [`patches`] draws a sea floor from the generative process of the scene model, as an image with the class of each
//! pixel. [`Reef`] is a sea floor that looks like one, with a camera over it. [`sample`] draws a label map from the prior
//! itself. [`Motion`] and [`Odometry`] are the true motion of a vehicle and what its sensors make of it. [`scoring`] compares maps
//! with the truth or with annotations, and trains vocabularies. All are functions of their arguments: the same seed gives the same
//! world. No input or output; no crate that goes to sea uses this one.
//!
//! ```
//! // 640 x 480 pixels, patches of about 60 pixels, at most 6 classes.
//! let world = scenecast_worlds::patches(7, 640, 480, 60, 6);
//! assert_eq!(world.image.dimensions(), (640, 480));
//! let class_of_the_first_pixel = world.truth[0];
//! assert!(class_of_the_first_pixel < 6);
//! ```

mod motion;
mod noise;
mod patches;
mod reef;
mod sample;
pub mod scoring;
mod track_audit;

pub use motion::{Motion, Odometry};
pub use patches::{Patches, patches};
pub use reef::{Reef, ReefCamera, View};
pub use sample::{LabelWorld, sample};
pub use track_audit::{length_m, stretches_outside};
