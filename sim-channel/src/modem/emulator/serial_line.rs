//! The line between host and modem: baud rate in both directions, and its faults.

use super::Fault;
use crate::random::RandomStream;
use std::collections::VecDeque;
use std::time::Duration;

/// Bytes from the host that the modem has not read yet.
const MAX_INPUT_BYTES: usize = 64 * 1024;
/// Bytes to the host that the host has not read yet; more are lost.
const MAX_OUTPUT_BYTES: usize = 1024 * 1024;
/// Bytes that reach the host at a time, so that its reads split lines anywhere.
const OUTPUT_CHUNK: u32 = 16;

/// The modem's end of a serial line or TCP connection: paced, bounded, and open to faults.
#[derive(Debug)]
pub(super) struct SerialLine {
    byte_time: Duration,
    output: VecDeque<u8>,
    output_from: Duration,
    input: VecDeque<(Duration, Vec<u8>)>,
    input_bytes: usize,
    input_free: Duration,
    frozen_until: Duration,
}

impl SerialLine {
    /// A line of `baud` with ten bits a byte; `None` for a line without pacing.
    pub(super) fn new(baud: Option<u32>) -> Self {
        Self {
            byte_time: baud.map_or(Duration::ZERO, |baud| Duration::from_secs(10) / baud.max(1)),
            output: VecDeque::new(),
            output_from: Duration::ZERO,
            input: VecDeque::new(),
            input_bytes: 0,
            input_free: Duration::ZERO,
            frozen_until: Duration::ZERO,
        }
    }

    pub(super) fn room(&self) -> usize {
        MAX_INPUT_BYTES - self.input_bytes.min(MAX_INPUT_BYTES)
    }

    /// Takes bytes from the host, which come over the line one byte time after another.
    pub(super) fn accept(&mut self, bytes: &[u8], now: Duration) {
        let taken = bytes.get(..self.room().min(bytes.len())).unwrap_or_default();
        if taken.is_empty() {
            return;
        }
        self.input_free = self.input_free.max(now) + self.byte_time * taken.len() as u32;
        self.input_bytes += taken.len();
        self.input.push_back((self.input_free, taken.to_vec()));
    }

    /// Time at which the next bytes from the host will have come.
    pub(super) fn next_input(&self) -> Option<Duration> {
        self.input.front().map(|(at, _)| (*at).max(self.frozen_until))
    }

    /// The next bytes from the host that have come by `now`, with their time.
    pub(super) fn take_input(&mut self, now: Duration) -> Option<(Duration, Vec<u8>)> {
        let at = self.next_input().filter(|at| *at <= now)?;
        let (_, bytes) = self.input.pop_front()?;
        self.input_bytes -= bytes.len();
        Some((at, bytes))
    }

    pub(super) fn write(&mut self, bytes: &[u8], now: Duration) {
        if self.output.is_empty() {
            self.output_from = self.output_from.max(now);
        }
        let room = MAX_OUTPUT_BYTES - self.output.len();
        self.output.extend(bytes.iter().take(room));
    }

    /// Time at which more bytes will have reached the host.
    pub(super) fn next_output(&self) -> Option<Duration> {
        let waiting = u32::try_from(self.output.len()).unwrap_or(u32::MAX).min(OUTPUT_CHUNK);
        (waiting > 0).then(|| (self.output_from + self.byte_time * waiting).max(self.frozen_until))
    }

    /// The bytes that have reached the host by `now`.
    pub(super) fn poll_output(&mut self, now: Duration) -> Vec<u8> {
        if now < self.frozen_until || self.output.is_empty() {
            return Vec::new();
        }
        let passed = now.saturating_sub(self.output_from).as_nanos();
        let through = match self.byte_time.as_nanos() {
            0 => self.output.len(),
            byte_time => usize::try_from(passed / byte_time).unwrap_or(usize::MAX).min(self.output.len()),
        };
        self.output_from += self.byte_time * through as u32;
        self.output.drain(..through).collect()
    }

    fn freeze(&mut self, until: Duration) {
        self.frozen_until = self.frozen_until.max(until);
    }

    /// Injects a fault of the line; false if it is none.
    pub(super) fn inject(&mut self, fault: Fault, rng: &mut RandomStream, now: Duration) -> bool {
        match fault {
            Fault::Garbage(bytes) => self.garble(bytes, rng, now),
            Fault::HalfLine => self.cut(),
            Fault::Freeze(length) => self.freeze(now + length),
            _ => return false,
        }
        true
    }

    /// Drops the rear half of the bytes that wait for the host.
    fn cut(&mut self) {
        self.output.truncate(self.output.len() / 2);
    }

    fn garble(&mut self, bytes: u16, rng: &mut RandomStream, now: Duration) {
        let noise: Vec<u8> = (0..bytes).map(|_| rng.below(256) as u8).collect();
        self.write(&noise, now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn bytes_take_ten_bits_each_in_both_directions() {
        let mut port = SerialLine::new(Some(19200));
        port.accept(&[0; 192], SECOND);
        assert_eq!(port.next_input(), Some(SECOND + Duration::from_nanos(520_833 * 192)));
        assert!(port.take_input(Duration::from_millis(1099)).is_none());
        port.write(&[1; 192], SECOND);
        assert_eq!(port.poll_output(Duration::from_millis(1050)).len(), 96);
        assert_eq!(port.poll_output(Duration::from_millis(1100)).len(), 96);
    }

    #[test]
    fn bytes_without_pacing_arrive_at_once() {
        let mut port = SerialLine::new(None);
        port.write(&[1; 5000], SECOND);
        assert_eq!(port.next_output(), Some(SECOND));
        assert_eq!(port.poll_output(SECOND).len(), 5000);
    }

    #[test]
    fn frozen_line_keeps_its_bytes() {
        let mut port = SerialLine::new(None);
        port.freeze(SECOND * 3);
        port.accept(b"AT", SECOND);
        port.write(b"OK", SECOND);
        assert!(port.take_input(SECOND * 2).is_none() && port.poll_output(SECOND * 2).is_empty());
        assert_eq!(port.take_input(SECOND * 3).map(|(_, bytes)| bytes), Some(b"AT".to_vec()));
        assert_eq!(port.poll_output(SECOND * 3), b"OK");
    }

    #[test]
    fn memory_is_bounded_in_both_directions() {
        let mut port = SerialLine::new(Some(300));
        for _ in 0..100 {
            port.accept(&[0; 4096], SECOND);
            port.write(&[0; 40_960], SECOND);
        }
        assert_eq!(port.room(), 0);
        assert_eq!(port.output.len(), MAX_OUTPUT_BYTES);
    }
}
