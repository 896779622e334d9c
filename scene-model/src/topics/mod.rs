//! The topic model: a spatially correlated Chinese Restaurant Process (Girdhar et al., ICRA 2019).
//!
//! The world is cut into cells. A word w in a cell takes an existing label k with the weight (n_k + alpha) (n_kw +
//! beta) / (n_k. + V beta), or a new label with the weight that [`Birth`] names. n_k counts label k in the cell and in
//! its Von Neumann neighbours, n_kw counts word w with label k everywhere, n_k. is the sum of n_kw over all words, and
//! V is the size of the vocabulary. The word's own label is removed from all counts first. Neighbours of a similar
//! colour can weigh more: see [`SceneConfig::colour_levels`].
//!
//! Sampling proceeds in phases. The cells of a phase are not neighbours of each other, the global counts are frozen
//! meanwhile, and each cell draws from its own counter-based random numbers. The labels therefore depend neither on the
//! order of the cells nor on the number of threads. All births of one phase share one new label.

mod affinity;
mod cells;
mod checkpoint;
mod config;
mod kernel;
mod label_map;
mod labels;
mod model;
mod sampler;
mod snapshot;

pub use cells::{centre_of, coord_of};
pub use checkpoint::CheckpointError;
pub use config::{Birth, ConfigError, SceneConfig};
pub use kernel::Kernel;
pub use label_map::FlatCell;
pub use labels::TopicId;
pub use model::{Inserted, SceneModel};

#[cfg(test)]
mod consistency_tests;
