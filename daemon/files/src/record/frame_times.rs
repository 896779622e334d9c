//! Times in the records of both ends: the mission times of the surface, the clock of one end against that of the other, and what
//! became of each frame.

use scenecast_messages::scenecast_msgs::Frame;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// When an end sent and received each frame, nanoseconds of its clock, by a fingerprint of the frame's bytes. The same bytes
/// may be sent several times.
#[derive(Debug, Default, Clone)]
pub struct FrameTimes {
    sent: Times,
    received: Times,
}

/// No frame is under way for longer, nanoseconds.
const LONGEST: u64 = 20_000_000_000;
/// A copy that seems to arrive so much before it was sent, or before all shorter frames, is another one, nanoseconds.
const EARLY: u64 = 2_000_000_000;

/// The length of a frame, and its fingerprint.
type FrameKey = (u32, u64);
type Times = BTreeMap<FrameKey, Vec<u64>>;

/// A frame that an end has sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SentFrame {
    /// Nanoseconds since 1970 of the sender's clock.
    pub sent: u64,
    /// When the other end had received it, by the same clock; `None` if it was lost.
    pub received: Option<u64>,
    /// The same, or when it would have received it.
    pub arrives: u64,
}

impl FrameTimes {
    /// Adds a frame; one without bytes cannot be found again.
    pub fn take(&mut self, nanos: u64, frame: &Frame) {
        if frame.data.is_empty() {
            return;
        }
        let mut hasher = DefaultHasher::new();
        frame.data.hash(&mut hasher);
        let times = if frame.direction == Frame::SENT { &mut self.sent } else { &mut self.received };
        times.entry((frame.data.len() as u32, hasher.finish())).or_default().push(nanos);
    }

    /// The frames of several records of one end, the earliest first.
    pub fn joined<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        all.fold(Self::default(), |mut joined, one| {
            let add = |to: &mut Times, from: &Times| {
                from.iter().for_each(|(frame, times)| to.entry(*frame).or_default().extend(times));
            };
            add(&mut joined.sent, &one.sent);
            add(&mut joined.received, &one.received);
            joined
        })
    }

    /// Whether both ends have recorded a same frame.
    pub fn meets(&self, other: &Self) -> bool {
        let is_in = |times: &Times, others: &Times| times.keys().any(|frame| others.contains_key(frame));
        is_in(&self.sent, &other.received) || is_in(&self.received, &other.sent)
    }

    /// Nanoseconds to add to this clock so that it agrees with `other`: none where every frame arrives after it was sent as
    /// it is; else the middle of the shifts by which each does. Without frames in both directions, so much that the quickest frame
    /// takes no time.
    pub fn shift_to(&self, other: &Self) -> i64 {
        // Own clock + shift <= other clock for frames to the other end, and the reverse for frames from it.
        let highest = quickest(&self.sent, &other.received);
        let lowest = quickest(&other.sent, &self.received).map(|quickest| -quickest);
        match (lowest, highest) {
            (Some(lowest), Some(highest)) if (lowest..=highest).contains(&0) => 0,
            (Some(lowest), Some(highest)) => lowest.midpoint(highest),
            (Some(lowest), None) => lowest.max(0),
            (None, Some(highest)) => highest.min(0),
            (None, None) => 0,
        }
    }

    /// What became of each frame that this end sent to `other`, whose clock shows `shift` nanoseconds more, in the order of times.
    pub fn fates(&self, other: &Self, shift: i64) -> Vec<SentFrame> {
        let arrivals = |frame: &FrameKey| {
            let all = other.received.get(frame).into_iter().flatten();
            all.map(|at| at.saturating_add_signed(-shift)).collect::<Vec<_>>()
        };
        let duration =
            Duration::of(self.sent.iter().filter_map(|(frame, sent)| match (sent.as_slice(), &*arrivals(frame)) {
                (&[sent], &[received]) if received.abs_diff(sent) < LONGEST => {
                    Some((frame.0, received.saturating_sub(sent)))
                }
                _ => None,
            }));
        let copies = |(frame, sent): (&FrameKey, &Vec<u64>)| {
            let copy = |&at: &u64| SentFrame {
                sent: at,
                received: None,
                arrives: at.saturating_add(duration.of_frame(frame.0)),
            };
            (*frame, sent.iter().map(copy).collect::<Vec<_>>())
        };
        let mut fates: BTreeMap<FrameKey, Vec<SentFrame>> = self.sent.iter().map(copies).collect();
        for frame in other.received.keys() {
            let copies = fates.entry(*frame).or_default();
            for arrival in arrivals(frame) {
                // An arrival is that of the copy that was to arrive next to it; a second copy of one is none.
                let near = copies.iter_mut().filter(|copy| {
                    copy.sent <= arrival.saturating_add(EARLY) && copy.arrives.abs_diff(arrival) < LONGEST
                });
                match near.min_by_key(|copy| copy.arrives.abs_diff(arrival)) {
                    Some(copy) => copy.received = copy.received.or(Some(arrival)),
                    // It was sent before the record of its sender began, or while that was not written.
                    None => copies.push(SentFrame {
                        sent: arrival.saturating_sub(duration.of_frame(frame.0)),
                        received: Some(arrival),
                        arrives: arrival,
                    }),
                }
            }
        }
        let mut fates: Vec<SentFrame> = fates.into_values().flatten().collect();
        fates.sort_by_key(|frame| frame.sent);
        correct(&mut fates);
        fates
    }
}

