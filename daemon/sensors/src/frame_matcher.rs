//! Images wait for the pose at their time; each becomes a frame, or is dropped with a reason.

use crate::{CameraFault, CameraTally, PoseMatch, PoseTrack, SensorPose, Stamp};
use std::collections::VecDeque;
use std::time::Duration;

/// How long images wait for poses, and how many wait at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest time between two poses within which poses are interpolated.
    pub max_gap: Duration,
    /// Longest time that an image waits for a pose.
    pub max_wait: Duration,
    /// Most images that wait for a pose or for the scene model; beyond it the oldest one is dropped.
    pub max_images: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_gap: Duration::from_secs(1), max_wait: Duration::from_secs(2), max_images: 8 }
    }
}

/// An image with the pose at its time.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedImage<I> {
    pub image: I,
    pub stamp: Stamp,
    pub pose: SensorPose,
    /// Seconds since the first image of the mission; they never go back.
    pub t_s: f64,
}

struct Waiting<I> {
    stamp: Stamp,
    arrival: Stamp,
    image: I,
}

/// Matches images with poses by their stamps. Stamps are of the clock that cameras and poses share, arrivals of this computer's
/// clock, which never goes back.
pub struct FrameMatcher<I> {
    limits: Limits,
    track: PoseTrack,
    waiting: VecDeque<Waiting<I>>,
    /// The newest image that was taken in.
    newest: Option<Stamp>,
    /// Images in a row from before the newest one, and the stamp of the last of them.
    earlier: (u32, Option<Stamp>),
    /// Stamp, arrival and mission time of the last matched image.
    last: Option<(Stamp, Stamp, f64)>,
    start_s: f64,
    delays: Delays,
    tally: CameraTally,
}

/// Mean time between the stamps and the arrivals of images and of poses, seconds.
#[derive(Debug, Clone, Copy, Default)]
struct Delays {
    image_s: Option<f64>,
    pose_s: Option<f64>,
}

/// A mean in which the newest value has a tenth of the weight.
fn follow(mean: &mut Option<f64>, value: f64) {
    *mean = Some(mean.map_or(value, |mean| mean + 0.1 * (value - mean)));
}

/// Images that are earlier than the newest one by more than this may be of another clock.
const JUMP: Duration = Duration::from_secs(1);

/// Images in a row from which a clock that went back is believed.
const JUMP_IMAGES: u32 = 3;

impl<I> FrameMatcher<I> {
    /// The first image has the mission time `start_s`.
    pub fn new(limits: Limits, start_s: f64) -> Self {
        Self {
            limits,
            track: PoseTrack::new(limits.max_gap),
            waiting: VecDeque::new(),
            newest: None,
            earlier: (0, None),
            last: None,
            start_s,
            delays: Delays::default(),
            tally: CameraTally::default(),
        }
    }

    /// Takes all poses of a mission, in order of time; those in a file need no time of arrival.
    pub fn set_poses(&mut self, poses: impl IntoIterator<Item = (Stamp, SensorPose)>) {
        self.track = PoseTrack::of(poses, self.limits.max_gap);
        (0..self.track.unreachable()).for_each(|_| self.tally.count(CameraFault::PoseJump));
    }

    /// Takes a pose of the time `stamp` that came in at `arrival`.
    pub fn handle_pose(&mut self, stamp: Stamp, arrival: Stamp, pose: SensorPose) {
        follow(&mut self.delays.pose_s, arrival.seconds_since(stamp));
        let last = self.track.last();
        if self.track.push(stamp, pose) {
            self.tally.count(CameraFault::PoseClockJump);
        } else if last.is_some_and(|(last, _)| stamp.seconds_since(last) > self.limits.max_gap.as_secs_f64()) {
            self.tally.count(CameraFault::PoseGap);
        }
    }

