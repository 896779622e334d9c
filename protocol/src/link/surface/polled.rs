//! Turns where a cycle of the modem is the grant, as with the cycle-init of a WHOI Micromodem.

use super::SurfaceLink;
use crate::link::Transmit;
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::Address;
use std::time::Duration;

/// The modem must request the frames of our cycle within this time.
const GIVE_UP: Duration = Duration::from_secs(30);

/// A cycle that the modem is to begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// The end that sends in this cycle.
    pub from: Address,
    /// The end that receives in this cycle.
    pub to: Address,
    /// The most frames that the modem should request.
    pub frames: u32,
}

/// The progress between the surface's own cycle and the vehicle's.
#[derive(Debug, Default)]
pub(super) struct Cycles {
    /// A cycle that the host must still begin.
    wanted: Option<Cycle>,
    /// Frames that the modem has requested and not received yet.
    polled: u32,
    /// The vehicle whose cycle follows ours.
    answer_of: Option<Address>,
    /// When our last cycle was due to begin.
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
    #[must_use]
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

    /// Gives up a cycle of which the modem has requested no frame.
    fn give_up_cycle(&mut self, now: Instant) {
        self.turn.clear();
        (self.cycle.polled, self.cycle.answer_of) = (0, None);
        if let Some(peer) = self.fleet.current_mut() {
            peer.master.postpone(now);
        }
    }

    /// When a cycle is given up that the modem has not begun.
    pub(super) fn cycle_gives_up_at(&self) -> Option<Instant> {
        (!self.turn.is_empty()).then(|| self.cycle.began + GIVE_UP)
    }

    /// The modem requests `frames` frames of the surface's own cycle.
    pub fn handle_poll(&mut self, frames: u32) {
        self.cycle.polled = frames;
        // Frames that do not fit into the cycle are dropped; the next cycle carries what is current by then.
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
