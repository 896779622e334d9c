//! The spatially correlated Chinese Restaurant Process topic model of Girdhar et al. (ICRA 2019).
//!
//! The world is cut into cells; a word in a cell takes label k with weight
//! (n_k + alpha) (n_kw + beta) / (n_k. + V beta), where n_k counts label k in the cell and its Von Neumann neighbours
//! (those that look alike may count more, see [`SceneConfig::colour_levels`]),
//! or a new label with the weight that [`Birth`] says; the word's own label is taken out exactly.
//!
//! Sampling goes in phases of cells that are no neighbours of each other: within a phase the global counts stand still
//! and each cell draws from its own counter-based random numbers, so labels depend on neither the order of the cells
//! nor the number of threads. Births of one phase share one new label.

mod cells;
mod checkpoint;
mod config;
#[cfg(test)]
mod consistency;
mod evaluate;
mod gibbs;
mod grid;
mod kernel;
mod kinship;
mod label_map;
mod labels;
mod model;
mod schedule;

pub use checkpoint::CheckpointError;
pub use config::{Birth, ConfigError, SceneConfig};
pub use grid::{centre_of, coord_of};
pub use kernel::Kernel;
pub use label_map::FlatCell;
pub use labels::TopicId;
pub use model::{Inserted, SceneModel};
