//! The window of received frames, and the sent frames whose fate is not known yet.

use super::FrameNumber;
use crate::wire::{AckForm, AckStatement, Horizon, MAX_WINDOW};
use std::collections::{BTreeMap, BTreeSet};

/// Why the window rejects a verified frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindowRefusal {
    /// The frame was accepted before.
    Duplicate,
    /// The frame comes after it was declared lost, or refers to a base that is gone.
    Late,
    /// The frame claims a base that we never acknowledged.
    NoBase,
}

/// The received frames of one run of the peer.
///
/// Invariants: `base <= closed <= highest`; a frame up to `closed` that is not in `held` is never accepted.
#[derive(Debug, Default)]
pub struct LinkWindow {
    base: FrameNumber,
    closed: FrameNumber,
    highest: FrameNumber,
    held: BTreeSet<FrameNumber>,
    unpersisted: BTreeSet<FrameNumber>,
}

impl LinkWindow {
    /// The last frame whose fate the sender is known to know.
    pub fn base(&self) -> FrameNumber {
        self.base
    }

    /// The highest frame number received, 0 before the first.
    pub fn highest(&self) -> FrameNumber {
        self.highest
    }

    /// Frame numbers after the last statement, up to the highest one received.
    pub fn unstated(&self) -> u64 {
        self.highest - self.closed
    }

    /// Whether no frame shows yet that the peer has received the last statement.
    pub fn is_unconfirmed(&self) -> bool {
        self.closed > self.base
    }

    /// The base of a frame that [`Self::accept`] would accept, or the reason for which it would reject it.
    pub fn preview(&self, number: FrameNumber, base_distance: u16) -> Result<FrameNumber, WindowRefusal> {
        let base = number.checked_sub(u64::from(base_distance)).ok_or(WindowRefusal::Late)?;
        if self.held.contains(&number) {
            return Err(WindowRefusal::Duplicate);
        }
        if number <= self.closed || base < self.base {
            return Err(WindowRefusal::Late);
        }
        if base > self.closed || number - self.base > 2 * MAX_WINDOW {
            return Err(WindowRefusal::NoBase);
        }
        Ok(base)
    }

    /// Accepts a frame, or returns the reason for which it is rejected.
    pub fn accept(&mut self, number: FrameNumber, base_distance: u16) -> Result<(), WindowRefusal> {
        self.base = self.preview(number, base_distance)?;
        let base = self.base;
        self.held = self.held.split_off(&(base + 1));
        self.held.insert(number);
        self.highest = self.highest.max(number);
        Ok(())
    }

    /// Bars frame `number` from acknowledgement until the host has made its content durable.
    pub fn hold_back(&mut self, number: FrameNumber) {
        self.unpersisted.insert(number);
    }

    /// Lifts the bar from every frame received so far.
    pub fn handle_persisted(&mut self) {
        self.unpersisted.clear();
    }

    /// The verdict on the received frames in at most `room` bytes, or in the turn byte of a vehicle's frame that `has_turn`; `None`
    /// if the sender knows all of it.
    ///
    /// A frame that the verdict declares lost is not accepted later.
    pub fn statement(&mut self, room: usize, has_turn: bool) -> Option<AckStatement> {
        let mut horizon = self.utmost();
        loop {
            let statement = self.verdict(horizon, has_turn)?;
            if statement.encode(room, &mut Vec::new()) {
                self.closed = self.closed.max(horizon);
                return Some(statement);
            }
            horizon = self.base + (horizon - self.base) * 3 / 4;
        }
    }

    /// Bytes of a statement on all received frames.
    pub fn statement_bytes(&self) -> usize {
        let mut bytes = Vec::new();
        if let Some(statement) = self.verdict(self.utmost(), false) {
            statement.encode(usize::MAX, &mut bytes);
        }
        bytes.len()
    }

    /// Whether a statement on all received frames, if there is one to make, fits the turn byte of a vehicle.
    pub fn fits_turn_byte(&self) -> bool {
        self.verdict(self.utmost(), true).is_none_or(|statement| matches!(statement.horizon, Horizon::InTurn(_)))
    }

    fn utmost(&self) -> FrameNumber {
        self.unpersisted.first().map_or(self.highest, |&n| n - 1)
    }

    fn verdict(&self, horizon: FrameNumber, has_turn: bool) -> Option<AckStatement> {
        if horizon <= self.base {
            return None;
        }
        let lost = (self.base + 1..=horizon).rev().filter(|n| !self.held.contains(n));
        let lost: Vec<u16> = lost.map(|n| (horizon - n) as u16).collect();
        // The sender's horizon is `base` at least, and at most what was stated before.
        let ahead = if horizon >= self.closed { horizon - self.base } else { u64::MAX };
        Some(AckStatement::new(horizon, lost, AckForm::shortest(ahead, has_turn)))
    }
}

/// Numbers the frames toward one peer, and keeps the content of each until the peer has reported its fate.
#[derive(Debug)]
pub struct Flight<T> {
    next: FrameNumber,
    horizon: FrameNumber,
    /// The peer's highest frame with a statement.
    stated: FrameNumber,
    frames: BTreeMap<FrameNumber, T>,
}

