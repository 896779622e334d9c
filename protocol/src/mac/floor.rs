//! Whether an end may speak now.

use super::{Access, Grant, ModemProfile};
use crate::time::Instant;

/// A vehicle's right to speak, and what it has in its modem.
#[derive(Debug, Clone, Default)]
pub struct Floor {
    grant: Option<Grant>,
    /// Frames that the modem has asked for and not got.
    polled: u32,
    /// Frames handed to the modem that have not left it.
    in_modem: u32,
}

impl Floor {
    /// The surface grants a turn, or takes it back.
    pub fn handle_grant(&mut self, grant: Option<Grant>) {
        self.grant = grant;
    }

    /// The modem asks for `frames` frames now.
    pub fn handle_poll(&mut self, frames: u32) {
        self.polled = frames;
    }

    /// Frames handed to the modem that have not left it.
    pub fn in_modem(&self) -> u32 {
        self.in_modem
    }

    /// A frame has left the modem.
    pub fn handle_sent(&mut self) {
        self.in_modem = self.in_modem.saturating_sub(1);
    }

    /// Frames that may be handed to the modem now, one by one.
    pub fn frames(&self, profile: &ModemProfile, now: Instant) -> u32 {
        match profile.access {
            Access::Shared if self.in_modem > 0 => 0,
            Access::Shared => self.grant.filter(|g| now >= g.begins).map_or(0, |g| g.frames_left(profile, now)),
            Access::ModemOwned { pool_frames } => pool_frames.saturating_sub(self.in_modem),
            Access::Polled => self.polled,
        }
    }

    /// Whether a turn is open in which nothing can be said any more: too little of it is left.
    pub fn is_over(&self, profile: &ModemProfile, now: Instant) -> bool {
        self.in_modem == 0 && self.grant.is_some_and(|g| now >= g.begins) && self.frames(profile, now) == 0
    }

    /// A frame was handed to the modem; after the `last` one the turn is over.
    pub fn spend(&mut self, last: bool) {
        self.in_modem += 1;
        self.polled = if last { 0 } else { self.polled.saturating_sub(1) };
        if last {
            self.grant = None;
        }
    }

    /// Nothing more is said in this turn.
    pub fn give_up(&mut self) {
        (self.grant, self.polled) = (None, 0);
    }

    /// When a granted turn begins, unless a frame is in the modem.
    pub fn next_wakeup(&self) -> Option<Instant> {
        self.grant.filter(|_| self.in_modem == 0).map(|g| g.begins)
    }
}
