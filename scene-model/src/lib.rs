//! Camera image to label map: visual words, a spatially correlated Chinese Restaurant Process topic model, a 2-D map.
//!
//! The way of the data: [`words`] finds visual words in a frame, [`project`] puts them into the world, [`topics`] learns
//! and labels, [`publish`] gives the labels ids that never change their meaning. [`exemplars`] keeps the image patches
//! that show what a label means, [`tuning`] and [`score`] measure a map against annotations, [`generate`] draws worlds to rehearse in.
//!
//! Nothing here does input or output, reads a clock, or draws from a global random source: the same calls with the same
//! seed give the same labels.

#![warn(missing_docs)]

pub mod envelope;
pub mod exemplars;
pub mod generate;
pub mod project;
pub mod publish;
mod random;
pub mod score;
pub mod topics;
pub mod tuning;
pub mod vocabulary;
pub mod words;
