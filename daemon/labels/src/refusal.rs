//! Why an item is not taken.

use crate::picture::{MAX_PICTURE_BYTES, MAX_PIXELS};
use crate::stream::MAX_HEADER_BYTES;
use scenecast_protocol::map::{ClassEntry, LayerDescriptor, MAX_CLASS};

/// Why an item of labels or of a band is not taken; the text is for people.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The header is not JSON, or has wrong members.
    #[error("the header: {0}")]
    Header(String),
    #[error("the header is longer than {MAX_HEADER_BYTES} bytes")]
    LongHeader,
    #[error("the header: {0} {1} is not within {2}")]
    Range(&'static str, f64, &'static str),
    #[error("the header: {0} is missing")]
    Missing(&'static str),
    #[error("the header: only one of t_s, time and age_s is taken")]
    Times,
    #[error("the header: step and low belong together, and to a band of 16 bits or of numbers")]
    Scale,
    #[error("the picture: {0}")]
    Picture(String),
    #[error("the picture has {0} bytes: allowed are 1 to {MAX_PICTURE_BYTES}")]
    PictureBytes(u64),
    #[error("the picture has {0} x {1} pixels: allowed are 1 to {MAX_PIXELS} in all")]
    Pixels(u32, u32),
    #[error("the picture has {0} bytes, which are not those of {1} x {2} pixels")]
    RawLength(usize, u32, u32),
    #[error("the picture is {0}: it takes 8-bit grey or indexed pixels, whose value is the class or the level")]
    Depth(String),
    #[error("class {0}: it takes 0 to {MAX_CLASS}, and 255 for unknown")]
    Class(u8),
    #[error("class {0}: the name takes 1 to {max} bytes without control characters", max = ClassEntry::MAX_NAME)]
    ClassName(u8),
    #[error("class {0} is named {1:?} already; a class keeps its name and its colour within a mission")]
    OtherName(u8, String),
    #[error("class {0}: the colour takes # and six hexadecimal digits")]
    Colour(u8),
    #[error(
        "the band: name takes 1 to {name} of a to z, 0 to 9 and _; unit at most {unit} bytes; scale must be above 0",
        name = LayerDescriptor::MAX_NAME,
        unit = LayerDescriptor::MAX_UNIT
    )]
    Band,
    #[error("band {0:?} came with another unit, scale or offset before")]
    OtherBand(String),
    #[error("band {0:?}: the map has no further layer")]
    TooManyBands(String),
    #[error("band {0:?}: no cell has a number of at most 5e8, so that no scale can be chosen")]
    NoScale(String),
    #[error("this source gives bands alone, and the item has labels; labels.source gives labels")]
    BandsAlone,
    #[error("the frame of reference is {0:?}: {1} is taken")]
    Frame(String, String),
    #[error("the grid is turned by {0:.2} degrees: only grids along east and north are taken")]
    Turned(f64),
    #[error("the message: {0}")]
    Message(String),
    #[error("it covers {0} cells of the map: at most {1} are taken")]
    Cells(u64, u64),
    #[error("the map would have more than {0} cells")]
    FullMap(usize),
    #[error("the pose is missing, and the vehicle does not know its own")]
    NoPose,
    #[error("the pose is missing, and the vehicle does not know its own at {0:.1} s of the mission")]
    NoPoseAt(f64),
    #[error("the pose is missing, and the vehicle does not know its own before the start of its program")]
    NoPoseBefore,
    #[error("it ends after {0} of {1} bytes")]
    CutOff(usize, usize),
}
