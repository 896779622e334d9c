//! Orders about one setting, and the settings that are a choice among a few.

use crate::bytes::Truncated;

/// An order about one setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Change<T> {
    /// The setting stays as it is.
    #[default]
    Keep,
    /// The setting returns to the vehicle's configured value.
    Configured,
    /// The setting gets this value.
    To(T),
}

impl<T: Copy> Change<T> {
    /// The combination of this order and a later one: the later one, unless it keeps the setting.
    pub fn then(self, later: Self) -> Self {
        if matches!(later, Self::Keep) { self } else { later }
    }

    /// The ordered value; `None` if the configured value is in force.
    pub fn value(self) -> Option<T> {
        match self {
            Self::To(value) => Some(value),
            Self::Keep | Self::Configured => None,
        }
    }

    pub(super) fn code(self, index: impl FnOnce(T) -> u8) -> u8 {
        match self {
            Self::Keep => 0,
            Self::Configured => 1,
            Self::To(value) => index(value) + 2,
        }
    }

    pub(super) fn from_code(code: u8, value: impl FnOnce(u8) -> Option<T>) -> Result<Self, Truncated> {
        match code {
            0 => Ok(Self::Keep),
            1 => Ok(Self::Configured),
            _ => value(code - 2).map(Self::To).ok_or(Truncated),
        }
    }
}

/// The planner that chooses the next waypoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerKind {
    /// Parallel legs over the whole survey.
    Lawnmower,
    /// Always the place with the highest gain for each metre of path.
    Greedy,
    /// The best path over the whole remaining distance and time.
    Horizon,
}

impl PlannerKind {
    /// Every planner, in wire order.
    pub const ALL: [Self; 3] = [Self::Lawnmower, Self::Greedy, Self::Horizon];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lawnmower => "lawnmower",
            Self::Greedy => "greedy",
            Self::Horizon => "horizon",
        }
    }

    /// The planner of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
}

/// What an adaptive survey does once no look pays any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEnd {
    /// It explores the rest of the area, then looks at the favoured labels again, as if it had not seen them.
    Repeat,
    /// It explores the rest of the area, then holds.
    Explore,
    /// It holds, and does not explore the rest of the area first.
    Hold,
}

impl AtEnd {
    /// Every choice, in wire order.
    pub const ALL: [Self; 3] = [Self::Repeat, Self::Explore, Self::Hold];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Explore => "explore",
            Self::Hold => "hold",
        }
    }

    /// The choice of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }
}

/// Whether the images of the camera place its frames on the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Registration {
    /// Odometry and compass place them.
    Off,
    /// Their overlap with earlier frames places them too.
    On,
}

impl Registration {
    /// Every choice, in wire order.
    pub const ALL: [Self; 2] = [Self::Off, Self::On];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
        }
    }

    /// The choice of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }
}

/// The cells of the map that a vehicle sends. The cells of its scene model do not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellBand {
    /// Every cell of the map, in no order of size.
    Fine,
    /// Where the backlog is long, every fourth cell in both directions first; then every cell.
    CoarseToFine,
    /// Every fourth cell in both directions. Other cells that the surface already knows stay up to date.
    Coarse,
}

impl CellBand {
    /// Every band, in wire order.
    pub const ALL: [Self; 3] = [Self::Fine, Self::CoarseToFine, Self::Coarse];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::CoarseToFine => "coarse-to-fine",
            Self::Coarse => "coarse",
        }
    }

    /// The band of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|band| band.name() == name)
    }
}
