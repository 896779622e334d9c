//! Two ends that agree, whatever the water does to the frames between them.
//!
//! [`VehicleLink`] and [`SurfaceLink`] are the ends. What they share, the state of a pair of ends, is in [`Pair`], split by
//! concern: who speaks with whom (`meeting`, `run`), [`Flight`] (frames of unknown fate), [`Window`] (frames heard).

mod estimate;
mod flight;
mod meeting;
mod pair;
mod run;
mod slots;
mod stats;
mod surface;
mod vehicle;
mod window;

pub use estimate::{Goodput, Loss};
pub use flight::Flight;
pub use pair::{Inbound, Pair};
pub use run::{Authenticity, Identity};
pub use slots::{SlotInbox, SlotInboxState};
pub use stats::{DropReason, LinkStats};
pub use surface::{Cycle, IssueError, PeerView, SurfaceConfig, SurfaceEvent, SurfaceLink};
pub use vehicle::{VehicleConfig, VehicleEvent, VehicleLink};
pub use window::{Refusal, Window};

use crate::schedule::Class;

/// A frame to put on air.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transmit {
    /// Receiver.
    pub to: crate::wire::Address,
    /// The frame.
    pub bytes: Vec<u8>,
    /// The main purpose of the frame.
    pub kind: TransmitKind,
}

/// The main purpose of a transmission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TransmitKind {
    /// The surface looks for unknown vehicles.
    DiscoveryCall,
    /// Opens a handshake, answers one, or answers a discovery call.
    Hello,
    /// Grants a turn and carries no slot.
    Grant,
    /// Acknowledges received frames only.
    Acknowledgement,
    /// The unchanged copy of an earlier frame.
    Repeat,
    /// Carries chunks, the most bytes of them of this class.
    Content(Class),
}

impl TransmitKind {
    /// Name in reports and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::DiscoveryCall => "call",
            Self::Hello => "hello",
            Self::Grant => "grant",
            Self::Acknowledgement => "ack",
            Self::Repeat => "again",
            Self::Content(class) => class.name(),
        }
    }
}

/// Why the link asks to be woken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wakeup {
    /// Its granted turn begins.
    Turn,
    /// The surface may grant the next turn.
    Grant,
}

/// The frame number after which a peer that lost its state starts counting what it hears.
type FrameNumber = u64;