    /// Takes an image of the time `stamp` that came in at `arrival`.
    pub fn handle_image(&mut self, stamp: Stamp, arrival: Stamp, image: I) {
        if self.is_in_future(stamp) {
            self.tally.count(CameraFault::NoPose);
            return;
        }
        if self.newest.is_some_and(|newest| stamp <= newest) && !self.is_clock_back(stamp) {
            self.tally.count(CameraFault::NotLater);
            return;
        }
        follow(&mut self.delays.image_s, arrival.seconds_since(stamp));
        self.earlier = (0, None);
        self.newest = Some(stamp);
        self.waiting.push_back(Waiting { stamp, arrival, image });
        while self.waiting.len() > self.limits.max_images.max(1) {
            self.waiting.pop_front();
            self.tally.count(CameraFault::Overtaken);
        }
    }

    /// Whether the time is so much later than the last pose that no pose for it would come in while the image waits. Such an
    /// image must not stand before others, nor make them count as old ones.
    fn is_in_future(&self, stamp: Stamp) -> bool {
        let most_s = (self.limits.max_wait + self.limits.max_gap).as_secs_f64();
        self.track.last().is_some_and(|(last, _)| stamp.seconds_since(last) > most_s)
    }

    /// Whether this image confirms that the camera's clock went back; then the images of the former clock are dropped.
    fn is_clock_back(&mut self, stamp: Stamp) -> bool {
        let is_earlier = self.newest.is_some_and(|newest| stamp.after(JUMP) < newest);
        let (count, last) = self.earlier;
        let follows = last.is_none_or(|last| stamp > last);
        self.earlier = if is_earlier && follows { (count + 1, Some(stamp)) } else { (0, None) };
        if self.earlier.0 < JUMP_IMAGES {
            return false;
        }
        self.tally.count(CameraFault::CameraClockJump);
        self.waiting.drain(..).for_each(|_| self.tally.count(CameraFault::NoPose));
        true
    }

    /// The next image whose pose is known at `now`, in order of time. Images that cannot be matched any more are dropped.
    pub fn poll_frame(&mut self, now: Stamp) -> Option<MatchedImage<I>> {
        while let Some(first) = self.waiting.front() {
            let is_overdue = now.seconds_since(first.arrival) >= self.limits.max_wait.as_secs_f64();
            let pose = match self.track.at(first.stamp) {
                PoseMatch::Found(pose) => Some(pose),
                PoseMatch::NotYet if !is_overdue => return None,
                PoseMatch::NotYet | PoseMatch::Gap | PoseMatch::TooEarly => None,
            };
            let Waiting { stamp, arrival, image } = self.waiting.pop_front()?;
            let Some(pose) = pose else {
                self.tally.count(CameraFault::NoPose);
                self.forget_future(stamp);
                continue;
            };
            let t_s = match self.last {
                Some((last, _, t_s)) if stamp > last => t_s + stamp.seconds_since(last),
                // The camera's clock went back: the arrivals tell the time between.
                Some((_, last_arrival, t_s)) => t_s + arrival.seconds_since(last_arrival).max(0.0),
                None => self.start_s,
            };
            self.last = Some((stamp, arrival, t_s));
            self.tally.matched += 1;
            return Some(MatchedImage { image, stamp, pose, t_s });
        }
        None
    }

    /// An image of a wrong, later time must not make the images behind it count as old ones.
    fn forget_future(&mut self, stamp: Stamp) {
        if self.newest == Some(stamp) {
            self.newest = self.last.map(|(last, ..)| last);
        }
    }

    /// The moment at which [`Self::poll_frame`] drops an image unless a pose comes in.
    pub fn poll_timeout(&self) -> Option<Stamp> {
        self.waiting.front().map(|first| first.arrival.after(self.limits.max_wait))
    }

