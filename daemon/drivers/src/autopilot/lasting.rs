//! What is wrong with the reports of an autopilot for a while.

use scenecast_core::Reminder;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Since when something is missing or cannot be, and what people were told.
#[derive(Debug, Default)]
pub(super) struct Lasting {
    /// `None` while all is well.
    since: Option<Instant>,
    /// Whether people were told of it since.
    is_told: bool,
    notes: Reminder,
}

impl Lasting {
    /// All is well. Returns whether people were told that it was not.
    pub(super) fn end(&mut self) -> bool {
        self.since = None;
        std::mem::take(&mut self.is_told)
    }

    /// It goes on; returns whether people should know now: once, as soon as it has lasted for `after`, and ever more
    /// rarely if it comes again and again.
    pub(super) fn is_news(&mut self, after: Duration, now: Instant) -> bool {
        let since = *self.since.get_or_insert(now);
        if self.is_told || now.since(since) < after {
            return false;
        }
        self.is_told = self.notes.handle(now).is_some();
        self.is_told
    }
}

/// What people should read where an autopilot was never heard.
pub(super) fn absence_text(awaited: &str, after: Duration) -> String {
    format!(
        "no {awaited} has come in {} s: check that the autopilot is on and sends to this end (autopilot.port)",
        after.as_secs()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trouble_is_named_once_and_one_that_flickers_once_a_minute() {
        let told = |is_there: fn(u32) -> bool| {
            let mut trouble = Lasting::default();
            let second = |s: u32| {
                if is_there(s) {
                    trouble.end();
                    return false;
                }
                trouble.is_news(Duration::from_secs(3), Instant::from_secs_f64(f64::from(s)))
            };
            (0..100).map(second).enumerate().filter(|(_, is_told)| *is_told).map(|(s, _)| s).collect::<Vec<_>>()
        };
        assert_eq!(told(|_| false), [3]);
        assert_eq!(told(|s| s % 10 == 0), [4, 64]);
    }
}