/// How long frames take: a part for each byte, and one for the way.
struct Duration {
    way: f64,
    per_byte: f64,
}

impl Duration {
    /// The least squares of frames of which it is known: bytes and nanoseconds.
    fn of(known: impl Iterator<Item = (u32, u64)>) -> Self {
        let (mut n, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (bytes, nanos) in known {
            let (bytes, nanos) = (f64::from(bytes), nanos as f64);
            (n, x, y, xx, xy) = (n + 1.0, x + bytes, y + nanos, xx + bytes * bytes, xy + bytes * nanos);
        }
        let spread = n * xx - x * x;
        let per_byte = if spread > 0.0 { ((n * xy - x * y) / spread).max(0.0) } else { 0.0 };
        Self { per_byte, way: if n > 0.0 { ((y - per_byte * x) / n).max(0.0) } else { 0.0 } }
    }

    fn of_frame(&self, bytes: u32) -> u64 {
        (self.way + self.per_byte * f64::from(bytes)) as u64
    }
}

/// Frames arrive when they did; one that was lost would have been as late as the frame that arrived next to it.
fn correct(fates: &mut [SentFrame]) {
    let late = |frame: &SentFrame| Some(frame.received? as i64 - frame.arrives as i64);
    let before: Vec<Option<i64>> = carried(fates.iter().map(late));
    let mut after = carried(fates.iter().rev().map(late));
    after.reverse();
    for (frame, (before, after)) in fates.iter_mut().zip(before.into_iter().zip(after)) {
        let late = before.or(after).unwrap_or(0);
        frame.arrives = frame.received.unwrap_or_else(|| frame.arrives.saturating_add_signed(late));
    }
}

/// The last value so far.
fn carried(values: impl Iterator<Item = Option<i64>>) -> Vec<Option<i64>> {
    values
        .scan(None, |last, value| {
            *last = value.or(*last);
            Some(*last)
        })
        .collect()
}

/// The least time from sending to reception, as the two clocks show it, of frames that were sent and received once. The same bytes may
/// have been sent while no record was written, and what was received is then another copy: a time far below that of most frames is
/// left out, and one far below those of several frames that are no longer.
fn quickest(sent: &Times, received: &Times) -> Option<i64> {
    let time = |(frame, sent): (&FrameKey, &Vec<u64>)| match (sent.as_slice(), received.get(frame)?.as_slice()) {
        (&[sent], &[received]) => Some((i64::try_from(i128::from(received) - i128::from(sent)).ok()?, frame.0)),
        _ => None,
    };
    let mut times: Vec<(i64, u32)> = sent.iter().filter_map(time).collect();
    times.sort_unstable();
    let (median, _) = *times.get(times.len() / 2)?;
    times.retain(|(time, _)| median.abs_diff(*time) < LONGEST);
    let is_another = |&(time, bytes): &(i64, u32)| {
        let mut no_longer = times.iter().filter(|other| other.1 <= bytes && other.0 > time);
        no_longer.nth(2).is_some_and(|third| third.0.abs_diff(time) > EARLY)
    };
    times.iter().find(|time| !is_another(time)).map(|(time, _)| *time)
}

/// The mission time at each state that the page showed.
#[derive(Debug, Default, Clone)]
pub struct MissionClock {
    /// In the order of the surface's clock.
    states: Vec<ClockState>,
}

#[derive(Debug, Clone, Copy)]
struct ClockState {
    nanos: u64,
    now_s: f64,
    /// Seconds of mission time for each second of the clock.
    speed: f64,
}

/// The part of a state that has its time.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct StateTime {
    pub now_s: f64,
    pub mission: MissionSpeed,
}

