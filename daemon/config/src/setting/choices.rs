//! Values that are one of some words.

use super::{Setting, one_of};
use crate::rule::Rule;
use scenecast_core::{FlowControl, SerialFormat};
use scenecast_protocol::directive::{AtEnd, CellBand, PlannerKind, Reaction};
use scenecast_protocol::map_codec::Codec;
use strum::{Display, IntoStaticStr, VariantArray};
use toml::Value;

/// A setting whose value is one of a few words.
pub(super) trait Choice: Copy + 'static {
    const CHOICES: &'static [Self];

    fn word(self) -> &'static str;
}

impl<T: Choice> Setting for T {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        let word = value.as_str()?;
        Self::CHOICES.iter().copied().find(|choice| choice.word() == word)
    }

    fn write(&self) -> Value {
        Value::String(self.word().to_owned())
    }

    fn allowed(_: &Rule) -> String {
        format!("one of {}", words::<Self>().join(", "))
    }

    fn schema(_: &Rule) -> serde_json::Value {
        one_of(&words::<Self>())
    }
}

fn words<T: Choice>() -> Vec<&'static str> {
    T::CHOICES.iter().map(|choice| choice.word()).collect()
}

impl Choice for Codec {
    const CHOICES: &'static [Self] = &[Self::Auto, Self::Png, Self::Context];

    fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Png => "png",
            Self::Context => "context",
        }
    }
}

/// Takes the words of enums from their names.
macro_rules! named {
    ($($name:ident)*) => { $(
        impl Choice for $name {
            const CHOICES: &'static [Self] = &Self::ALL;

            fn word(self) -> &'static str {
                self.name()
            }
        }
    )* };
}

named! { AtEnd FlowControl PlannerKind Reaction SerialFormat }

/// Makes enums whose words are their variants' names.
macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident $case:literal { $($(#[$variant_doc:meta])* $variant:ident,)* })*) => { $(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Display, IntoStaticStr, VariantArray)]
        #[strum(serialize_all = $case)]
        pub enum $name { $($(#[$variant_doc])* $variant,)* }

        impl Choice for $name {
            const CHOICES: &'static [Self] = Self::VARIANTS;

            fn word(self) -> &'static str {
                self.into()
            }
        }
    )* };
}

choices! {
    /// Which frames the mission key authenticates.
    Authenticate "lowercase" {
        /// Frames from the surface to the vehicle.
        Down,
        /// Frames of both directions, so that nobody can forge the map either.
        All,
    }

    /// The make of modem, or the network that stands for one.
    ModemKind "lowercase" {
        /// A modem of EvoLogics with its S2C commands.
        S2c,
        /// A WHOI Micromodem, whose commands are NMEA sentences.
        Micromodem,
        /// A modem that passes bytes on as they are.
        Transparent,
        /// Frames in a TCP stream.
        Tcp,
        /// Frames in UDP datagrams, one frame in each.
        Udp,
    }

    /// How an S2C modem carries bulk data.
    S2cMode "lowercase" {
        /// In bursts; the modem does half duplex and retransmits by itself.
        Burst,
        /// In instant messages alone, in turns that the surface grants.
        #[strum(serialize = "im")]
        Instant,
    }

    /// Which cells of the map are sent.
    MapCells "lowercase" {
        /// Every cell of the scene model.
        Fine,
        /// Every fourth cell in both directions.
        Coarse,
    }

    /// The middleware that carries the topics of ROS 2.
    RosTransport "lowercase" {
        /// DDS, as `rmw_fastrtps_cpp` and `rmw_cyclonedds_cpp` use it.
        Dds,
        /// Zenoh, as `rmw_zenoh_cpp` uses it.
        Zenoh,
        /// Both side by side, joined to one node.
        Both,
    }

    /// How the weight of a new label enters the sampler.
    BirthRule "lowercase" {
        /// As the paper's equation is written.
        Literal,
        /// Divided by the size of the vocabulary.
        Collapsed,
        /// As in the program ROST.
        Rost,
    }

    /// What the labels of the scene model are.
    SceneLabels "lowercase" {
        /// Topics of the visual words.
        Topics,
        /// Cells that look alike over all their images.
        Habitats,
    }

    /// The sea floor of a rehearsal without a mosaic.
    WorldKind "lowercase" {
        /// Sand, rubble, meadows, corals and a wreck, seen through water.
        Reef,
        /// Patches drawn from the scene model's own generative process.
        Patches,
    }

    /// The time of the camera's images.
    CameraStamps "lowercase" {
        /// The time that the image itself, its file name or its message gives.
        Own,
        /// The time of arrival, less the usual delay.
        Arrival,
    }

    /// The driver of the autopilot.
    AutopilotKind "lowercase" {
        /// No autopilot: waypoints are only logged.
        None,
        /// A simulated vehicle, in builds that have the simulator.
        Rehearsal,
        /// ArduSub or ArduRover over MAVLink 2.
        Mavlink,
        /// NMEA 0183 sentences in both directions.
        Nmea,
        /// NMEA 0183 sentences that are appended to a file.
        Log,
    }

    /// How orders that a vehicle has lost are sent again.
    RestoreOrders "lowercase" {
        /// After an operator has confirmed it.
        Ask,
        /// By itself, as soon as the vehicle has no record of them.
        Auto,
    }

    /// What a vehicle does that has no orders from before its start.
    StartMode "lowercase" {
        /// It holds until the operator orders it to resume.
        Hold,
        /// It surveys at once, without an order.
        Free,
    }

    /// The direction of the straight legs of a survey.
    LegDirection "kebab-case" {
        /// The one in which a pass is shorter.
        Shortest,
        /// East and west.
        EastWest,
        /// North and south.
        NorthSouth,
    }

    /// What the operator of a rehearsal does.
    OperatorScript "lowercase" {
        /// Two utilities and some exemplar requests, at fixed shares of the survey's duration.
        Scripted,
        /// The same orders within a fence and limits.
        Fenced,
        /// No orders from its start to its end.
        None,
    }
}

impl From<MapCells> for CellBand {
    fn from(cells: MapCells) -> Self {
        match cells {
            MapCells::Fine => Self::Fine,
            MapCells::Coarse => Self::Coarse,
        }
    }
}

impl ModemKind {
    /// Whether what is written goes to the other end as it is, so that no modem answers.
    pub fn is_pipe(self) -> bool {
        match self {
            Self::Tcp | Self::Udp | Self::Transparent => true,
            Self::S2c | Self::Micromodem => false,
        }
    }
}
