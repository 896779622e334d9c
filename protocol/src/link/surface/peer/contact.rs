//! When a vehicle was last in contact, its clock, and when it must be contacted without a turn.

use crate::link::FrameNumber;
use crate::mac::{Access, ModemProfile};
use crate::time::{ClockMap, Instant};
use crate::wire::Stamp;
use std::collections::VecDeque;
use std::time::Duration;

/// The silence over a modem that does half duplex by itself, and over a medium that carries both directions at once, where a
/// hello costs little.
const FULL_DUPLEX_SILENCE: Duration = Duration::from_secs(5);
const SILENCE_TIMEOUT: Duration = Duration::from_secs(40);
/// The number of unanswered hellos after which the interval doubles: by then the vehicle is out of reach rather than unlucky.
const PROMPT_HELLOS: u32 = 5;
/// The time from one hello to the next while a vehicle is in contact: a second vehicle with its address speaks only after a hello.
const ROLL_CALL: Duration = Duration::from_secs(300);
/// Transmissions of an order without any frame of the vehicle after which it is sent a hello.
const UNACKNOWLEDGED_ORDERS: u32 = 2;

/// How long an acknowledgement waits for further frames, over a modem that does half duplex by itself.
const USUAL_ANSWER_WAIT: Duration = Duration::from_secs(2);
/// Over a medium that carries both directions at once, the time beside two round trips after which a slot goes out again.
const FULL_DUPLEX_REPEAT: Duration = Duration::from_millis(400);
/// There, the time in which a run is proven, longer than a vehicle takes hellos for copies of one.
const FULL_DUPLEX_PROOF: Duration = Duration::from_millis(1600);

/// The times in which answers follow, by the modem.
#[derive(Debug)]
pub(super) struct AnswerPace {
    /// Whether both directions are on the air at once, so that answers are prompt.
    pub(super) is_full_duplex: bool,
    /// How long an acknowledgement waits for further frames, without turns.
    pub(super) answer_wait: Duration,
}

impl Default for AnswerPace {
    fn default() -> Self {
        Self { is_full_duplex: false, answer_wait: USUAL_ANSWER_WAIT }
    }
}

impl AnswerPace {
    pub(super) fn of(modem: &ModemProfile) -> Self {
        let is_full_duplex = modem.access == Access::FullDuplex;
        Self { is_full_duplex, answer_wait: modem.answer_wait(USUAL_ANSWER_WAIT) }
    }

    /// Time in which a vehicle that was met proves the run.
    pub(super) fn proof_timeout(&self) -> Duration {
        if self.is_full_duplex { FULL_DUPLEX_PROOF } else { Contact::PROOF_TIMEOUT }
    }

    /// Time after which a slot that was not acknowledged goes out again.
    pub(super) fn slot_timeout(&self, round_trip: Option<Duration>) -> Duration {
        match self.is_full_duplex {
            true => round_trip.unwrap_or(Duration::from_millis(300)) * 2 + FULL_DUPLEX_REPEAT,
            false => round_trip.unwrap_or(Duration::from_secs(4)) * 2 + Duration::from_secs(4),
        }
    }
}

/// When the vehicle was last in contact, and when it must be contacted without a turn.
#[derive(Debug)]
pub(super) struct Contact {
    pub(super) last_received: Option<Instant>,
    /// Silence after which a vehicle is sent a hello, because it may have restarted.
    silence: Duration,
    /// Where the modem decides when to transmit: when an order first went out after that.
    pub(super) ordered: Option<Instant>,
    /// Where the modem decides when to transmit: when an acknowledgement or a hello is due.
    pub(super) answer_due: Option<Instant>,
    /// Where the modem decides when to transmit: how often the acknowledgement still goes out, and when next, unless a frame
    /// confirms it before.
    pub(super) answers_left: u32,
    pub(super) repeat_due: Option<Instant>,
    /// The vehicle's highest frame number when a frame with an acknowledgement was last written.
    pub(super) acknowledged: FrameNumber,
    pub(super) hello_due: Instant,
    /// When a hello goes out even to a vehicle that is in contact.
    roll_call: Instant,
    /// When the last proof was written.
    pub(super) proved: Option<Instant>,
    /// When a hello last counted as an answer.
    pub(super) hello_admitted: Option<Instant>,
    /// When the budget allows the next proof.
    pub(super) proof_allowed: Instant,
    /// Hellos since the last answer.
    pub(super) hellos: u32,
    /// Dropped frames up to the last hello.
    pub(super) dropped: u64,
    /// No frame of the current run has come in since the last turn in it.
    pub(super) is_doubtful: bool,
}

impl Contact {
    /// Time in which a vehicle that was met proves the run by a numbered frame; after it, it is sent a hello again.
    pub(super) const PROOF_TIMEOUT: Duration = Duration::from_secs(5);