/// Seconds of mission time for each second of the clock.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct MissionSpeed {
    pub speed: f64,
}

impl StateTime {
    /// Reads it from a state in JSON; `None` if it is none.
    pub fn of_json(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }
}

impl MissionClock {
    /// Takes the time of a state, which was recorded at `nanos` since 1970. States may come in any order.
    pub fn take(&mut self, nanos: u64, StateTime { now_s, mission }: StateTime) {
        let at = self.states.partition_point(|state| state.nanos <= nanos);
        self.states.insert(at, ClockState { nanos, now_s, speed: mission.speed.max(1e-3) });
    }

    /// Adds the states of another record.
    pub fn add(&mut self, other: &Self) {
        self.states.extend(&other.states);
        self.states.sort_by_key(|state| state.nanos);
    }

    /// The mission time at a moment of the surface's clock, seconds; `None` if no state tells it.
    pub fn mission_s(&self, nanos: u64) -> Option<f64> {
        let next = self.next(nanos);
        let state = self.states.get(next.saturating_sub(1))?;
        let since_s = (i128::from(nanos) - i128::from(state.nanos)) as f64 / 1e9;
        let next_s = self.states.get(next.max(1)).map_or(f64::INFINITY, |later| later.now_s);
        Some((state.now_s + since_s * state.speed).min(next_s.max(state.now_s)).max(0.0))
    }

    /// The moment of the surface's clock at a mission time; `None` if no state tells it.
    pub fn nanos(&self, at_s: f64) -> Option<u64> {
        let next = self.states.partition_point(|state| state.now_s <= at_s);
        let state = self.states.get(next.saturating_sub(1))?;
        let since = ((at_s - state.now_s) / state.speed * 1e9) as i64;
        let latest = self.states.get(next.max(1)).map_or(u64::MAX, |later| later.nanos.max(state.nanos));
        Some(state.nanos.saturating_add_signed(since).min(latest))
    }

    /// Mission times in seconds and the nanoseconds since 1970 at which they were shown.
    pub fn moments(&self) -> impl Iterator<Item = (f64, u64)> {
        self.states.iter().map(|state| (state.now_s, state.nanos))
    }

    /// Seconds of mission time for each second of the clock at a moment; 1 if no state tells it.
    pub fn speed(&self, nanos: u64) -> f64 {
        // That of the last state up to it, or else of the first.
        self.states.get(self.next(nanos).saturating_sub(1)).map_or(1.0, |state| state.speed)
    }

    /// Seconds of mission time for each second of the clock over all states, as far as mission time went on; `None` if they do not tell it.
    pub fn mean_speed(&self) -> Option<f64> {
        let steps = self.states.iter().zip(self.states.iter().skip(1));
        let sum = |sum: (f64, f64), (a, b): (&ClockState, &ClockState)| {
            let (mission_s, clock_s) = (b.now_s - a.now_s, (b.nanos - a.nanos) as f64 / 1e9);
            if mission_s > 0.0 { (sum.0 + mission_s, sum.1 + clock_s) } else { sum }
        };
        let (mission_s, clock_s) = steps.fold((0.0, 0.0), sum);
        (clock_s > 1.0).then(|| mission_s / clock_s)
    }

