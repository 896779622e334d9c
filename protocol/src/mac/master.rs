//! The surface's side of the turns.

use super::{Access, ModemProfile, quarter_seconds};
use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// How the surface grants turns to one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MasterConfig {
    /// Longest one-way propagation delay to expect before a round trip was measured.
    pub max_propagation: Duration,
    /// Longest turn to grant.
    pub max_turn: Duration,
    /// Longest pause between turns while nothing is to be said.
    pub max_idle: Duration,
}

impl Default for MasterConfig {
    fn default() -> Self {
        Self {
            max_propagation: Duration::from_millis(2200),
            max_turn: Duration::from_secs(14),
            max_idle: Duration::from_secs(10),
        }
    }
}

/// What the medium is doing, as far as the surface knows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// Nobody speaks; the next grant goes out at the given time, with news from `ready` on.
    Idle { ready: Instant, next: Instant },
    /// The surface is on air.
    Speaking,
    /// The vehicle has the turn, and nothing was heard yet.
    Granted { granted: Instant, until: Instant },
    /// The vehicle is speaking.
    Listening { until: Instant },
}

/// Grants turns to one vehicle and recovers lost grants.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    state: State,
    /// Recent measurements of the two-way propagation; the least of them counts, for every error makes it look longer.
    round_trips: VecDeque<Duration>,
    unanswered: u32,
    granted_airtime: Duration,
    /// When the last turn was granted, and whether the vehicle had so much to say that it took most of it.
    granted: Option<Instant>,
    is_saturated: bool,
    begun: Option<Instant>,
}

impl Master {
    /// Measurements of the round trip that are kept.
    const ROUND_TRIPS: usize = 4;

    /// A master that may grant its first turn at `now`.
    pub fn new(config: MasterConfig, now: Instant) -> Self {
        Self {
            config,
            state: State::Idle { ready: now, next: now },
            round_trips: VecDeque::new(),
            unanswered: 0,
            granted_airtime: Duration::ZERO,
            granted: None,
            is_saturated: true,
            begun: None,
        }
    }

    /// Two-way propagation; `None` before the first measurement.
    pub fn round_trip(&self) -> Option<Duration> {
        self.round_trips.iter().min().copied()
    }

    /// Grants in a row that were not answered.
    pub fn unanswered(&self) -> u32 {
        self.unanswered
    }

    /// When the last turn began.
    pub fn begun(&self) -> Option<Instant> {
        self.begun
    }

    /// Whether the medium is taken by a turn of this vehicle or a grant to it.
    pub fn is_engaged(&self) -> bool {
        !matches!(self.state, State::Idle { .. })
    }

    /// Whether the surface may begin its turn at `now`; `news` ends an idle pause.
    pub fn may_speak(&self, news: bool, now: Instant) -> bool {
        match self.state {
            State::Idle { ready, next } => now >= next || (news && now >= ready),
            State::Speaking => false,
            State::Granted { until, .. } | State::Listening { until } => now >= until,
        }
    }

    /// When [`Self::may_speak`] next turns true by itself; `news` as there.
    pub fn next_wakeup(&self, news: bool) -> Option<Instant> {
        match self.state {
            State::Idle { ready, next } => Some(if news { ready.min(next) } else { next }),
            State::Speaking => None,
            State::Granted { until, .. } | State::Listening { until } => Some(until),
        }
    }

    /// When a vehicle that does not answer is tried again although others wait: ever more seldom.
    pub fn retry_at(&self) -> Instant {
        let Some(begun) = self.begun.filter(|_| self.unanswered >= 3) else { return Instant::ZERO };
        begun + Duration::from_secs(1 << (self.unanswered - 1).min(7))
    }

    /// The vehicle is there after all: it is spoken with as soon as possible.
    pub fn hurry(&mut self, now: Instant) {
        self.unanswered = self.unanswered.min(2);
        if let State::Idle { next, .. } = &mut self.state {
            *next = (*next).min(now);
        }
    }

