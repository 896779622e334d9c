//! Which messages of a topic are used, where each may come to two inboxes.

use std::time::{Duration, Instant};

/// Longest time between the two arrivals of a message. After it, an inbox alone has what the other one lacks.
const MAX_DELAY: Duration = Duration::from_secs(1);

/// The message that was used last.
#[derive(Debug, Clone, Copy)]
struct Used {
    inbox: usize,
    stamp_ns: i64,
    at: Instant,
}

/// Recognises the messages that the other inbox has had, and those before them. An inbox alone is always believed: its order
/// is the publisher's, whose stamps may repeat, be missing or go back.
#[derive(Debug, Default)]
pub(super) struct Echoes {
    last: Option<Used>,
}

impl Echoes {
    /// Whether a message that came to an inbox at a moment is used.
    pub(super) fn is_used(&mut self, inbox: usize, stamp_ns: i64, at: Instant) -> bool {
        let is_echo = self.last.is_some_and(|last| {
            let is_soon = at.saturating_duration_since(last.at) < MAX_DELAY;
            inbox != last.inbox && stamp_ns <= last.stamp_ns && is_soon
        });
        if !is_echo {
            self.last = Some(Used { inbox, stamp_ns, at });
        }
        !is_echo
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of the messages, as inbox, stamp and milliseconds of arrival, are used.
    fn used(messages: &[(usize, i64, u64)]) -> Vec<bool> {
        let (mut echoes, start) = (Echoes::default(), Instant::now());
        messages.iter().map(|&(inbox, ns, ms)| echoes.is_used(inbox, ns, start + Duration::from_millis(ms))).collect()
    }

    #[test]
    fn a_message_in_both_inboxes_is_used_once() {
        assert_eq!(
            used(&[(0, 5, 0), (1, 5, 1), (1, 6, 100), (0, 6, 101), (0, 7, 200)]),
            [true, false, true, false, true]
        );
        assert_eq!(used(&[(0, 5, 0), (1, 5, 1), (0, 5, 9_000), (1, 5, 9_001)]), [true, false, true, false]);
    }

    #[test]
    fn a_publisher_that_repeats_its_stamp_is_heard() {
        for stamp in [0, 5] {
            assert_eq!(used(&[(1, stamp, 0), (1, stamp, 10), (1, stamp, 2_000)]), [true; 3], "one inbox");
            let both =
                [(0, stamp, 0), (1, stamp, 1), (0, stamp, 100), (1, stamp, 101), (1, stamp, 200), (0, stamp, 201)];
            assert_eq!(used(&both), [true, false, true, false, false, true]);
        }
    }

    #[test]
    fn an_older_message_never_follows_from_the_other_inbox() {
        assert_eq!(used(&[(0, 7, 100), (1, 6, 90), (1, 7, 101), (1, 8, 200)]), [true, false, false, true]);
        assert_eq!(
            used(&[(0, 7, 0), (0, 2, 100), (1, 2, 101)]),
            [true, true, false],
            "the publisher's clock went back"
        );
    }

    #[test]
    fn the_other_inbox_is_heard_once_the_first_is_silent() {
        // A publisher that keeps its last message ends, and one that does not begins, with an earlier clock.
        assert_eq!(used(&[(0, 9, 0), (1, 3, 2_000), (1, 4, 2_100), (0, 9, 2_150)]), [true, true, true, true]);
        assert_eq!(used(&[(0, 9, 0), (1, 9, 2_000)]), [true, true], "a repeated stamp");
    }
}
