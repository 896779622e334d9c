//! Two ends that agree on their shared state, whatever frames the channel loses, delays, repeats or damages.
//!
//! [`VehicleLink`] and [`SurfaceLink`] are the ends. Toward each peer, an end keeps a handshake, its run, the [`Flight`]
//! of sent frames whose fate is unknown, and the [`LinkWindow`] of received frames.

mod handshake;
mod mismatch;
mod pair;
mod run;
mod slots;
mod stats;
mod surface;
mod vehicle;
mod window;

pub use mismatch::Mismatch;
pub use pair::HOLDER_SILENCE;
use pair::{AckRoom, Inbound, LinkPair};
pub use run::{Authenticity, Identity};
pub use slots::{Admission, SeriesRecord, SlotInbox, SlotInboxState};
pub use stats::{DropReason, Goodput, LinkQuality, LinkStats, Loss};
pub use surface::{
    Cycle, EndedRun, InForce, IssueError, OtherSurface, PeerView, SurfaceConfig, SurfaceEvent, SurfaceLink,
};
pub use vehicle::{OversizedChunk, VehicleConfig, VehicleEvent, VehicleLink};
pub use window::{Flight, LinkWindow, WindowRefusal};

use crate::schedule::Class;
use std::collections::BTreeMap;

/// A frame that the host must transmit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transmit {
    /// The receiver; a modem that addresses frames itself needs it.
    pub to: crate::wire::Address,
    /// The bytes of the frame, at most the modem's frame size.
    pub bytes: Vec<u8>,
    /// The main purpose of the frame.
    pub kind: TransmitKind,
    /// Bytes of its chunks by class; none for a copy of an earlier frame.
    pub contents: BTreeMap<Class, u64>,
}

/// Bytes of chunks by class.
fn by_class(chunks: impl IntoIterator<Item = (Class, usize)>) -> BTreeMap<Class, u64> {
    let mut bytes = BTreeMap::new();
    chunks.into_iter().for_each(|(class, n)| *bytes.entry(class).or_default() += n as u64);
    bytes
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
    /// Only acknowledges received frames, without any chunk.
    Acknowledgement,
    /// The unchanged copy of an earlier frame.
    Repeat,
    /// Carries chunks, the most bytes of them of this class.
    Content(Class),
}

impl TransmitKind {
    /// The name in reports and logs.
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

/// The reason for a wakeup.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wakeup {
    /// The turn begins that the surface has granted.
    Turn,
    /// The surface may grant the next turn.
    Grant,
}

/// An unbounded frame number; the header carries its low 16 bits.
type FrameNumber = u64;