    /// The times of the images that wait.
    pub fn waiting(&self) -> impl Iterator<Item = Stamp> + '_ {
        self.waiting.iter().map(|waiting| waiting.stamp)
    }

    /// The times of images and poses, for people who look for a wrong clock.
    pub fn times(&self) -> String {
        let newest = self.newest.or(self.last.map(|(last, ..)| last));
        let image = newest.map_or("no image".to_owned(), |stamp| format!("the last image is of {stamp}"));
        let pose = self.track.last().map_or("no pose".to_owned(), |(stamp, _)| format!("the last pose of {stamp}"));
        let delay = |what: &str, s: Option<f64>| {
            s.map_or(String::new(), |s| format!("; {what} arrive {s:.3} s after their times"))
        };
        let (images, poses) = (delay("images", self.delays.image_s), delay("poses", self.delays.pose_s));
        format!("{image}, {pose}{images}{poses}")
    }

    /// The last pose and its stamp.
    pub fn last_pose(&self) -> Option<(Stamp, SensorPose)> {
        self.track.last()
    }

    pub fn tally(&self) -> &CameraTally {
        &self.tally
    }

    /// Counts a fault that was found elsewhere.
    pub fn count(&mut self, fault: CameraFault) {
        self.tally.count(fault);
    }

    /// A matched image was dropped after all.
    pub fn drop_matched(&mut self, fault: CameraFault) {
        self.tally.matched = self.tally.matched.saturating_sub(1);
        self.tally.count(fault);
    }

    /// Drops images that have waited for the scene model longer than [`Limits::max_wait`], as long as a newer one has a pose.
    pub fn keep_recent(&mut self, now: Stamp) {
        while let (Some(first), Some(next)) = (self.waiting.front(), self.waiting.get(1)) {
            let is_late = now.seconds_since(first.arrival) > self.limits.max_wait.as_secs_f64();
            if !is_late || !matches!(self.track.at(next.stamp), PoseMatch::Found(_)) {
                return;
            }
            self.waiting.pop_front();
            self.tally.count(CameraFault::Overtaken);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(s: f64) -> Stamp {
        Stamp::from_nanos((s * 1e9).round() as i64)
    }

    fn pose(x_m: f64) -> SensorPose {
        SensorPose { x_m, ..SensorPose::default() }
    }

    fn frames(matcher: &mut FrameMatcher<u32>, now: f64) -> Vec<(u32, f64)> {
        std::iter::from_fn(|| matcher.poll_frame(at(now))).map(|frame| (frame.image, frame.pose.x_m)).collect()
    }

    #[test]
    fn an_image_waits_for_the_pose_after_it() {
        let mut matcher = FrameMatcher::new(Limits::default(), 5.0);
        matcher.handle_pose(at(100.0), at(100.0), pose(0.0));
        matcher.handle_image(at(100.5), at(7.0), 1);
        assert_eq!(frames(&mut matcher, 7.5), []);
        matcher.handle_pose(at(101.0), at(101.0), pose(2.0));
        let frame = matcher.poll_frame(at(7.6)).unwrap();
        assert_eq!((frame.image, frame.pose.x_m, frame.t_s), (1, 1.0, 5.0));
        matcher.handle_image(at(101.0), at(8.0), 2);
        assert_eq!(matcher.poll_frame(at(8.0)).unwrap().t_s, 5.5);
        assert_eq!(matcher.tally().to_string(), "2 images mapped, 0 dropped");
    }

    #[test]
    fn without_a_pose_at_its_time_an_image_is_dropped_and_named() {
        let mut matcher = FrameMatcher::new(Limits::default(), 0.0);
        matcher.handle_pose(at(100.0), at(100.0), pose(0.0));
        matcher.handle_image(at(99.0), at(1.0), 1);
        matcher.handle_image(at(102.0), at(1.1), 2);
        assert_eq!(matcher.poll_timeout(), Some(at(3.0)));
        assert_eq!(frames(&mut matcher, 3.2), []);
        matcher.handle_pose(at(101.0), at(101.0), pose(1.0));
        matcher.handle_image(at(101.0), at(3.3), 3);
        assert_eq!(frames(&mut matcher, 3.4), [(3, 1.0)]);
        let text = matcher.tally().to_string();
        assert_eq!(text, "1 images mapped, 2 dropped (no pose at its time 2)");
    }

    #[test]
    fn an_image_from_the_future_does_not_hold_up_the_next_ones() {
        let mut matcher = FrameMatcher::new(Limits::default(), 0.0);
        matcher.handle_pose(at(100.0), at(1.0), pose(0.0));
        matcher.handle_image(at(9000.0), at(1.0), 1);
        matcher.handle_image(at(100.0), at(1.1), 2);
        assert_eq!(frames(&mut matcher, 1.2), [(2, 0.0)]);
        assert_eq!(matcher.tally().of(CameraFault::NoPose), 1);
    }

    #[test]
    fn the_newest_images_are_kept_when_the_model_is_slow() {
        let mut matcher = FrameMatcher::new(Limits { max_images: 2, ..Limits::default() }, 0.0);
        (0..5).for_each(|i| matcher.handle_pose(at(f64::from(i)), at(f64::from(i)), pose(f64::from(i))));
        (0..5).for_each(|i| matcher.handle_image(at(f64::from(i)), at(f64::from(i)), i));
        assert_eq!(frames(&mut matcher, 5.0), [(3, 3.0), (4, 4.0)]);
        assert_eq!(matcher.tally().of(CameraFault::Overtaken), 3);
    }

    #[test]
    fn a_slow_model_gets_the_images_of_the_last_two_seconds() {
        let mut matcher = FrameMatcher::new(Limits::default(), 0.0);
        (0..4).for_each(|i| matcher.handle_pose(at(f64::from(i)), at(f64::from(i)), pose(f64::from(i))));
        (0..6).for_each(|i| matcher.handle_image(at(f64::from(i)), at(f64::from(i)), i));
        matcher.keep_recent(at(4.5));
        assert_eq!(matcher.tally().of(CameraFault::Overtaken), 3);
        assert_eq!(frames(&mut matcher, 4.5), [(3, 3.0)]);
    }

    #[test]
    fn a_restarted_camera_with_an_earlier_clock_is_mapped_again() {
        let mut matcher = FrameMatcher::new(Limits::default(), 0.0);
        matcher.handle_pose(at(500.0), at(500.0), pose(0.0));
        matcher.handle_image(at(500.0), at(1.0), 0);
        assert_eq!(frames(&mut matcher, 1.0), [(0, 0.0)]);
        for i in 1..8_u32 {
            let s = 0.5 * f64::from(i);
            matcher.handle_pose(at(s), at(s), pose(s));
            matcher.handle_image(at(s), at(1.0 + s), i);
        }
        assert_eq!(frames(&mut matcher, 5.0), [(3, 1.5), (4, 2.0), (5, 2.5), (6, 3.0), (7, 3.5)]);
        assert_eq!(matcher.tally().of(CameraFault::CameraClockJump), 1);
        assert_eq!(matcher.tally().of(CameraFault::PoseClockJump), 1);
        assert_eq!(matcher.tally().of(CameraFault::NotLater), 2);
    }

    proptest! {
        /// Whatever comes in: each image is mapped at the pose of its time, or counted as dropped, and time never goes back.
        #[test]
        fn no_image_is_mapped_at_another_pose(events in prop::collection::vec((any::<bool>(), 0_u32..400, 0_u32..40), 0..200)) {
            let mut matcher = FrameMatcher::new(Limits::default(), 0.0);
            let (mut now, mut given, mut last_s) = (0.0, 0, 0.0);
            for (is_pose, stamp, later) in events {
                now += f64::from(later) / 10.0;
                let s = f64::from(stamp) / 10.0;
                if is_pose {
                    // The pose is a function of the time.
                    matcher.handle_pose(at(s), at(s), pose(3.0 * s));
                } else {
                    matcher.handle_image(at(s), at(now), stamp);
                    given += 1;
                }
                while let Some(frame) = matcher.poll_frame(at(now)) {
                    prop_assert!((frame.pose.x_m - 0.3 * f64::from(frame.image)).abs() < 1e-6);
                    prop_assert!(frame.t_s >= last_s);
                    last_s = frame.t_s;
                }
            }
            while matcher.poll_frame(at(now + 100.0)).is_some() {}
            prop_assert_eq!(matcher.tally().matched + matcher.tally().dropped(), given);
        }
    }
}
