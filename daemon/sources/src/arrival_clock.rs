//! The time at which images and poses come in.

use scenecast_sensors::Stamp;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Wall time at the start of the process plus the time since then, so that it never goes back.
#[derive(Debug, Clone, Copy)]
pub struct ArrivalClock {
    start: Stamp,
    began: Instant,
}

impl ArrivalClock {
    /// A clock that shows the wall time now.
    pub fn start() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { start: Stamp::from_nanos(0).after(since_epoch), began: Instant::now() }
    }

    pub fn now(&self) -> Stamp {
        self.start.after(self.began.elapsed())
    }

    /// The moment at which the clock shows `stamp`.
    pub fn instant(&self, stamp: Stamp) -> Instant {
        self.began + std::time::Duration::from_secs_f64(stamp.seconds_since(self.start).clamp(0.0, 1e9))
    }
}
