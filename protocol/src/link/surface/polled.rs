//! Turns where a cycle of the modem is the grant, as the cycle-init of a WHOI Micromodem is.

use super::SurfaceLink;
use crate::link::Transmit;
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::Address;
use std::time::Duration;

/// Time in which the modem has to ask for the frames of a cycle of ours.
const GIVE_UP: Duration = Duration::from_secs(30);

/// A cycle for the modem to begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Who sends.
    pub from: Address,
    /// Who receives.
    pub to: Address,
    /// Frames to be asked of the sender, at most.
    pub frames: u32,
}

/// Where the surface is between its own cycle and the vehicle's.
#[derive(Debug, Default)]
pub(super) struct Cycles {
    /// A cycle that the host is still to begin.
    wanted: Option<Cycle>,
    /// Frames that the modem has asked us for and not got.
    polled: u32,
    /// The vehicle whose cycle follows ours.
    answer_of: Option<Address>,
    /// When our last cycle was to begin.
    began: Instant,
}

impl Cycles {
    pub(super) fn handle_turn_sent(&mut self) {
        if let Some(from) = self.answer_of.take() {
            self.wanted = Some(Cycle { from, to: Address::SURFACE, frames: u32::from(u8::MAX) });
        }
    }
}

impl<R: StateReplica> SurfaceLink<R> {
    /// The cycle to begin next, if it is time for one ([`crate::mac::Access::Polled`]).
    pub fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        if let Some(cycle) = self.cycle.wanted.take() {
            return Some(cycle);
        }
        if !self.turn.is_empty() && self.in_modem.is_empty() && now.since(self.cycle.began) >= GIVE_UP {
            self.give_up_cycle(now);
        }
        if !self.in_modem.is_empty() || !self.turn.is_empty() || !self.begin_turn(now) {
            return None;
        }
        self.cycle.began = now;
        let to = self.turn.front()?.transmit.to;
        self.cycle.answer_of = to.is_vehicle().then_some(to);
        Some(Cycle { from: Address::SURFACE, to, frames: self.turn.len() as u32 })
    }

    /// The modem never asked for what our cycle was to carry.
    fn give_up_cycle(&mut self, now: Instant) {
        self.turn.clear();
        (self.cycle.polled, self.cycle.answer_of) = (0, None);
        if let Some(peer) = self.fleet.current_mut() {
            peer.master.postpone(now);
        }
    }

    /// When a cycle that the modem has not begun is given up.
    pub(super) fn cycle_gives_up_at(&self) -> Option<Instant> {
        (!self.turn.is_empty()).then(|| self.cycle.began + GIVE_UP)
    }

    /// The modem asks for `frames` frames of the surface's own cycle.
    pub fn handle_poll(&mut self, frames: u32) {
        self.cycle.polled = frames;
        // What does not fit the cycle is not said in it: the next one says what then is worth saying.
        while self.turn.len() > frames.max(1) as usize {
            self.turn.pop_back();
        }
    }

    pub(super) fn poll_polled(&mut self, now: Instant) -> Option<Transmit> {
        self.cycle.polled = self.cycle.polled.checked_sub(1)?;
        let ready = self.turn.pop_front()?;
        let last = self.turn.is_empty();
        if last {
            self.cycle.polled = 0;
        }
        Some(self.send(ready, last, now))
    }
}
