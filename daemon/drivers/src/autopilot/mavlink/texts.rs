//! Texts of the autopilot for people, which it may repeat without end.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// The last texts that were passed on.
#[derive(Debug, Default)]
pub(super) struct Texts {
    told: Vec<(String, Instant)>,
}

impl Texts {
    /// The same text is passed on once in this time, and so many different ones.
    const PERIOD: Duration = Duration::from_secs(600);
    const MAX: usize = 20;

    /// Whether a text is to be passed on.
    pub(super) fn is_news(&mut self, text: &str, now: Instant) -> bool {
        self.told.retain(|(_, at)| now.since(*at) < Self::PERIOD);
        let is_news = self.told.len() < Self::MAX && self.told.iter().all(|(told, _)| told != text);
        if is_news {
            self.told.push((text.to_owned(), now));
        }
        is_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_of_warnings_is_logged_in_few_lines() {
        let mut texts = Texts::default();
        let told = |s: &u32| {
            texts.is_news(["PreArm: no GPS", "EKF variance"][(s % 2) as usize], Instant::from_secs_f64(f64::from(*s)))
        };
        assert_eq!((0..3600).filter(told).count(), 12);
        let all_different = |n: &u32| texts.is_news(&n.to_string(), Instant::from_secs_f64(5000.0));
        assert_eq!((0..1000).filter(all_different).count(), 20);
    }
}
