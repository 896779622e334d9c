//! What is missing on the link to an autopilot from the beginning, in words for people.

use super::super::lasting::{Lasting, absence_text};
use super::frame::Refused;
use scenecast_protocol::time::Instant;
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
