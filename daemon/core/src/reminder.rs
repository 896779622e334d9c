//! How often people are told of something that happens again and again.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Tells of an event at once, then after pauses that double from one minute to [`Reminder::LONGEST`]; after such a time of calm,
/// at once again.
#[derive(Debug, Default)]
pub struct Reminder {
    /// When people were told last, and for how long they are not told again.
    told: Option<(Instant, Duration)>,
    /// When the last event came, whether or not it was reported.
    last: Option<Instant>,
    /// Events since people were told.
    untold: u32,
}

impl Reminder {
    const FIRST: Duration = Duration::from_secs(60);
    /// The longest pause between two notes of events that go on.
    pub const LONGEST: Duration = Duration::from_secs(16 * 60);

    /// Takes an event. Where people should know, returns the number of events since they were told last, this one included.
    pub fn handle(&mut self, now: Instant) -> Option<u32> {
        let is_calm = self.last.replace(now).is_none_or(|last| now.since(last) >= Self::LONGEST);
        if is_calm {
            self.told = None;
        }
        self.untold = self.untold.saturating_add(1);
        let pause = match self.told {
            Some((at, pause)) if now.since(at) < pause => return None,
            Some((_, pause)) => (pause * 2).min(Self::LONGEST),
            None => Self::FIRST,
        };
        self.told = Some((now, pause));
        Some(std::mem::take(&mut self.untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_is_told_ever_more_rarely_what_returns_at_once() {
        let mut reminder = Reminder::default();
        let mut tell = |s: u32| reminder.handle(Instant::from_secs_f64(f64::from(s)));
        let told: Vec<(u32, u32)> =
            (0..3600).step_by(10).filter_map(|s| tell(s).map(|count| (s / 60, count))).collect();
        assert_eq!(told, [(0, 1), (1, 6), (3, 12), (7, 24), (15, 48), (31, 96), (47, 96)]);
        assert_eq!((tell(3600), tell(3780)), (None, Some(79)));
        assert_eq!(tell(3780 + 960), Some(1), "after a calm");
        assert_eq!(tell(3780 + 960 + 60), Some(1));
    }
}
