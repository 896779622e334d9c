//! The messages as bytes and as definitions.

mod bytes;
mod definitions;
