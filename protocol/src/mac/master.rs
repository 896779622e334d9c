//! The surface's side of medium access.

use super::{Access, ModemProfile, Wish, quarter_seconds};
use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// How the surface grants turns to one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MasterConfig {
    /// Longest one-way propagation time to expect before the first measurement.
    pub max_propagation: Duration,
    /// The longest turn to grant.
    pub max_turn: Duration,
    /// The longest pause between turns while neither end has content.
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

/// The state of the medium, as far as the surface knows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum MediumState {
    /// Nobody transmits. The next grant goes out at `next`, or from `ready` on if there is new content.
    Idle {
        ready: Instant,
        next: Instant,
    },
    Speaking,
    /// The vehicle has the turn, and no frame of it came in yet.
    Granted {
        granted: Instant,
        until: Instant,
    },
    Listening {
        until: Instant,
    },
    /// Copies of frames that came in end the turn at `until`; then as idle.
    Ending {
        until: Instant,
        next: Instant,
    },
}

/// Grants turns to one vehicle and recovers from lost grants.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    state: MediumState,
    /// Recent measurements of the two-way propagation time, and when they were taken. The least one counts, because every
    /// error makes it look longer.
    round_trips: VecDeque<(Instant, Duration)>,
    unanswered: u32,
    granted_airtime: Duration,
    /// When the last turn was granted.
    granted: Option<Instant>,
    is_saturated: bool,
    begun: Option<Instant>,
}

impl Master {
    const ROUND_TRIPS: usize = 4;
    /// Time in which a vehicle may go so far that an earlier measurement does not count.
    const ROUND_TRIP_AGE: Duration = Duration::from_secs(300);
    /// Unanswered grants above which an answer is waited for longer: the vehicle may be farther away than assumed.
    const MAX_UNANSWERED_NEARBY: u32 = 4;

    /// A master that may grant its first turn at `now`.
    pub fn new(config: MasterConfig, now: Instant) -> Self {
        Self {
            config,
            state: MediumState::Idle { ready: now, next: now },
            round_trips: VecDeque::new(),
            unanswered: 0,
            granted_airtime: Duration::ZERO,
            granted: None,
            is_saturated: true,
            begun: None,
        }
    }

    /// Two-way propagation time; `None` before the first measurement.
    pub fn round_trip(&self) -> Option<Duration> {
        self.round_trips.iter().map(|(_, measured)| *measured).min()
    }

    /// The number of consecutive grants without an answer.
    pub fn unanswered(&self) -> u32 {
        self.unanswered
    }

    /// When the surface's last turn toward this vehicle began.
    pub fn begun(&self) -> Option<Instant> {
        self.begun
    }

    /// Whether a turn of this vehicle, or a grant to it, occupies the medium at `now`.
    pub fn is_engaged(&self, now: Instant) -> bool {
        match self.state {
            MediumState::Idle { .. } => false,
            MediumState::Ending { until, .. } => now < until,
            _ => true,
        }
    }

    /// When a turn that occupies the medium ends; `None` while the surface speaks.
    pub fn end_of_turn(&self) -> Option<Instant> {
        match self.state {
            MediumState::Ending { until, .. } => Some(until),
            _ => self.next_wakeup(false),
        }
    }

    /// Whether the surface may begin its turn at `now`; `news` (a waiting slot) ends an idle pause.
    pub fn may_speak(&self, news: bool, now: Instant) -> bool {
        match self.state {
            MediumState::Idle { ready, next } | MediumState::Ending { until: ready, next } => {
                now >= next || (news && now >= ready)
            }
            MediumState::Speaking => false,
            MediumState::Granted { until, .. } | MediumState::Listening { until } => now >= until,
        }
    }

    /// When [`Self::may_speak`] next becomes true by itself; `news` has the same meaning.
    pub fn next_wakeup(&self, news: bool) -> Option<Instant> {
        match self.state {
            MediumState::Idle { ready, next } | MediumState::Ending { until: ready, next } => {
                Some(if news { ready.min(next) } else { next })
            }
            MediumState::Speaking => None,
            MediumState::Granted { until, .. } | MediumState::Listening { until } => Some(until),
        }
    }

    /// The earliest retry of a vehicle that does not answer, while others wait. The interval doubles with each
    /// grant, up to 128 s.
    pub fn retry_at(&self) -> Instant {
        let Some(begun) = self.begun.filter(|_| self.unanswered >= 3) else { return Instant::ZERO };
        begun + Duration::from_secs(1 << (self.unanswered - 1).min(7))
    }

    /// Contacts the vehicle as soon as possible, because it has answered a discovery call.
    pub fn hurry(&mut self, now: Instant) {
        self.unanswered = self.unanswered.min(2);
        if let MediumState::Idle { next, .. } = &mut self.state {
            *next = (*next).min(now);
        }
    }

