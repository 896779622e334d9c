//! The autopilot's own clock: whether it has restarted, and whether another vehicle answers in its name.

use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Messages of one run of the autopilot may be this much out of order, milliseconds.
const CLOCKS_APART_MS: i64 = 1000;
/// A clock may be this much ahead of what its last message lets expect: messages may have been late, milliseconds.
const AHEAD_MS: i64 = 5000;
/// A clock that was not heard for this long has ended, unless two are heard.
const ENDED: Duration = Duration::from_secs(1);
/// Of two clocks that are heard in turn, the first has ended after this time.
const CONTESTED_ENDED: Duration = Duration::from_secs(5);

/// What the time in a message says of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BootTime {
    /// It is on the autopilot's clock, or this kind of message does not count by that clock.
    Own,
    /// The autopilot's, which has restarted.
    Restarted,
    /// It is on the clock of another vehicle with the same system and component number.
    Foreign,
}

/// Follows the first clock that is heard, in milliseconds since the autopilot's start.
///
/// Two vehicles with the same system and component number have clocks of their own. A message with another clock than the one before,
/// while both are heard, is of the other vehicle. An autopilot that restarts is silent before its clock begins anew.
#[derive(Debug, Default)]
pub(super) struct BootClock {
    last: Option<(u32, Instant)>,
    /// When each message was heard last with this clock. A message that never has it, counts in another way.
    messages: BTreeMap<u32, Instant>,
    /// The last message of another clock.
    foreign: Option<(u32, Instant)>,
    is_contested: bool,
    is_told: bool,
}

impl BootClock {
    /// Takes the time in a message with the number `id`.
    pub(super) fn handle(&mut self, id: u32, ms: u32, now: Instant) -> BootTime {
        let Some((before, at)) = self.last else { return self.follow(id, ms, now) };
        let passed_ms = i64::try_from(now.since(at).as_millis()).unwrap_or(i64::MAX);
        // After 49.7 days the clock begins at 0 again.
        let advanced_ms = i64::from(ms.wrapping_sub(before).cast_signed());
        if (-CLOCKS_APART_MS..=passed_ms.saturating_add(AHEAD_MS)).contains(&advanced_ms) {
            self.is_contested |= self.foreign.is_some_and(|(_, at)| now.since(at) < CONTESTED_ENDED);
            return self.follow(id, ms, now);
        }
        let ends = if self.is_contested { CONTESTED_ENDED } else { ENDED };
        if now.since(at) >= ends {
            let is_other_run = self.is_contested || ms < before;
            *self = Self { is_told: self.is_told, ..Self::default() };
            self.follow(id, ms, now);
            return if is_other_run { BootTime::Restarted } else { BootTime::Own };
        }
        if self.messages.get(&id).is_none_or(|at| now.since(*at) >= CONTESTED_ENDED) {
            return BootTime::Own;
        }
        self.foreign = Some((ms, now));
        BootTime::Foreign
    }

    fn follow(&mut self, id: u32, ms: u32, now: Instant) -> BootTime {
        self.last = Some((ms, now));
        self.messages.insert(id, now);
        BootTime::Own
    }

    /// Whether another vehicle was heard not long ago.
    pub(super) fn is_contested(&self, now: Instant) -> bool {
        self.is_contested && self.foreign.is_some_and(|(_, at)| now.since(at) < CONTESTED_ENDED)
    }

    /// Seconds between the clocks of two vehicles, once.
    pub(super) fn poll_conflict_s(&mut self) -> Option<u32> {
        let ((own, _), (other, _)) = self.last.zip(self.foreign).filter(|_| self.is_contested && !self.is_told)?;
        self.is_told = true;
        Some(own.abs_diff(other) / 1000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ATTITUDE: u32 = 30;
    const LOCAL: u32 = 32;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(10.0 + s)
    }

    #[test]
    fn of_two_vehicles_in_turn_the_first_counts() {
        for offset_ms in [900_000, 7_000, u32::MAX - 20_000] {
            let mut clock = BootClock::default();
            let mut verdicts = Vec::new();
            for tenth in 0..100 {
                let (ms, now) = (30_000 + 100 * tenth, at(f64::from(tenth) / 10.0));
                for id in [ATTITUDE, LOCAL] {
                    assert_eq!(clock.handle(id, ms, now), BootTime::Own);
                    verdicts.push(clock.handle(id, ms.wrapping_add(offset_ms), now));
                }
            }
            // The first message of each kind could be counted in another way.
            assert!(verdicts.iter().all(|verdict| *verdict == BootTime::Foreign), "{offset_ms}");
            assert!(clock.is_contested(at(10.0)) && clock.poll_conflict_s().is_some(), "{offset_ms}");
            assert_eq!(clock.poll_conflict_s(), None, "once");
            assert_eq!(
                clock.handle(LOCAL, 50_000u32.wrapping_add(offset_ms), at(20.0)),
                BootTime::Restarted,
                "the first is gone"
            );
        }
    }

    #[test]
    fn a_clock_that_goes_back_and_stays_is_a_restart() {
        let mut clock = BootClock::default();
        assert_eq!(clock.handle(LOCAL, 60_000, at(0.0)), BootTime::Own);
        assert_eq!(clock.handle(LOCAL, 500, at(4.0)), BootTime::Restarted);
        assert_eq!(clock.handle(LOCAL, 1500, at(5.0)), BootTime::Own);
        assert_eq!(clock.handle(LOCAL, 9500, at(13.0)), BootTime::Own);
        // So quickly that its end is not certain at once.
        assert_eq!(clock.handle(LOCAL, 100, at(13.1)), BootTime::Foreign);
        assert_eq!(clock.handle(LOCAL, 1100, at(14.1)), BootTime::Restarted);
        assert_eq!(clock.poll_conflict_s(), None);
    }

    #[test]
    fn gaps_delays_and_the_end_of_the_range_are_no_restart() {
        let mut clock = BootClock::default();
        for (ms, s) in [
            (4_294_966_000, 0.0),
            (4_294_967_200, 1.2),
            (104, 1.4),
            (4_294_967_290, 1.5),
            (60_000, 62.0),
            (59_500, 62.1),
        ] {
            assert_eq!(clock.handle(LOCAL, ms, at(s)), BootTime::Own, "{ms}");
        }
    }

    #[test]
    fn a_message_that_counts_in_another_way_is_taken() {
        let mut clock = BootClock::default();
        for tenth in 0..50 {
            let now = at(f64::from(tenth) / 10.0);
            assert_eq!(clock.handle(LOCAL, 60_000 + 100 * tenth, now), BootTime::Own);
            assert_eq!(clock.handle(ATTITUDE, 3_000_000_000 + 100 * tenth, now), BootTime::Own);
        }
        assert_eq!(clock.poll_conflict_s(), None);
    }
}
