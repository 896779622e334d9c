//! Why the surface refuses an order; as text one line for the operator, which names what is allowed.

use scenecast_core::PlaceError;
use scenecast_protocol::directive::{AreasFault, LimitsFault, SettingsFault, SlotId};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::schedule::BackgroundError;
use std::fmt;

/// Why an order is not given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrderRefusal {
    #[error(transparent)]
    Link(#[from] IssueError),
    #[error(transparent)]
    Place(#[from] PlaceError),
    #[error(transparent)]
    Areas(#[from] AreasFault),
    #[error(transparent)]
    Limits(#[from] LimitsFault),
    #[error(transparent)]
    Background(#[from] BackgroundError),
    #[error("{0}, or 0 as configured")]
    Settings(#[from] SettingsFault),
    #[error("{what} {weight} is not within -1 to 1")]
    Weight { what: Weighed, weight: f64 },
    #[error("{what}: {metres} is not within 0 to 6553.5 m")]
    Band { what: &'static str, metres: f64 },
    #[error("{what} {value}: it takes 1 to {most}")]
    Whole { what: &'static str, value: f64, most: u32 },
    #[error("{what} {name:?}: it takes hold, return or surface")]
    Reaction { what: &'static str, name: String },
    #[error("{what} {name:?}: it takes {allowed}, or \"\" as configured")]
    Choice { what: &'static str, name: String, allowed: String },
    #[error("{name} {value}: it takes {least} to {most}, or 0 as configured")]
    Setting { name: &'static str, value: f64, least: f64, most: f64 },
    #[error("budget_bps {0} is not within 10 to 10000000")]
    Budget(u32),
    #[error("shares add up to {0} percent: allowed is 100 or less")]
    Shares(u32),
    #[error("the vehicle has not reported its place yet")]
    NoPlaceYet,
    #[error("label {0} is not on the map")]
    NotOnMap(u8),
    #[error(
        "the map in view has the labels of epoch {in_view}, and the vehicle is in epoch {now}: wait for the current map, or dismiss \
         the earlier one"
    )]
    EarlierMap { in_view: u8, now: u8 },
    #[error("no order of the kind {} is withdrawn", .0.name())]
    NotWithdrawn(SlotId),
    #[error("no order of the vehicle is lost")]
    NothingLost,
    #[error("it is not known whether an abort is in force; an order of abort, true or false, settles it")]
    AbortUnknown,
    #[error("an abort is in force; the order abort with false ends it")]
    Aborted,
    /// The vehicle may obey an order of this kind that this surface does not know.
    #[error(
        "the surface does not know yet which {name} the vehicle obeys, so a part cannot be changed: wait for the vehicle's report, or \
         name the whole {name} (scenecast ctl {name} clear removes it)",
        name = .0.name()
    )]
    RestUnknown(SlotId),
    #[error("the order names nothing: it takes {allowed}; null removes one")]
    NamesNothing { allowed: String },
    /// Its members do not fit together.
    #[error("{why}")]
    Members { why: String },
    #[error("{0} images are on their way: wait for one, or cancel one")]
    ManyImages(usize),
    #[error("no image of label {0} is here yet: ask for one first")]
    NoImage(u8),
    #[error("picture {number} of label {label} is not here")]
    NoPicture { label: u8, number: u8 },
    #[error("picture {number} of label {label} has its full size already: {edge_px} pixels")]
    FullSize { label: u8, number: u8, edge_px: u32 },
    #[error("no image of label {0} is asked for")]
    NotAsked(u8),
    #[error("image is for the action larger only")]
    OnlyForLarger,
}

/// What has a weight in an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighed {
    Exploration,
    Curiosity,
    Label(u8),
    /// The number of an area in its order, from 1.
    Area(usize),
}

impl fmt::Display for Weighed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exploration => f.write_str("exploration"),
            Self::Curiosity => f.write_str("curiosity"),
            Self::Label(label) => write!(f, "weight of label {label}:"),
            Self::Area(number) => write!(f, "area {number}: weight"),
        }
    }
}
