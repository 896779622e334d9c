//! Something that an autopilot should report and does not.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Time between two notes of the same absence.
const NOTE_PERIOD: Duration = Duration::from_secs(60);

/// Since when it is missing, and what people were told.
#[derive(Debug, Default)]
pub(super) struct Absence {
    /// `None` while it is there.
    since: Option<Instant>,
    /// Whether people were told of this absence.
    is_told: bool,
    /// When people were told last.
    told: Option<Instant>,
}

impl Absence {
    /// It is there.
    pub(super) fn end(&mut self) {
        (self.since, self.is_told) = (None, false);
    }

    /// It is missing; returns whether people should know now: once, as soon as it has been missing for `after`, and at most once a
    /// minute.
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
    fn an_absence_is_named_once_and_a_flickering_one_once_a_minute() {
        let told = |is_there: fn(u32) -> bool| {
            let mut absence = Absence::default();
            let second = |s: u32| {
                if is_there(s) {
                    absence.end();
                    return false;
                }
                absence.is_news(Duration::from_secs(3), Instant::from_secs_f64(f64::from(s)))
            };
            (0..100).map(second).enumerate().filter(|(_, is_told)| *is_told).map(|(s, _)| s).collect::<Vec<_>>()
        };
        assert_eq!(told(|_| false), [3]);
        assert_eq!(told(|s| s % 10 == 0), [4, 64]);
    }
}
