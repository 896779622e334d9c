//! Checks that the modem still has the configuration of its setup, and reports refused commands.

use super::config::S2cConfig;
use super::setup::{self, Step};
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Interval between two queries of a modem at work.
const BEAT_INTERVAL: Duration = Duration::from_secs(2);
/// After this silence the port is opened again.
const DEAF_TIMEOUT: Duration = Duration::from_secs(15);

/// The state of the modem as far as its replies show it.
#[derive(Debug, Default)]
pub(super) struct Supervision {
    beat_at: Instant,
    beats: usize,
    /// The modem's packet counter, once it was read.
    counter: Option<u32>,
    last_reply: Instant,
    opened: Instant,
    /// Whether the modem has ever been at work.
    was_ready: bool,
    /// The step of the start-up that failed last.
    failed: Option<Step>,
    refusal: Option<String>,
}

impl Supervision {
    pub(super) fn open(&mut self, now: Instant) {
        (self.opened, self.last_reply) = (now, now);
    }

    pub(super) fn note_reply(&mut self, now: Instant) {
        self.last_reply = now;
    }

    pub(super) fn is_deaf(&self, now: Instant) -> bool {
        now.since(self.last_reply.max(self.opened)) >= DEAF_TIMEOUT
    }

    /// The step of the start-up at `index`; `None` behind the last one.
    pub(super) fn start_up(&self, config: &S2cConfig, index: usize) -> Option<Step> {
        setup::start_up(config, !self.was_ready).into_iter().nth(index)
    }

    pub(super) fn set_ready(&mut self, now: Instant) {
        self.was_ready = true;
        (self.refusal, self.failed) = (None, None);
        self.beat_at = now + BEAT_INTERVAL;
    }

    pub(super) fn beat_at(&self) -> Instant {
        self.beat_at
    }

    /// The next query of a modem at work, once it is due.
    pub(super) fn next_beat(&mut self, config: &S2cConfig, now: Instant) -> Option<Step> {
        if now < self.beat_at {
            return None;
        }
        self.beat_at = now + BEAT_INTERVAL;
        self.beats += 1;
        Some(setup::beat(config, self.beats))
    }

    pub(super) fn counter(&self) -> Option<u32> {
        self.counter
    }

    pub(super) fn set_counter(&mut self, counter: Option<u32>) {
        self.counter = counter;
    }

    /// Whether this step failed twice in a row: once may be the reply to another command.
    pub(super) fn fails_again(&mut self, step: &Step) -> bool {
        self.failed.replace(step.clone()).as_ref() == Some(step)
    }

    /// The text, if it was not the last one reported.
    pub(super) fn refuse(&mut self, text: String) -> Option<String> {
        if self.refusal.as_ref() == Some(&text) {
            return None;
        }
        self.refusal = Some(text.clone());
        Some(text)
    }
}
