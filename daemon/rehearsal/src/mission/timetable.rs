//! The clock of a mission and its regular events.

use scenecast_config::Config;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Seconds between two steps of the vehicle's motion.
pub(super) const STEP_S: f64 = 0.5;
const COMPARE_INTERVAL: Duration = Duration::from_secs(1);

/// The mission time, and the next time of each regular event.
#[derive(Debug, Clone, Copy)]
pub(super) struct Timetable {
    pub(super) now: Instant,
    pub(super) ended: Option<Instant>,
    pub(super) frame: Instant,
    step: Instant,
    look: Instant,
    fix: Instant,
    /// `None` for a mission without fixes.
    fix_interval: Option<Duration>,
}

impl Timetable {
    pub(super) fn new(config: &Config, now: Instant) -> Self {
        let period_s = config.navigation.fix_period_s;
        let fix_interval = (period_s > 0.0).then(|| Duration::from_secs_f64(period_s));
        Self { now, ended: None, frame: now, step: now, look: now, fix: Instant::from_secs_f64(period_s), fix_interval }
    }

    pub(super) fn next_event(&self) -> Instant {
        let fix = self.fix_interval.map(|_| self.fix);
        [self.look, self.step, self.frame].into_iter().chain(fix).min().unwrap_or(self.look)
    }

    /// Whether a step of the motion is due; if so, it schedules the next one, as the two methods below do.
    pub(super) fn takes_step(&mut self) -> bool {
        let is_due = self.now >= self.step;
        if is_due {
            self.step = self.step + Duration::from_secs_f64(STEP_S);
        }
        is_due
    }

    pub(super) fn takes_fix(&mut self) -> bool {
        let Some(interval) = self.fix_interval.filter(|_| self.now >= self.fix) else { return false };
        self.fix = self.fix + interval;
        true
    }

    pub(super) fn takes_look(&mut self) -> bool {
        let is_due = self.now >= self.look;
        if is_due {
            self.look = self.look + COMPARE_INTERVAL;
        }
        is_due
    }
}
