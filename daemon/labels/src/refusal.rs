//! The bounds of an item, and why one is not taken.

use scenecast_protocol::map::{ClassEntry, LayerDescriptor, MAX_CLASS};

/// Most bytes of a header.
pub const MAX_HEADER_BYTES: usize = 1 << 16;

/// Most bytes of a picture.
pub const MAX_PICTURE_BYTES: usize = 1 << 25;
/// Most pixels of a picture.
pub const MAX_PIXELS: u64 = 1 << 24;

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
    Message(#[from] MessageFault),
    /// So many messages have another type than their topic.
    #[error("the message: {0} messages have another type than the topic")]
    OtherType(u64),
    /// So many messages were not read in time.
    #[error("the message: {0} messages were dropped: newer ones came before they were read")]
    Overtaken(u64),
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

/// A message of ROS 2 that contradicts itself, or has another encoding.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MessageFault {
    #[error("{names} names of layers and {arrays} arrays")]
    Layers { names: usize, arrays: usize },
    #[error("a start index lies outside of the grid")]
    StartIndex,
    #[error("layer {0:?}: {1}")]
    Layer(String, LayerFault),
    #[error("the encoding {0:?}: mono8 and 8UC1 are taken, whose value is the class")]
    Encoding(String),
}

/// An array of numbers that is no layer of its grid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LayerFault {
    #[error("{0} dimensions, and two are taken")]
    Dimensions(usize),
    #[error("{} x {} numbers on {rows} x {columns} cells", .sizes.0, .sizes.1)]
    Sizes { sizes: (u32, u32), rows: u32, columns: u32 },
    #[error("{found} numbers, and {needed} are needed")]
    Numbers { found: usize, needed: usize },
}
