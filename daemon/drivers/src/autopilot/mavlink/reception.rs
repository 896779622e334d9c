//! The link to an autopilot: what is missing from the beginning, in words for people; whether the autopilot has restarted, and
//! whether another vehicle answers in its name.

use super::super::lasting::{Lasting, absence_text};
use super::frame::Refused;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Time without a heartbeat, or without a position, after which people are told.
const AWAITED: Duration = Duration::from_secs(8);

/// Waits for the first heartbeat and the first position.
#[derive(Debug, Default)]
pub(super) struct Reception {
    /// When the first bytes came, and how many since.
    began: Option<Instant>,
    bytes: u64,
    /// When the autopilot answered, until it reports its position.
    answered: Option<Instant>,
    is_told: bool,
    /// Nothing has come since the port was opened.
    absence: Lasting,
}

impl Reception {
    /// Waits again for everything, because the port was opened.
    pub(super) fn handle_open(&mut self) {
        *self = Self::default();
    }

    pub(super) fn handle_bytes(&mut self, count: usize, now: Instant) {
        self.absence.end();
        self.began.get_or_insert(now);
        self.bytes += count as u64;
    }

    /// The autopilot answers, at first or again, or is another one, whose position is awaited.
    pub(super) fn handle_answer(&mut self, now: Instant) {
        (self.answered, self.is_told) = (Some(now), false);
    }

    /// A position came, and none is awaited.
    pub(super) fn handle_position(&mut self) {
        self.answered = None;
    }

    /// What people should know where no bytes come, or bytes without a heartbeat of `system`, once.
    pub(super) fn poll_silence(&mut self, system: u8, refused: Refused, now: Instant) -> Option<String> {
        let Some(began) = self.began else {
            return self.absence.is_news(AWAITED, now).then(|| absence_text("heartbeat", AWAITED));
        };
        if self.is_told || now.since(began) < AWAITED {
            return None;
        }
        self.is_told = true;
        let Refused { checksum, garbage, .. } = refused;
        let cause = match garbage + checksum {
            0 => "check autopilot.system and autopilot.component, and whether the autopilot is an ArduPilot",
            _ => "check the baud rate, and whether the port has MAVLink",
        };
        Some(format!(
            "{} bytes came in without a heartbeat of an ArduPilot with system {system}, {garbage} bytes of them of no MAVLink frame, {checksum} frames damaged: {cause}",
            self.bytes
        ))
    }

    /// What people should know of an autopilot that answers without a position, once.
    pub(super) fn poll_no_position(&mut self, now: Instant) -> Option<&'static str> {
        self.answered.filter(|answered| !self.is_told && now.since(*answered) >= AWAITED)?;
        self.is_told = true;
        Some(
            "the autopilot answers but reports no position, neither LOCAL_POSITION_NED nor GLOBAL_POSITION_INT: check that its EKF has an origin and a source of position",
        )
    }
}

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

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(10.0 + s)
    }

    #[test]
    fn bytes_without_a_heartbeat_are_named_once_with_what_to_check() {
        let lines = |refused: Refused| {
            let mut reception = Reception::default();
            let second = |s: u32| {
                reception.handle_bytes(100, at(f64::from(s)));
                reception.poll_silence(1, refused, at(f64::from(s))).map(|line| (s, line))
            };
            (0..100).filter_map(second).collect::<Vec<_>>()
        };
        let noise = lines(Refused { garbage: 700, ..Refused::default() });
        assert!(noise.len() == 1 && noise[0].0 == 8 && noise[0].1.contains("baud rate"), "{noise:?}");
        assert!(lines(Refused::default())[0].1.contains("autopilot.system"));
    }

    #[test]
    fn an_autopilot_that_sends_nothing_is_named_once() {
        let mut reception = Reception::default();
        let second = |s: u32| reception.poll_silence(1, Refused::default(), at(f64::from(s))).map(|line| (s, line));
        let lines: Vec<(u32, String)> = (0..100).filter_map(second).collect();
        assert!(lines.len() == 1 && lines[0].0 == 8 && lines[0].1.contains("autopilot.port"), "{lines:?}");
    }

    #[test]
    fn an_answer_without_a_position_is_named_once() {
        let mut reception = Reception::default();
        reception.handle_answer(at(0.0));
        let told = (0..100).filter(|s| reception.poll_no_position(at(f64::from(*s))).is_some()).count();
        assert_eq!(told, 1);
        reception.handle_answer(at(100.0));
        reception.handle_position();
        assert_eq!(reception.poll_no_position(at(200.0)), None);
    }
}

#[cfg(test)]
mod boot_clock_tests {
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
