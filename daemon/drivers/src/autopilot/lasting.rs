//! What is wrong with the reports of an autopilot for a while.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Time between two notes of the same trouble.
const NOTE_PERIOD: Duration = Duration::from_secs(60);

/// Since when something is missing or cannot be, and what people were told.
#[derive(Debug, Default)]
pub(super) struct Lasting {
    /// `None` while all is well.
    since: Option<Instant>,
    /// Whether people were told of it since.
    is_told: bool,
    /// When people were told last.
    told: Option<Instant>,
}

impl Lasting {
    /// All is well. Returns whether people were told that it was not.
    pub(super) fn end(&mut self) -> bool {
        self.since = None;
        std::mem::take(&mut self.is_told)
    }

    /// It goes on; returns whether people should know now: once, as soon as it has lasted for `after`, and at most once a minute.
    pub(super) fn is_news(&mut self, after: Duration, now: Instant) -> bool {
        let since = *self.since.get_or_insert(now);
        let is_recent = self.told.is_some_and(|at| now.since(at) < NOTE_PERIOD);
        if self.is_told || is_recent || now.since(since) < after {
            return false;
        }
        (self.is_told, self.told) = (true, Some(now));
        true
    }
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
