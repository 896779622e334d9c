//! The usual length of a vehicle's silence.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// The longest recent pause between two frames of a vehicle. Short pauses within a turn do not shorten it at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pauses {
    last_frame: Option<Instant>,
    longest: Option<Duration>,
}

impl Pauses {
    /// A pause is forgotten after pauses that add up to this many times its length.
    const MEMORY: u32 = 8;
    /// A pause up to this length counts fully, even if it is far beyond the usual one.
    const SHORT: Duration = Duration::from_secs(60);

    /// The pauses as an earlier run of the surface knew them.
    pub fn restored(longest: Option<Duration>) -> Self {
        Self { last_frame: None, longest }
    }

    pub fn handle_frame(&mut self, now: Instant) {
        let Some(last) = self.last_frame.replace(now) else { return };
        let pause = now.since(last);
        self.longest = Some(match self.longest {
            // A long pause far beyond the usual one was an outage. It at most doubles the expected pause.
            Some(longest) => pause.min(Self::SHORT.max(longest * 2)).max(longest.saturating_sub(pause / Self::MEMORY)),
            None => pause,
        });
    }

    /// The expected pause between two frames; `None` before the second frame.
    pub fn expected(&self) -> Option<Duration> {
        self.longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The longest silence divided by the expected one, after ten turns of `frames` frames and a pause.
    fn worst(frames: u32, frame: Duration, pause: Duration) -> f64 {
        let (mut pauses, mut now, mut worst) = (Pauses::default(), Instant::ZERO, 0.0);
        for turn in 0..50 {
            for _ in 0..frames {
                now = now + frame;
                pauses.handle_frame(now);
            }
            let expected = pauses.expected().unwrap().as_secs_f64();
            if turn > 10 {
                worst = f64::max(worst, pause.as_secs_f64() / expected);
            }
            now = now + pause - frame;
        }
        worst
    }

    #[test]
    fn no_pause_between_turns_counts_as_silence() {
        for (frames, frame_ms, pause_s) in [(2, 200, 10), (60, 200, 10), (3, 5000, 120), (20, 6000, 240)] {
            let most = worst(frames, Duration::from_millis(frame_ms), Duration::from_secs(pause_s));
            assert!(most < 2.0, "{frames} frames, then {pause_s} s: {most} times what was expected");
        }
    }

    #[test]
    fn an_outage_does_not_make_silence_usual() {
        let mut pauses = Pauses::default();
        (1..=20).for_each(|i| pauses.handle_frame(Instant::ZERO + Duration::from_secs(10) * i));
        pauses.handle_frame(Instant::ZERO + Duration::from_secs(4000));
        assert_eq!(pauses.expected(), Some(Duration::from_secs(60)));
    }
}
