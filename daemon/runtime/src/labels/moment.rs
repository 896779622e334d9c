//! When the picture of an item was taken.

use scenecast_labels::ItemTime;
use std::time::{Duration, Instant, SystemTime};

/// The moment of an item that arrived `at`; `None` if it is a mission time, or before this computer started, or unknown.
pub(super) fn moment(time: ItemTime, at: Option<Instant>, (now, clock): (Instant, SystemTime)) -> Option<Instant> {
    match time {
        ItemTime::Mission(_) | ItemTime::Arrival => at,
        ItemTime::Age(age_s) => at?.checked_sub(Duration::try_from_secs_f64(age_s).ok()?),
        ItemTime::Unix(unix_s) => {
            let time = SystemTime::UNIX_EPOCH.checked_add(Duration::try_from_secs_f64(unix_s).ok()?)?;
            match clock.duration_since(time) {
                Ok(ago) => now.checked_sub(ago),
                Err(ahead) => now.checked_add(ahead.duration()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_and_unix_times_become_moments() {
        let (now, unix) = (Instant::now(), Duration::from_secs(1_700_000_000));
        let clock = (now, SystemTime::UNIX_EPOCH + unix);
        let second = Duration::from_secs(1);
        let of = |time, at| moment(time, at, clock);
        assert_eq!(of(ItemTime::Unix(1_699_999_999.0), None), Some(now - second));
        assert_eq!(of(ItemTime::Unix(1_700_000_001.0), None), Some(now + second));
        assert_eq!(of(ItemTime::Age(1.0), Some(now)), Some(now - second));
        assert_eq!(of(ItemTime::Arrival, Some(now)), Some(now));
        assert_eq!((of(ItemTime::Age(1.0), None), of(ItemTime::Unix(1e11), None).is_some()), (None, true));
        assert_eq!(of(ItemTime::Unix(1.0), None), now.checked_sub(unix - second), "in an earlier run");
    }
}
