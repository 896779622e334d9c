//! Mission time of a process.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A monotonic clock that may run faster than wall time, for rehearsals.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    began: std::time::Instant,
    scale: f64,
}

impl Clock {
    /// A clock at zero that runs `scale` times as fast as wall time.
    pub fn new(scale: f64) -> Self {
        Self { began: std::time::Instant::now(), scale }
    }

    pub fn now(&self) -> Instant {
        Instant::from_secs_f64(self.began.elapsed().as_secs_f64() * self.scale)
    }

    /// The wall time of a mission time.
    pub fn wall(&self, at: Instant) -> tokio::time::Instant {
        tokio::time::Instant::from_std(self.began + Duration::from_secs_f64(at.as_secs_f64() / self.scale))
    }
}