    /// The length of the next turn in quarter seconds: long compared to the cost of a handover, shorter where
    /// several vehicles share the medium.
    pub fn grant(&self, profile: &ModemProfile, vehicles: usize) -> u8 {
        let cost = self.round_trip().unwrap_or(self.config.max_propagation * 2) + profile.turn_around * 2;
        let least = profile.frame_airtime() + Duration::from_secs(1);
        // With several vehicles, each waits for all others: shorter turns cost some capacity and save much waiting.
        let most = self.config.max_turn.div_f64((vehicles.max(1) as f64).sqrt()).max(cost * 2);
        quarter_seconds((cost * 16).min(most).max(least), 255)
    }

    /// The surface begins its turn. If an answer was due, the grant before counts as unanswered.
    pub fn begin(&mut self, grant_quarters: u8, now: Instant) {
        self.begun = Some(now);
        if matches!(self.state, MediumState::Granted { .. }) {
            self.unanswered += 1;
        }
        self.granted_airtime = Duration::from_millis(250) * u32::from(grant_quarters);
        self.state = MediumState::Speaking;
    }

    /// The surface transmits outside of a turn.
    pub fn note_begun(&mut self, now: Instant) {
        self.begun = Some(now);
    }

    /// The last frame of the surface's turn is on air. Up to `losable` consecutive frames of the answer may be lost.
    pub fn handle_turn_sent(&mut self, profile: &ModemProfile, losable: u32, now: Instant) {
        // A vehicle farther away than assumed must get the chance to answer; a modem that polls waits by itself.
        let doubts = if profile.access == Access::Polled {
            0
        } else {
            self.unanswered.saturating_sub(Self::MAX_UNANSWERED_NEARBY).min(10)
        };
        let patience = Duration::from_secs(1) * doubts;
        let frames = if self.is_saturated { losable + 1 } else { 1 };
        let answer = (profile.frame_airtime() * frames).min(self.granted_airtime.max(profile.frame_airtime()));
        let until = now + patience + self.flight() + profile.turn_around * 2 + answer;
        self.granted = Some(now);
        self.state = MediumState::Granted { granted: now, until };
    }

    /// The surface's modem has restarted, perhaps with the grant still in it: an answer is waited for as if that went out now.
    pub fn handle_modem_restart(&mut self, profile: &ModemProfile, now: Instant) {
        let longest = now + self.flight() + profile.turn_around;
        if let MediumState::Granted { until, .. } = &mut self.state {
            *until = (*until).min(longest);
        }
    }

    /// Takes a measurement of the two-way propagation time.
    pub fn handle_round_trip(&mut self, measured: Duration, now: Instant) {
        if measured <= self.config.max_propagation * 8 {
            self.round_trips.retain(|(at, _)| now.since(*at) < Self::ROUND_TRIP_AGE);
            self.round_trips.push_back((now, measured));
            if self.round_trips.len() > Self::ROUND_TRIPS {
                self.round_trips.pop_front();
            }
        }
    }

    /// A frame of the vehicle came in that announces `remaining` further frames; `wish` is its turn byte.
    ///
    /// The caller must make sure that the vehicle has received the grant: a late frame or a copy of an earlier one does
    /// not show the state of the turn.
    pub fn handle_answer(
        &mut self,
        bytes: usize,
        remaining: u8,
        wish: Option<Wish>,
        profile: &ModemProfile,
        now: Instant,
    ) {
        if let MediumState::Granted { granted, .. } = self.state
            && self.round_trips.is_empty()
        {
            // Before the first stamp, the time of the whole answer is an upper bound.
            let both_ways = now.since(granted).saturating_sub(profile.airtime(bytes) + profile.turn_around);
            self.handle_round_trip(both_ways, now);
        }
        self.unanswered = 0;
        let rest = profile.frame_airtime() * u32::from(remaining);
        let taken = self.granted.map_or(Duration::ZERO, |at| now.since(at)) + rest;
        self.is_saturated = taken >= self.granted_airtime.mul_f64(0.6);
        let until = now + self.rest_of_turn(remaining, profile);
        let pause = wish.map(|wish| wish.wait().min(self.config.max_idle));
        let ready = now + profile.turn_around;
        self.state = match (remaining, pause) {
            (0, pause) => MediumState::Idle { ready, next: ready + pause.unwrap_or_default() },
            (_, Some(pause)) => MediumState::Ending { until, next: until + pause },
            (_, None) => MediumState::Listening { until },
        };
    }

    /// A frame of the vehicle came in that announces `remaining` further frames and belongs to another pair of runs: the
    /// vehicle hears the grants, although it does not answer them. Its turn ends with these frames, or with the airtime that
    /// was granted: whoever forges such frames cannot keep the surface waiting.
    pub fn handle_stray(&mut self, remaining: u8, profile: &ModemProfile, now: Instant) {
        self.unanswered = self.unanswered.min(Self::MAX_UNANSWERED_NEARBY);
        let end = now + self.rest_of_turn(remaining, profile);
        let longest = self.flight() + profile.turn_around * 2 + self.granted_airtime.max(profile.frame_airtime());
        if let MediumState::Granted { granted, until } = &mut self.state {
            *until = end.min(*granted + longest);
        }
    }

