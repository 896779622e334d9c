//! Whether the modem runs, receives and accepts messages.

use std::time::Duration;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum ReceiverMode {
    #[default]
    Listen,
    Noise,
    Deaf,
}

/// Changed by `ATA`, `ATN` and `ATD`, by a restart, and by the fault `Busy`.
#[derive(Debug, Default)]
pub(crate) struct Condition {
    receiver: ReceiverMode,
    booting: bool,
    refuses_until: Duration,
}

impl Condition {
    pub(crate) fn booting() -> Self {
        Self { booting: true, ..Self::default() }
    }

    pub(crate) fn is_booting(&self) -> bool {
        self.booting
    }

    pub(crate) fn on_booted(&mut self) {
        self.booting = false;
    }

    pub(crate) fn receiver(&self) -> ReceiverMode {
        self.receiver
    }

    pub(crate) fn set_receiver(&mut self, mode: ReceiverMode) {
        self.receiver = mode;
    }

    pub(crate) fn receives(&self) -> bool {
        !self.booting && self.receiver == ReceiverMode::Listen
    }

    pub(crate) fn refuse_until(&mut self, until: Duration) {
        self.refuses_until = until;
    }

    /// The reply to every message command while none is accepted.
    pub(crate) fn refusal(&self, now: Duration) -> Option<&'static str> {
        if now < self.refuses_until {
            return Some("BUSY BACKOFF STATE");
        }
        (self.receiver != ReceiverMode::Listen).then_some("ERROR PHY OFF")
    }
}
