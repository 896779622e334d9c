//! Reading and writing of single bytes and bits, which every format on the wire shares.

mod bits;
mod number;
mod reader;
mod steps;

pub(crate) use bits::{BitReader, BitWriter};
pub(crate) use number::{decimetres, put24};
pub use reader::{Reader, Truncated};
pub(crate) use steps::{DecimetreStep, take_width, width_of};
