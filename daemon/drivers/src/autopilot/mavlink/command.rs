//! Whether this end may take command of the autopilot: at first, and after a restart under water.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Messages of one run of the autopilot may be this much out of order, milliseconds.
const CLOCKS_APART_MS: u32 = 1000;
/// Uncertainty of the time at which it restarted.
const RESTART_MARGIN: Duration = Duration::from_secs(1);
/// Depth below which an autopilot that has restarted is armed again, metres.
const MIN_ARMED_DEPTH_M: f64 = 0.5;

/// The autopilot's runs, and when it was in command.
#[derive(Debug, Default)]
pub(super) struct CommandWatch {
    /// Whether it was in command once: from then on whoever takes it out of that is obeyed.
    was_in_command: bool,
    /// When it was taken out of command last.
    left: Option<Instant>,
    /// Milliseconds since its start, by its last message.
    time_boot_ms: Option<u32>,
    /// When it started again, until it is in command again.
    restarted: Option<Instant>,
    /// Whether it was under water when it started again.
    was_under_water: bool,
}

impl CommandWatch {
    /// Takes a time since the autopilot's start; returns whether it has restarted, since its clock went back. `depth_m` is the
    /// last reported depth.
    pub(super) fn handle_boot_time(&mut self, ms: u32, depth_m: Option<f64>, now: Instant) -> bool {
        let before = self.time_boot_ms.replace(ms);
        let is_restarted = before.is_some_and(|before| before > ms.saturating_add(CLOCKS_APART_MS));
        if is_restarted {
            self.restarted = Some(now - Duration::from_millis(u64::from(ms)));
            self.was_under_water = depth_m.is_some_and(|depth_m| depth_m > MIN_ARMED_DEPTH_M);
        }
        is_restarted
    }

    /// Takes whether it is in command; returns whether it no longer is.
    pub(super) fn handle_heartbeat(&mut self, before: bool, is_in_command: bool, now: Instant) -> bool {
        if is_in_command {
            (self.was_in_command, self.restarted) = (true, None);
        }
        let has_left = before && !is_in_command;
        if has_left {
            self.left = Some(now);
        }
        has_left
    }

    /// Whether it may be armed and switched to guided mode: it never was, or nobody but its own restart has ended that, and it
    /// was under water. On deck, its thrusters must not start by themselves.
    pub(super) fn may_be_armed(&self) -> bool {
        let ended = self.left.zip(self.restarted);
        let is_out_by_restart = ended.is_some_and(|(left, restarted)| left + RESTART_MARGIN >= restarted);
        !self.was_in_command || self.was_under_water && is_out_by_restart
    }
}