    pub(super) fn new(now: Instant) -> Self {
        Self {
            last_received: None,
            silence: SILENCE_TIMEOUT,
            ordered: None,
            answer_due: None,
            answers_left: 0,
            repeat_due: None,
            acknowledged: 0,
            hello_due: now,
            roll_call: now + ROLL_CALL,
            proved: None,
            hello_admitted: None,
            proof_allowed: now,
            hellos: 0,
            dropped: 0,
            is_doubtful: false,
        }
    }

    /// Sends hellos soon where both directions are on the air at once.
    pub(super) fn expect_prompt_answers(&mut self) {
        self.silence = FULL_DUPLEX_SILENCE;
    }

    /// Whether a hello counts as an answer: the first one of a run of this end, and otherwise one in five seconds,
    /// because the others may be replays.
    pub(super) fn admit_hello(&mut self, is_first: bool, now: Instant) -> bool {
        let is_admitted = is_first || self.hello_admitted.is_none_or(|at| now.since(at) >= Self::PROOF_TIMEOUT);
        if is_admitted {
            self.hello_admitted = Some(now);
        }
        is_admitted
    }

    pub(super) fn last_received(&self) -> Option<Instant> {
        self.last_received
    }

    pub(super) fn is_silent_for(&self, time: Duration, now: Instant) -> bool {
        self.last_received.is_none_or(|at| now.since(at) >= time)
    }

    /// When a vehicle that was heard is sent a hello: it has been silent for so long that it may have restarted, an order that
    /// nobody acknowledges shows so before, or the roll is called. `slot_timeout` is the time after which an order goes out again.
    pub(super) fn doubtful_from(&self, slot_timeout: Duration) -> Option<Instant> {
        let silent = self.last_received? + self.silence;
        let unacknowledged = self.ordered.map(|at| at + slot_timeout * UNACKNOWLEDGED_ORDERS);
        unacknowledged.into_iter().chain([silent, self.roll_call]).min()
    }

    pub(super) fn is_answer_due(&self, now: Instant) -> bool {
        self.answer_due.is_some_and(|at| now >= at)
    }

    /// When a hello becomes due if no frame comes in. Silence matters only in a run that is usable: the vehicle has
    /// proven it, and there are numbers left.
    pub(super) fn next_hello(&self, is_usable: bool, slot_timeout: Duration) -> Instant {
        let doubtful = self.doubtful_from(slot_timeout).filter(|_| is_usable);
        doubtful.map_or(self.hello_due, |at| at.max(self.hello_due))
    }

    /// A hello went out after `dropped` frames in all; the interval to the next one doubles once the vehicle has left
    /// several unanswered and not even a frame came in that could not be used.
    pub(super) fn note_hello(&mut self, timeout: Duration, dropped: u64, now: Instant) {
        let is_silent = std::mem::replace(&mut self.dropped, dropped) == dropped;
        self.hellos = if is_silent { self.hellos.saturating_add(1) } else { 1 };
        self.roll_call = now + ROLL_CALL;
        self.hello_due = now + timeout * if self.hellos < PROMPT_HELLOS { 1 } else { 2 };
    }
}

/// Timing of a vehicle as seen by the surface.
#[derive(Debug, Default)]
pub(super) struct VehicleTiming {
    clock: Option<ClockMap>,
    /// When frames left the modem, by number; a stamp of the vehicle refers to one of them.
    sent: VecDeque<(FrameNumber, Instant)>,
}

impl VehicleTiming {
    const MAX_SENT: usize = 64;

    pub(super) fn clock(&self) -> Option<&ClockMap> {
        self.clock.as_ref()
    }

    pub(super) fn handle_sent(&mut self, number: FrameNumber, now: Instant) {
        self.sent.push_back((number, now));
        if self.sent.len() > Self::MAX_SENT {
            self.sent.pop_front();
        }
    }

    /// The two-way propagation time, from a frame that began at `began` and whose stamp names the low byte of our
    /// frame `last_received`, received `held` before.
    pub(super) fn round_trip(&self, last_received: u8, held: Duration, began: Instant) -> Option<Duration> {
        let sent = self.sent.iter().rev().find(|(number, _)| *number as u8 == last_received).map(|(_, at)| *at)?;
        let is_exact = held < Stamp::MAX_HELD;
        (is_exact && sent + held <= began).then(|| began.since(sent).saturating_sub(held))
    }

    /// Takes the vehicle's clock reading at the start of a transmission that began `ago` before `now`.
    pub(super) fn measure(&mut self, clock_ms: u32, ago: Duration, now: Instant) {
        self.clock.get_or_insert_default().measure(clock_ms, ago, now);
    }
}
