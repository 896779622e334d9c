//! Procedural worlds with known truth, drawn from the generative process of the scene model.
//!
//! [`reef`] draws a sea floor as an image with the class of each pixel. [`sample`] draws a label map from the prior
//! itself. Both are functions of their arguments: the same seed gives the same world on every machine. The crate does
//! no input or output.
//!
//! ```
//! // 640 x 480 pixels, patches of about 60 pixels, at most 6 classes.
//! let reef = scenecast_worlds::reef(7, 640, 480, 60, 6);
//! assert_eq!(reef.image.dimensions(), (640, 480));
//! let class_of_the_first_pixel = reef.truth[0];
//! assert!(class_of_the_first_pixel < 6);
//! ```

mod noise;
mod patches;
mod reef;
mod sample;
mod skin;

pub use reef::{Reef, reef};
pub use sample::{LabelWorld, sample};
