//! Camera images in, a label map of the sea floor out: visual words and a spatially correlated topic model that learns
//! online, without training.
//!
//! The model is that of Girdhar et al., "Streaming Scene Maps for Co-Robotic Exploration in Bandwidth Limited
//! Environments" (ICRA 2019).
//!
//! # How to use it
//!
//! The crate does no IO and reads no clock. Your program, the host, reads images and positions, calls the model once a
//! frame, and sends or stores the map:
//!
//! ```text
//!          host                                  scene-model
//!
//!   camera -> image ----> WordExtractor::extract    pixels -> visual words (id, u, v)
//!                                  |
//!   navigation -> pose --> DownCamera::project      words -> positions in metres (id, x, y, z)
//!                                  |
//!   clock -> seconds ----> SceneModel::insert       positions -> cells; each word gets a topic
//!                                  |
//!   spare CPU time ------> SceneModel::refine       Gibbs sampling of old and new words
//!                                  |
//!                          SceneModel::label_map    cells -> one topic, confidence and perplexity each
//!                                  |
//!   radio, file <--------- LabelBook::publish       topics -> labels 1 to 254 that keep their meaning
//!                                  |
//!   once a minute <------- SceneModel::save         everything as bytes; SceneModel::load continues from them
//! ```
//!
//! The same loop in code, with three drawn frames in place of a camera:
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use scene_model::random::mix;
//! use scene_model::{DownCamera, LabelBook, Pose, SceneConfig, SceneModel, WordConfig, WordExtractor};
//!
//! let mut extractor = WordExtractor::new(&WordConfig::default());
//! let config = SceneConfig { cell_m: [0.25, 0.25, 1e4], seed: 7, ..SceneConfig::for_images() };
//! let mut model = SceneModel::new(config)?;
//! let mut book = LabelBook::new(0);
//! let mut map = Vec::new();
//!
//! for second in 0..3 {
//!     // A frame of 320 x 240 pixels, 3 m above stones of half a metre and 1 m further east each second.
//!     let stone = |x: u32, y: u32| mix(1000 * (u64::from(x / 50) + 2 * second) + u64::from(y / 50)) as u8;
//!     let image = RgbImage::from_fn(320, 240, |x, y| Rgb([stone(x, y), 90, 60]));
//!     let pose = Pose { x: second as f64, y: 0.0, z: -10.0, yaw_rad: 0.0 };
//!     let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
//!
//!     // A cell of 0.25 m is 25 pixels wide at 0.01 m a pixel.
//!     let words = extractor.extract(&image, 25.0);
//!     model.insert(second as f64, &camera.project(320, 240, &pose, &words));
//!     model.refine(50_000);
//!     map = book.publish(&model.label_map());
//! }
//!
//! assert!(map.iter().all(|cell| book.topic_of(cell.label).is_some()));
//! let checkpoint = model.save();
//! assert_eq!(SceneModel::load(&checkpoint)?.save(), checkpoint);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `daemon/worlds/examples/` has complete programs: `label_images` for a folder of images, `online_mission` for a vehicle with a
//! checkpoint and a restart, `known_truth` for scores against a known map.
//!
//! # Units
//!
//! Positions are metres in a local frame: x to the east, y to the north, z up. Angles are radians. Times are seconds from
//! any origin. Positions in an image are pixels from the top left corner. Mutual information and surprise are nats.
//!
//! # Determinism, seeds and threads
//!
//! No function reads a clock or a global source of random numbers. The same calls in the same order with the same
//! [`SceneConfig::seed`](topics::SceneConfig::seed) give the same labels bit for bit, whatever the vector instructions
//! ([`Kernel`](topics::Kernel)) and the number of threads ([`SceneModel::use_threads`]). A model uses one thread by
//! default, and all threads end before the call returns. [`SceneModel::save`] stores the state of the random
//! numbers too, so a restored model draws the labels that the saved one would have drawn.
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | [`words`] | visual words: colour, context, spread, texture and binary features |
//! | [`project`] | from pixels to the world: a camera that looks down, or a pinhole camera with depth |
//! | [`topics`] | the model: cells, the sampler, the label map, checkpoints |
//! | [`online`] | inference under way: growth of the labels, memory of the topics of cells |
//! | [`habitats`] | labels of cells by what they look like, whenever they were seen |
//! | [`publish`] | labels that keep their meaning within an epoch, restarts included |
//! | [`exemplars`] | the image patches that best show each topic |
//! | [`vocabulary`], [`envelope`] | files: measures that were learnt before the mission; magic, version, length, CRC |
//! | [`random`] | counter-based random numbers |

#![warn(missing_docs)]

pub mod envelope;
pub mod exemplars;
pub mod habitats;
pub mod online;
pub mod project;
pub mod publish;
pub mod random;
pub mod topics;
pub mod vocabulary;
pub mod words;

pub use exemplars::ExemplarStore;
pub use project::{DownCamera, Observation, Pose};
pub use publish::LabelBook;
pub use topics::{SceneConfig, SceneModel, TopicId};
pub use words::{Word, WordConfig, WordExtractor};