impl<T> Default for Flight<T> {
    fn default() -> Self {
        Self { next: 1, horizon: 0, stated: 0, frames: BTreeMap::new() }
    }
}

impl<T> Flight<T> {
    /// The number of the next frame; the first is 1.
    pub fn next_number(&self) -> FrameNumber {
        self.next
    }

    /// The next frame's number minus the horizon, as the header's `base` field states it.
    pub fn base_distance(&self) -> u16 {
        (self.next - self.horizon).min(MAX_WINDOW) as u16
    }

    /// Whether the peer must answer first, because a further number could be mistaken for an old one.
    pub fn is_full(&self) -> bool {
        // A turn that has begun is completed.
        const TURN: u64 = 64;
        self.next - self.horizon >= MAX_WINDOW - TURN
    }

    /// The last frame whose fate is known.
    pub fn horizon(&self) -> FrameNumber {
        self.horizon
    }

    /// Numbers the next frame, which carries `content`.
    pub fn push(&mut self, content: T) {
        self.frames.insert(self.next, content);
        self.next += 1;
    }

    /// Takes the peer's verdict in its frame `number`; `None` if the window refuses that frame. Returns the content of newly judged
    /// frames in the order of their numbers, and whether each arrived.
    pub fn handle_statement(&mut self, statement: &AckStatement, number: Option<FrameNumber>) -> Vec<(T, bool)> {
        // The few bits of a near horizon are unambiguous in the order of the frames alone.
        let is_latest = number.is_some_and(|number| number > self.stated);
        if !matches!(statement.horizon, Horizon::Far(_)) && !is_latest {
            return Vec::new();
        }
        self.stated = self.stated.max(number.unwrap_or(0));
        let ahead = statement.horizon.ahead_of(self.horizon);
        let horizon = self.horizon + ahead;
        if ahead == 0 || horizon >= self.next {
            return Vec::new();
        }
        let later = self.frames.split_off(&(horizon + 1));
        let judged = std::mem::replace(&mut self.frames, later);
        self.horizon = horizon;
        let lost = |number: u64| statement.lost.binary_search(&((horizon - number) as u16)).is_ok();
        judged.into_iter().map(|(number, content)| (content, !lost(number))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Address, Header};
    use proptest::prelude::*;

    proptest! {
        /// Both ends agree forever on the fate of each frame up to the sender's horizon.
        #[test]
        fn sender_and_receiver_agree_on_every_fate(
            events in proptest::collection::vec((0u8..10, 0usize..40, 1usize..20), 1..400),
        ) {
            let mut flight = Flight::<u64>::default();
            let mut window = LinkWindow::default();
            let mut channel: Vec<(u64, u16)> = Vec::new();
            let mut taken = BTreeSet::new();
            let mut fates = Vec::new();
            let mut statements: Vec<(u64, AckStatement)> = Vec::new();
            let mut stated = 0;
            for (what, pick, room) in events {
                match what {
                    0..5 if !flight.is_full() => {
                        channel.push((flight.next_number(), flight.base_distance()));
                        flight.push(flight.next_number());
                    }
                    5..8 if !channel.is_empty() => {
                        let (number, distance) = channel.remove(pick % channel.len());
                        if window.accept(number, distance).is_ok() {
                            prop_assert!(taken.insert(number), "frame {} taken twice", number);
                        }
                    }
                    _ => {
                        stated += 1;
                        statements.extend(window.statement(room, pick % 2 == 0).map(|s| (stated, s)));
                        // Some are lost, some late, some come twice.
                        if let Some((number, s)) = statements.get(pick % (statements.len() + 1)) {
                            fates.extend(flight.handle_statement(s, Some(*number)));
                        }
                    }
                }
            }
            for (number, delivered) in fates {
                prop_assert_eq!(taken.contains(&number), delivered, "frame {}", number);
            }
        }
    }

    /// The header of a frame, with as much of its number as is sent.
    fn header(number: u64, base: u16) -> Header {
        Header::numbered(Address::vehicle(1).unwrap(), Address::SURFACE, number, base)
    }

    #[test]
    fn both_ends_agree_across_every_wrap_of_the_counters() {
        let (mut flight, mut window) = (Flight::<u64>::default(), LinkWindow::default());
        let mut judged = 0;
        for i in 0..200_000u64 {
            let (number, distance) = (flight.next_number(), flight.base_distance());
            flight.push(number);
            let arrives = |number: u64| !number.is_multiple_of(7);
            if arrives(number) {
                assert_eq!(header(number, distance).number_near(window.highest()), number);
                assert_eq!(window.accept(number, distance), Ok(()));
            }
            if i % 300 == 0
                && let Some(statement) = window.statement(200, i % 600 == 0)
            {
                for (number, delivered) in flight.handle_statement(&statement, Some(i)) {
                    judged += 1;
                    assert_eq!(arrives(number), delivered, "frame {number}");
                }
            }
        }
        assert!(judged > 199_000, "{judged}");
    }

    #[test]
    fn undurable_frames_are_not_acknowledged() {
        let mut w = LinkWindow::default();
        w.accept(1, 1).unwrap();
        w.hold_back(1);
        assert_eq!(w.statement(10, false), None);
        w.handle_persisted();
        assert!(w.statement(10, false).is_some());
    }
}
