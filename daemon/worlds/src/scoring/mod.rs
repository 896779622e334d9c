//! Scores label maps against expert annotations and tracks against true ones, and trains vocabularies.
//!
//! On a small scene, mutual information alone is misleading: any map made of patches has some mutual information with
//! any annotation made of patches. [`score`] therefore also computes a spatial null model, and the excess over it.
//!
//! ```
//! use image::GrayImage;
//! use scenecast_worlds::scoring::{AnnotatedScene, Method, Trial};
//!
//! let world = scenecast_worlds::patches(3, 240, 180, 40, 4);
//! let classes = GrayImage::from_raw(world.width, world.height, world.truth).ok_or("wrong size")?;
//! let trial = Trial { labels: 8, cells_across: 30, sweeps: 5, seeds: 1 };
//! let scene = AnnotatedScene::new(trial, &world.image, &classes, &[255])?;
//!
//! let score = scene.mean_score(Method::SceneModel)?;
//! assert!(score.excess_nats > 0.3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod annotations;
mod baselines;
mod discriminant;
mod mutual_information;
mod rigid_fit;
mod seams;
mod trial;

pub use annotations::{AnnotationError, Annotations, LabelGrid};
pub use baselines::mosaic_classes;
pub use discriminant::{ClassStatistics, DiscriminantTrainingError, MIN_CLASS_CELLS};
pub use mutual_information::{MutualInformation, SceneScore, mutual_information_nats, score};
pub use rigid_fit::{PointPair, RigidFit, rms_distance};
pub use seams::{Seams, TimedCell};
pub use trial::{AnnotatedScene, MeanScore, Method, Trial, TrialError, median, train_vocabulary};
