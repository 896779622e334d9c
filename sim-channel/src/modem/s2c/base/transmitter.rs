//! The transducer, the frames that wait for it one at a time, and work that is scheduled for later.

use super::{FrameKind, PendingFix, ReceivedSignal, S2cFrame};
use crate::modem::emulator::HostId;
use std::collections::VecDeque;
use std::time::Duration;

#[derive(Clone, Debug)]
pub(crate) struct QueuedFrame {
    pub frame: S2cFrame,
    pub airtime: Duration,
    /// The type in `SENDSTART` and `SENDEND`.
    pub label: &'static str,
    pub then: AfterSending,
}

/// The step that follows the end of a transmission.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum AfterSending {
    Done,
    /// The instant message of that number waits for its acknowledgement.
    Instant(u8),
    /// The train or probe of that turn waits for its acknowledgement.
    Train(u64),
    /// The acknowledgement ended that turn.
    Acknowledged(u64),
    /// The connection request of that epoch waits for its grant.
    Request(u32),
    Closed,
}

#[derive(Debug, Default)]
pub(crate) struct Transmitter {
    queue: VecDeque<QueuedFrame>,
    busy_until: Duration,
}

impl Transmitter {
    pub(crate) fn is_busy(&self, now: Duration) -> bool {
        now < self.busy_until
    }

    pub(crate) fn push(&mut self, out: QueuedFrame) {
        self.queue.push_back(out);
    }

    /// Queues a frame before all others.
    pub(crate) fn push_first(&mut self, out: QueuedFrame) {
        self.queue.push_front(out);
    }

    /// Drops the waiting frames of some kinds.
    pub(crate) fn discard(&mut self, kinds: &[FrameKind]) {
        self.queue.retain(|out| !kinds.contains(&out.frame.kind));
    }

    /// Takes the next frame and occupies the transducer for its airtime; `None` while it is occupied.
    pub(crate) fn begin(&mut self, now: Duration) -> Option<QueuedFrame> {
        if self.is_busy(now) {
            return None;
        }
        let out = self.queue.pop_front()?;
        self.busy_until = now + out.airtime;
        Some(out)
    }
}

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
