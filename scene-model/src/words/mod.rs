//! Visual words: colour, context, spread, texture and binary features on regular grids of a frame.
//!
//! The vocabularies need no training. Ids are consecutive in the order above: 512 colour, 864 context, 216 spread, 216
//! texture and 64 binary words. Features are compared with a tone stretch and with means and deviations that come from
//! the first frames ([`WordConfig::warm_up_frames`]) and then stay frozen, so that a word keeps its meaning through a
//! mission. A mosaic is a single frame, hence compared with itself.

mod binary;
mod colour;
mod config;
mod context;
mod discriminant;
mod extractor;
mod flat_field;
mod grey_plane;
mod ids;
mod texture;

pub use colour::lab as cie_lab;
pub(crate) use colour::{ColourField, LEVELS as COLOUR_LEVELS};
pub use config::{Word, WordConfig};
pub use discriminant::{
    Discriminant, DiscriminantError, FEATURES, MAX_DIRECTIONS, MAX_PROTOTYPES, MEASURES, MeasuredPlace,
};
pub use extractor::{Measures, WordExtractor};
pub use flat_field::FlatField;
pub(crate) use grey_plane::GreyPlane;
pub(crate) use texture::GaborBank;