    /// Time to allow for both ways through the water.
    fn flight(&self) -> Duration {
        self.round_trip().map_or(self.config.max_propagation * 2, |rtt| rtt + rtt / 4 + Duration::from_millis(200))
    }

    /// Longest time in which the `remaining` further frames of a turn come in.
    fn rest_of_turn(&self, remaining: u8, profile: &ModemProfile) -> Duration {
        let rest = profile.frame_airtime() * u32::from(remaining);
        rest.min(self.granted_airtime) + profile.turn_around + profile.frame_airtime() / 2
    }

    /// Waits until `at`, because the budget allows no transmission before.
    pub fn postpone(&mut self, at: Instant) {
        if let MediumState::Granted { .. } = self.state {
            self.unanswered += 1;
        }
        self.state = MediumState::Idle { ready: at, next: at };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROFILE: ModemProfile = ModemProfile {
        frame_bytes: 256,
        bit_rate_bps: 10_000.0,
        overhead_bits: 0,
        turn_around: Duration::from_millis(300),
        access: Access::Shared,
    };

    #[test]
    fn copies_end_a_turn_before_the_pause_that_it_asks_for() {
        let now = Instant::from_secs_f64(100.0);
        let mut master = Master::new(MasterConfig::default(), now);
        master.handle_round_trip(Duration::from_secs(1), now);
        master.begin(40, now);
        master.handle_turn_sent(&PROFILE, 0, now);
        master.handle_answer(256, 2, Some(Wish::after(Duration::from_secs(4))), &PROFILE, now);
        let end = master.end_of_turn().unwrap();
        assert!(end > now + PROFILE.frame_airtime() * 2 && !master.may_speak(true, now + PROFILE.frame_airtime()));
        assert!(master.is_engaged(now) && !master.is_engaged(end));
        assert!(master.may_speak(true, end) && !master.may_speak(false, end));
        assert_eq!(master.next_wakeup(false), Some(end + Duration::from_secs(4)));
        assert!(master.may_speak(false, end + Duration::from_secs(4)));
    }

    #[test]
    fn the_least_recent_round_trip_counts() {
        let now = Instant::from_secs_f64(100.0);
        let mut master = Master::new(MasterConfig::default(), now);
        let mut measure = |ms: u64, at_s: u64| {
            master.handle_round_trip(Duration::from_millis(ms), now + Duration::from_secs(at_s));
            master.round_trip().unwrap().as_millis()
        };
        assert_eq!(
            [(500, 0), (700, 100), (900, 310), (800, 320)].map(|(ms, at_s)| measure(ms, at_s)),
            [500, 500, 700, 700]
        );
    }

    #[test]
    fn a_grant_that_a_restart_of_the_modem_took_is_given_again_soon() {
        let now = Instant::from_secs_f64(100.0);
        let mut master = Master::new(MasterConfig::default(), now);
        master.handle_round_trip(Duration::from_secs(1), now);
        master.begin(40, now);
        master.handle_turn_sent(&PROFILE, 20, now);
        let again = now + Duration::from_secs(2);
        assert!(!master.may_speak(true, again), "the answer may take so long");
        master.handle_modem_restart(&PROFILE, now + Duration::from_millis(200));
        assert!(!master.may_speak(true, now + Duration::from_secs(1)) && master.may_speak(true, again));
        master.begin(40, again);
        master.handle_turn_sent(&PROFILE, 0, again);
        let until = master.end_of_turn();
        master.handle_modem_restart(&PROFILE, until.unwrap());
        assert_eq!(master.end_of_turn(), until, "never later");
    }

    #[test]
    fn the_surface_waits_for_a_turn_in_another_run_as_granted() {
        let now = Instant::from_secs_f64(100.0);
        let mut master = Master::new(MasterConfig::default(), now);
        master.handle_round_trip(Duration::from_secs(1), now);
        master.begin(40, now);
        master.handle_turn_sent(&PROFILE, 0, now);
        let heard = now + Duration::from_secs(1);
        master.handle_stray(10, &PROFILE, heard);
        let end = heard + PROFILE.frame_airtime() * 10;
        assert!(!master.may_speak(true, end) && master.may_speak(true, end + Duration::from_secs(2)));
        (0..100).for_each(|i| master.handle_stray(255, &PROFILE, heard + Duration::from_millis(100) * i));
        assert!(master.may_speak(true, now + Duration::from_secs(14)));
        master.handle_stray(0, &PROFILE, heard);
        assert!(master.may_speak(true, heard + Duration::from_secs(1)));
    }
}