    /// The turn to grant where `vehicles` share the medium: long against what changing hands costs, in quarter seconds.
    pub fn grant(&self, profile: &ModemProfile, vehicles: usize) -> u8 {
        let cost = self.round_trip().unwrap_or(self.config.max_propagation * 2) + profile.turn_around * 2;
        let least = profile.frame_airtime() + Duration::from_secs(1);
        // With several, each waits for all the others: shorter turns cost some capacity and save much waiting.
        let most = self.config.max_turn.div_f64((vehicles.max(1) as f64).sqrt()).max(cost * 2);
        quarter_seconds((cost * 16).min(most).max(least), 255)
    }

    /// The surface begins its turn. A turn that begins while an answer was due counts as unanswered.
    pub fn begin(&mut self, grant_quarters: u8, now: Instant) {
        self.begun = Some(now);
        if matches!(self.state, State::Granted { .. }) {
            self.unanswered += 1;
        }
        self.granted_airtime = Duration::from_millis(250) * u32::from(grant_quarters);
        self.state = State::Speaking;
    }

    /// Something was said outside of turns.
    pub fn note_begun(&mut self, now: Instant) {
        self.begun = Some(now);
    }

    /// The last frame of the surface's turn has left the modem; of the answer, up to `losable` frames may be lost in a row.
    pub fn handle_turn_sent(&mut self, profile: &ModemProfile, losable: u32, now: Instant) {
        let flight =
            self.round_trip().map_or(self.config.max_propagation * 2, |rtt| rtt + rtt / 4 + Duration::from_millis(200));
        // A vehicle farther away than it was thought to be must not be talked over for ever; a modem that polls waits itself.
        let doubts = if profile.access == Access::Polled { 0 } else { self.unanswered.saturating_sub(4).min(10) };
        let patience = Duration::from_secs(1) * doubts;
        let frames = if self.is_saturated { losable + 1 } else { 1 };
        let answer = (profile.frame_airtime() * frames).min(self.granted_airtime.max(profile.frame_airtime()));
        let until = now + patience + flight + profile.turn_around * 2 + answer;
        self.granted = Some(now);
        self.state = State::Granted { granted: now, until };
    }

    /// A measurement of the two-way propagation.
    pub fn handle_round_trip(&mut self, measured: Duration) {
        if measured <= self.config.max_propagation * 8 {
            self.round_trips.push_back(measured);
            if self.round_trips.len() > Self::ROUND_TRIPS {
                self.round_trips.pop_front();
            }
        }
    }

    /// A frame of the vehicle was heard, after which it says `remaining` more will follow; `wish` is its turn byte.
    ///
    /// Only for a frame that proves that the vehicle has heard the grant: one that was late under way or came twice tells
    /// nothing about the turn.
    pub fn handle_answer(
        &mut self,
        bytes: usize,
        remaining: u8,
        wish: Option<u8>,
        profile: &ModemProfile,
        now: Instant,
    ) {
        if let State::Granted { granted, .. } = self.state
            && self.round_trips.is_empty()
        {
            // Until a stamp tells, what the whole answer took is the most that it can be.
            let both_ways = now.since(granted).saturating_sub(profile.airtime(bytes) + profile.turn_around);
            self.handle_round_trip(both_ways);
        }
        self.unanswered = 0;
        let rest = profile.frame_airtime() * u32::from(remaining);
        let taken = self.granted.map_or(Duration::ZERO, |at| now.since(at)) + rest;
        self.is_saturated = taken >= self.granted_airtime.mul_f64(0.6);
        if remaining > 0 {
            let margin = profile.turn_around + profile.frame_airtime() / 2;
            let until = now + rest.min(self.granted_airtime) + margin;
            self.state = State::Listening { until };
            return;
        }
        let pause = wish.map_or(Duration::ZERO, |quarters| Duration::from_millis(250) * u32::from(quarters));
        let ready = now + profile.turn_around;
        self.state = State::Idle { ready, next: ready + pause.min(self.config.max_idle) };
    }

    /// Nothing may be sent before `at` (the budget does not allow it): wait until then.
    pub fn postpone(&mut self, at: Instant) {
        if let State::Granted { .. } = self.state {
            self.unanswered += 1;
        }
        self.state = State::Idle { ready: at, next: at };
    }
}