    /// The place of the first state after a moment.
    fn next(&self, nanos: u64) -> usize {
        self.states.partition_point(|state| state.nanos <= nanos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(frames: &[(u8, u8, u64)]) -> FrameTimes {
        let mut times = FrameTimes::default();
        for &(direction, byte, at) in frames {
            times.take(at, &Frame { direction, data: vec![byte], ..Default::default() });
        }
        times
    }

    #[test]
    fn clocks_that_agree_are_left_alone() {
        let surface = times(&[(Frame::SENT, 1, 100), (Frame::RECEIVED, 2, 260)]);
        let vehicle = times(&[(Frame::RECEIVED, 1, 150), (Frame::SENT, 2, 200)]);
        assert_eq!(vehicle.shift_to(&surface), 0);
        assert!(vehicle.meets(&surface) && !vehicle.meets(&times(&[(Frame::SENT, 3, 100), (Frame::SENT, 2, 100)])));
    }

    #[test]
    fn a_clock_that_is_ahead_is_set_back_by_frames_of_both_ways() {
        let surface = times(&[(Frame::SENT, 1, 100), (Frame::RECEIVED, 2, 250), (Frame::RECEIVED, 3, 800)]);
        let vehicle = times(&[(Frame::RECEIVED, 1, 5150), (Frame::SENT, 2, 5200), (Frame::SENT, 3, 5600)]);
        assert_eq!(vehicle.shift_to(&surface), -5000);
    }

    #[test]
    fn frames_of_one_direction_are_enough_and_lost_ones_say_nothing() {
        let surface = times(&[(Frame::RECEIVED, 2, 250)]);
        let vehicle = times(&[(Frame::SENT, 2, 5200), (Frame::SENT, 4, 1)]);
        assert_eq!(vehicle.shift_to(&surface), -4950);
        assert_eq!(times(&[]).shift_to(&surface), 0);
    }

    #[test]
    fn bytes_that_were_sent_before_the_record_began_move_no_clock() {
        let s = 1_000_000_000;
        // Frame 1 was sent at 0 too, before the surface recorded; its second copy was lost, and that of frame 2 was not.
        let surface = times(&[
            (Frame::SENT, 1, 154 * s),
            (Frame::SENT, 2, 160 * s),
            (Frame::SENT, 3, 170 * s),
            (Frame::SENT, 4, 180 * s),
            (Frame::RECEIVED, 9, 201 * s),
        ]);
        let vehicle = times(&[
            (Frame::RECEIVED, 1, s),
            (Frame::RECEIVED, 2, s),
            (Frame::RECEIVED, 2, 161 * s),
            (Frame::RECEIVED, 3, 171 * s),
            (Frame::RECEIVED, 4, 181 * s),
            (Frame::SENT, 9, 200 * s),
        ]);
        assert_eq!(vehicle.shift_to(&surface), 0);
        let fates: Vec<_> =
            surface.fates(&vehicle, 0).into_iter().map(|f| (f.sent / s, f.received.map(|at| at / s))).collect();
        let after = [(154, None), (160, Some(161)), (170, Some(171)), (180, Some(181))];
        assert_eq!(fates, [[(0, Some(1)), (0, Some(1))].as_slice(), &after].concat());
    }

    #[test]
    fn one_copy_that_no_record_has_moves_no_clock() {
        let s = 1_000_000_000;
        let (mut surface, mut vehicle) = (Vec::new(), vec![(Frame::SENT, 200, 900 * s)]);
        for byte in 0..40u8 {
            let sent = (100 + 10 * u64::from(byte)) * s;
            surface.push((Frame::SENT, byte, sent));
            // Of frame 7, a copy was received that was sent while the surface recorded nothing.
            vehicle.push((Frame::RECEIVED, byte, if byte == 7 { sent - 10 * s } else { sent + s }));
        }
        surface.push((Frame::RECEIVED, 200, 901 * s));
        let (surface, vehicle) = (times(&surface), times(&vehicle));
        assert_eq!(vehicle.shift_to(&surface), 0);
        let fates = surface.fates(&vehicle, 0);
        assert_eq!(fates.len(), 41, "the copy, and one that was lost");
        assert!(fates.iter().all(|frame| frame.received.is_none_or(|at| at >= frame.sent)), "{fates:?}");
        // A clock that is wrong is still set.
        let late: Vec<_> = (0..40u8).map(|byte| (Frame::RECEIVED, byte, (151 + 10 * u64::from(byte)) * s)).collect();
        let late = times(&[late, vec![(Frame::SENT, 200, 950 * s)]].concat());
        assert_eq!(late.shift_to(&surface), -50 * s as i64);
    }

    #[test]
    fn a_short_frame_may_be_much_quicker_than_long_ones() {
        let ms = 1_000_000;
        let (mut vehicle, mut surface) = (FrameTimes::default(), FrameTimes::default());
        for byte in 0..11u8 {
            // The surface's clock is 60 s behind, and nothing of the surface is heard.
            let (sent, data) = ((100 + 10 * u64::from(byte)) * 1000 * ms, vec![byte; if byte == 4 { 8 } else { 64 }]);
            let arrival = sent - 60_000 * ms + if byte == 4 { 500 } else { 4000 } * ms;
            vehicle.take(sent, &Frame { direction: Frame::SENT, data: data.clone(), ..Frame::default() });
            surface.take(arrival, &Frame { direction: Frame::RECEIVED, data, ..Frame::default() });
        }
        let shift = vehicle.shift_to(&surface);
        let fates = vehicle.fates(&surface, shift);
        assert_eq!((shift, fates.len()), (-59_500 * ms as i64, 11));
        assert!(fates.iter().all(|frame| frame.received.is_some()));
    }

    #[test]
    fn each_frame_is_received_or_lost_also_where_its_bytes_repeat() {
        // Frames take 400; the first copy of frame 1 arrives after the second was sent.
        let sent = [(Frame::SENT, 1, 100), (Frame::SENT, 1, 300), (Frame::SENT, 2, 500), (Frame::SENT, 3, 700)];
        let received = [(Frame::RECEIVED, 1, 1510), (Frame::RECEIVED, 1, 1515), (Frame::RECEIVED, 2, 1900)];
        let fates = times(&sent).fates(&times(&received), 1000);
        let found: Vec<_> = fates.into_iter().map(|f| (f.sent, f.received, f.arrives)).collect();
        let expected = [(100, Some(510), 510), (300, None, 710), (500, Some(900), 900), (700, None, 1100)];
        assert_eq!(found, expected);
    }

    #[test]
    fn long_frames_take_longer_than_short_ones() {
        let frame = |direction: u8, length: usize, nanos: u64, times: &mut FrameTimes| {
            times.take(nanos, &Frame { direction, data: vec![7; length], ..Default::default() });
        };
        let (mut vehicle, mut surface) = (FrameTimes::default(), FrameTimes::default());
        for (at, length) in [(0, 10), (1000, 20), (2000, 30)] {
            frame(Frame::SENT, length, at, &mut vehicle);
            frame(Frame::RECEIVED, length, at + 100 + 10 * length as u64, &mut surface);
        }
        frame(Frame::SENT, 50, 3000, &mut vehicle);
        assert_eq!(vehicle.fates(&surface, 0).last().map(|frame| frame.arrives), Some(3600));
    }

    #[test]
    fn mission_times_follow_the_states_and_reach_beyond_them() {
        let mut clock = MissionClock::default();
        assert_eq!(clock.mission_s(5), None);
        let state = |now_s: f64, speed: f64| {
            StateTime::of_json(&format!(r#"{{"now_s":{now_s},"mission":{{"speed":{speed}}}}}"#)).unwrap()
        };
        clock.take(20_000_000_000, state(100.0, 4.0));
        clock.take(10_000_000_000, state(80.0, 2.0));
        assert!(StateTime::of_json("{}").is_none());
        let at = |s: u64| clock.mission_s(s * 1_000_000_000);
        assert_eq!([5, 15, 20, 25].map(at), [70.0, 90.0, 100.0, 120.0].map(Some));
        assert_eq!(clock.speed(30_000_000_000), 4.0);
        let back = |at_s| clock.nanos(at_s).map(|nanos| nanos / 1_000_000_000);
        assert_eq!([70.0, 90.0, 120.0].map(back), [5, 15, 25].map(Some));
    }
}
