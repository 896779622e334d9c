//! Over a medium that carries both directions at once: a frame that asks for an acknowledgement when none comes.

use crate::time::Instant;
use std::time::Duration;

/// When a loss at the end of the traffic is to be looked for. Nothing that follows a lost frame would show it, and the frame
/// would be sent again only with the next news.
#[derive(Debug, Default)]
pub(super) struct TailProbe {
    due: Option<Instant>,
    /// How often a probe has gone out since frames were last acknowledged.
    unanswered: u32,
}

impl TailProbe {
    /// Most doublings of the wait: a surface that is gone costs a probe every 32 waits.
    const MAX_DOUBLINGS: u32 = 5;

    /// When the next probe is due.
    pub(super) fn due(&self) -> Option<Instant> {
        self.due
    }

    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.due.is_some_and(|at| now >= at)
    }

    /// A frame goes out at `now`; an acknowledgement takes about `wait` to come.
    pub(super) fn handle_transmit(&mut self, wait: Duration, now: Instant) {
        self.unanswered += u32::from(self.is_due(now));
        self.due = Some(now + wait * (1 << self.unanswered.min(Self::MAX_DOUBLINGS)));
    }

    /// The fate of frames is known; `outstanding` are still without one.
    pub(super) fn handle_fates(&mut self, outstanding: u64) {
        self.unanswered = 0;
        if outstanding == 0 {
            self.due = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_end_with_the_last_fate_and_grow_rarer_without_one() {
        let at = |ms: u64| Instant::from_micros(ms * 1000);
        let mut probe = TailProbe::default();
        probe.handle_transmit(Duration::from_millis(100), at(0));
        assert!(!probe.is_due(at(99)) && probe.is_due(at(100)));
        let mut now = at(100);
        let pauses: Vec<u128> = (0..8)
            .map(|_| {
                probe.handle_transmit(Duration::from_millis(100), now);
                let pause = probe.due().unwrap().since(now);
                now = probe.due().unwrap();
                pause.as_millis()
            })
            .collect();
        assert_eq!(pauses, [200, 400, 800, 1600, 3200, 3200, 3200, 3200]);
        probe.handle_fates(3);
        assert!(probe.due().is_some());
        probe.handle_fates(0);
        assert_eq!(probe.due(), None);
    }
}
