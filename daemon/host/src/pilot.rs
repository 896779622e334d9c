//! An autopilot in a host.

use scenecast_drivers::autopilot::{Autopilot, Health};
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;

/// An event of an autopilot, for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PilotEvent {
    /// A line that a person should read.
    Note(String),
    Health {
        health: Health,
        /// The counters so far, as one line.
        counters: String,
    },
}

/// An autopilot and its events.
pub(crate) struct Pilot {
    pub(crate) autopilot: Box<dyn Autopilot>,
    health: Health,
    events: VecDeque<PilotEvent>,
}

impl Pilot {
    pub(crate) fn new(autopilot: Box<dyn Autopilot>, now: Instant) -> Self {
        let health = autopilot.health(now);
        Self { autopilot, health, events: VecDeque::new() }
    }

    /// Calls the autopilot's timeout if it is due; returns whether it was.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> bool {
        let is_due = self.autopilot.poll_timeout() <= now;
        if is_due {
            self.autopilot.handle_timeout(now);
            self.collect(now);
        }
        is_due
    }

    pub(crate) fn handle_open(&mut self, now: Instant) {
        self.autopilot.handle_open(now);
        self.collect(now);
    }

    pub(crate) fn handle_bytes(&mut self, bytes: &[u8], now: Instant) {
        self.autopilot.handle_bytes(bytes, now);
        self.collect(now);
    }

    /// As of its last message or timeout.
    pub(crate) fn health(&self) -> Health {
        self.health
    }

    pub(crate) fn poll_event(&mut self) -> Option<PilotEvent> {
        self.events.pop_front()
    }

    fn collect(&mut self, now: Instant) {
        while let Some(note) = self.autopilot.poll_note() {
            self.events.push_back(PilotEvent::Note(note));
        }
        let health = self.autopilot.health(now);
        if std::mem::replace(&mut self.health, health) != health {
            self.events.push_back(PilotEvent::Health { health, counters: self.counters() });
        }
    }

    fn counters(&self) -> String {
        let counters = self.autopilot.counters();
        let all: Vec<String> = counters.iter().map(|(name, n)| format!("{name} {n}")).collect();
        if all.is_empty() { "none yet".to_owned() } else { all.join(", ") }
    }
}
