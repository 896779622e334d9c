//! Work that the modem has scheduled for later.

use super::{AfterSending, PendingFix, ReceivedSignal, S2cFrame};
use crate::modem::emulator::HostId;
use std::time::Duration;

/// Numbers (`attempt`, `epoch`, `number`) name the state that a timer belongs to. An old timer finds another number
/// and has no effect then.
#[derive(Debug)]
pub(crate) enum S2cTask {
    /// The last bit of a frame has left.
    Sent {
        dst: u8,
        label: &'static str,
        airtime: Duration,
        then: AfterSending,
    },
    /// A frame has been decoded.
    Received(Box<(S2cFrame, ReceivedSignal)>),
    Notify(String),
    /// The pending instant message may be sent.
    Instant,
    InstantTimeout {
        attempt: u32,
    },
    /// The time of a synchronous message; `late` if it had passed when the host wrote the message.
    Synchronous {
        number: u64,
        late: bool,
    },
    CancelMessages,
    /// Burst data may be waiting for a connection or a turn.
    ServePool,
    RequestTimeout {
        epoch: u32,
    },
    Turn {
        number: u64,
        owes_ack: bool,
    },
    AckTimeout {
        number: u64,
    },
    Rest {
        number: u64,
    },
    Idle {
        number: u64,
    },
    UsblFix(Box<PendingFix>),
    /// A host may have been silent for the guard time of an escape.
    Silence(HostId),
    Reboot,
    Booted,
}
