//! Mission time of a process.

use scenecast_protocol::time::Instant;

/// A monotonic clock that may run faster than wall time, for rehearsals.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    began: std::time::Instant,
    /// The mission time at `began`.
    start: Instant,
    scale: f64,
}

impl Clock {
    /// A clock at zero that runs `scale` times as fast as wall time.
    pub fn new(scale: f64) -> Self {
        Self::starting_at(Instant::ZERO, scale)
    }

    /// A clock that now shows `start`.
    pub fn starting_at(start: Instant, scale: f64) -> Self {
        Self { began: std::time::Instant::now(), start, scale }
    }

    pub fn now(&self) -> Instant {
        self.start + self.began.elapsed().mul_f64(self.scale)
    }

    /// Mission time for each unit of wall time.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The mission time of a moment; `None` before the clock began.
    pub fn at(&self, moment: std::time::Instant) -> Option<Instant> {
        Some(self.start + moment.checked_duration_since(self.began)?.mul_f64(self.scale))
    }

    /// The wall time of a mission time.
    pub fn wall(&self, at: Instant) -> tokio::time::Instant {
        tokio::time::Instant::from_std(self.began + at.since(self.start).div_f64(self.scale))
    }
}
