//! Places camera frames by their overlap with earlier ones before they are mapped, and shows the operator how well.

use crate::frame::{Frame, Nadir};
use crate::mapper::Mapper;
use crate::placer::FoundFrame;
use scene_model::project::Pose;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::wire::{FrameTie, RegistrationReport};
use scenecast_registration::{CameraFinding, CameraImage, FrameInput, Tally};

/// A frame's place on the map.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisteredFrame {
    pub pose: Pose,
    /// The size of a pixel on the sea floor, divided by the configured size.
    pub scale: f64,
    /// The place by dead reckoning.
    pub dead_reckoned: MapPoint,
    /// What the registration found; `None` where frames were never registered.
    pub found: Option<FoundFrame>,
}

impl RegisteredFrame {
    /// Whether the frame overlaps with an earlier one, as the images show.
    pub fn is_seen(&self) -> bool {
        self.found.as_ref().is_some_and(|found| found.placed.is_chained || found.placed.loops > 0)
    }
}

/// The pose in steps of 2^-30 metres and radians, so that sources of the same pose in other forms, such as degrees and
/// quaternions, give the same map.
fn on_grid(pose: &Pose) -> Pose {
    const STEPS: f64 = (1 << 30) as f64;
    let round = |value: f64| (value * STEPS).round() / STEPS;
    Pose { x: round(pose.x), y: round(pose.y), z: round(pose.z), yaw_rad: round(pose.yaw_rad) }
}

impl Frame<'_> {
    /// The frame at the place by registration.
    #[must_use]
    pub fn placed(&self, at: &RegisteredFrame) -> Self {
        Self { pose: at.pose, scale: at.scale, ..*self }
    }
}

impl Mapper {
    /// Places a frame that was taken by dead reckoning, compass and altitude. A vehicle that never registered frames places
    /// it there; one on which registration was switched off continues from the last frame's place by odometry and compass,
    /// so that the map does not jump.
    ///
    /// Frames are compared as flat images. Of one with measured distances the median is the altitude, and the place that is
    /// found moves the camera as a whole. A frame that is tilted by more than 0.6 radians is not compared with others.
    pub fn register(&mut self, frame: &Frame<'_>) -> RegisteredFrame {
        let (pose, size) = (on_grid(&frame.pose), frame.image.dimensions());
        let dead_reckoned = MapPoint::new(pose.x, pose.y);
        let nadir = frame.view.and_then(|view| Nadir::of(view, size));
        let scale = nadir.map_or(frame.scale, |nadir| nadir.metres_per_pixel / self.metres_per_pixel());
        let unregistered = RegisteredFrame { pose, scale, dead_reckoned, found: None };
        if frame.view.is_some() && nadir.is_none() {
            let distance_m = frame.view.and_then(|view| Some(view.metres_per_pixel(view.distance_m(size)?)));
            let scale = distance_m.map_or(1.0, |metres_per_pixel| metres_per_pixel / self.metres_per_pixel());
            return RegisteredFrame { scale, ..unregistered };
        }
        let metres_per_pixel = scale * self.metres_per_pixel();
        let image = CameraImage::rgb(size.0 as usize, size.1 as usize, frame.image.as_raw());
        let Some(image) = image else { return unregistered };
        let above = nadir.map_or(pose, |nadir| nadir.above(&pose));
        let (place, compass_rad) = (MapPoint::new(above.x, above.y), -pose.yaw_rad);
        let input = FrameInput { image, metres_per_pixel, dead_reckoned: place, compass_rad };
        let Some(found) = self.placer.place(&input) else { return unregistered };
        let placed = &found.placed;
        let (x, y) = placed.pose.at().xy();
        let above = Pose { x, y, z: pose.z, yaw_rad: -placed.pose.heading_rad };
        RegisteredFrame {
            pose: nadir.map_or(above, |nadir| nadir.camera(&above, placed.pose.scale())),
            scale: scale * placed.pose.scale(),
            found: Some(found),
            ..unregistered
        }
    }

    /// The vehicle may have moved unmeasured, so that dead reckoning continues at another place.
    pub fn handle_gap(&mut self) {
        self.placer.handle_gap();
    }

    /// The next frames are to show whether the camera is as configured. A simulated one is.
    pub fn check_camera(&mut self) {
        self.placer.check_camera();
    }

    /// What people should know of the camera, once its first frames and odometry have shown it.
    pub fn poll_camera_finding(&mut self) -> Option<CameraFinding> {
        let metres_per_pixel = self.metres_per_pixel();
        self.placer.poll_finding(metres_per_pixel)
    }

    /// What people should know of the camera by all of a recording, if its frames have shown it and it was not told.
    pub fn last_camera_finding(&self) -> Option<CameraFinding> {
        self.placer.last_finding(self.metres_per_pixel())
    }

    /// The evidence of the registration so far; `None` without registration.
    pub fn registration(&self) -> Option<Tally> {
        self.placer.tally()
    }
}

/// Frames that the share of placed ones is taken over.
const RECENT: u32 = 32;

/// Watches the registration of camera frames.
#[derive(Debug, Default)]
pub(crate) struct RegistrationMonitor {
    /// Whether images placed each of the last frames, the newest in the lowest bit.
    recent: u32,
    frames: u32,
    last: Option<RegistrationReport>,
}

impl RegistrationMonitor {
    pub(crate) fn handle_frame(&mut self, frame: &RegisteredFrame) {
        let Some(found) = &frame.found else { return };
        self.recent = self.recent << 1 | u32::from(frame.is_seen());
        self.frames = (self.frames + 1).min(RECENT);
        let tie = match &found.placed {
            _ if !found.is_on => FrameTie::Off,
            placed if placed.loops > 0 => FrameTie::EarlierTrack,
            placed if placed.is_chained => FrameTie::FrameBefore,
            _ => FrameTie::Odometry,
        };
        self.last = Some(RegistrationReport {
            tie,
            share: f64::from(self.recent.count_ones()) / f64::from(self.frames),
            sigma_m: found.placed.sigma_m,
            closed: found.closed.min(u16::MAX.into()) as u16,
        });
    }

    /// `None` before the first frame, and where frames were never registered.
    pub(crate) fn report(&self) -> Option<RegistrationReport> {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MapProducer, Restored};
    use image::{Rgb, RgbImage};
    use scene_model::project::Pose;
    use scenecast_config::Config;
    use scenecast_protocol::coordinates::MapPoint;
    use scenecast_protocol::directive::{Change, Registration, Settings};
    use scenecast_registration::{Evidence, FramePose, Placed};

    fn config(sets: &[&str]) -> Config {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        scenecast_config::load(None, &sets).unwrap()
    }

    /// A frame of a floor of blotches, taken `at` metres north of the start.
    fn frame(at: f64) -> RgbImage {
        RgbImage::from_fn(320, 240, |x, y| {
            let (column, row) = (x / 12, ((f64::from(y) - 100.0 * at + 4000.0) / 12.0) as u32);
            let bits = (column.wrapping_mul(0x9E37_79B9) ^ row.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0xC2B2_AE35);
            Rgb([(bits >> 24) as u8; 3])
        })
    }

    /// The vehicle moves 0.48 m a frame, and believes that it moves 0.50 m.
    fn step(mapper: &mut Mapper, i: u32) -> RegisteredFrame {
        let pose = Pose { x: 0.0, y: 0.5 * f64::from(i), z: -16.0, yaw_rad: 0.0 };
        mapper.register(&Frame::flat(&frame(0.48 * f64::from(i)), pose, 1.0))
    }

    #[test]
    fn frames_are_placed_where_the_images_show_them() {
        let mut mapper = Mapper::new(&config(&["navigation.drift_percent=5"]), None, 0, 1).unwrap();
        let last = (0..12).map(|i| step(&mut mapper, i)).last().unwrap();
        assert!(last.is_seen() && (last.pose.y - 0.48 * 11.0).abs() < 0.02, "{last:?}");
        assert_eq!((last.dead_reckoned, last.pose.z), (MapPoint::new(0.0, 5.5), -16.0));
        assert_eq!(mapper.registration().unwrap().chained, 11);
    }

    #[test]
    fn a_restored_mapper_places_frames_like_the_saved_one() {
        let config = config(&["navigation.drift_percent=5"]);
        let mut whole = Mapper::new(&config, None, 0, 1).unwrap();
        for i in 0..6 {
            step(&mut whole, i);
        }
        let Restored { mapper: mut restored, .. } = Mapper::restore(&config, None, &whole.save(1)).unwrap();
        (6..12).for_each(|i| assert_eq!(step(&mut restored, i), step(&mut whole, i)));
    }

    #[test]
    fn an_order_switches_registration_off_and_on_without_a_jump() {
        let mut mapper = Mapper::new(&config(&["navigation.drift_percent=5"]), None, 0, 1).unwrap();
        let set = |mapper: &mut Mapper, registration| mapper.tune(&Settings { registration, ..Settings::default() });
        let on = (0..6).map(|i| step(&mut mapper, i)).last().unwrap();
        set(&mut mapper, Change::To(Registration::Off));
        let off = step(&mut mapper, 6);
        assert!(on.is_seen() && !off.is_seen());
        let moved = off.pose.y - on.pose.y;
        assert!((0.46..=0.51).contains(&moved), "{moved} m by odometry, as it was learnt");
        set(&mut mapper, Change::Configured);
        let again = (7..10).map(|i| step(&mut mapper, i)).last().unwrap();
        assert!(again.is_seen() && (again.pose.y - 0.48 * 9.0).abs() < 0.06, "{again:?}");
    }

    #[test]
    fn an_order_switches_registration_on_where_it_is_not_configured() {
        let config = config(&["registration.enabled=false", "navigation.drift_percent=5"]);
        let mut mapper = Mapper::new(&config, None, 0, 1).unwrap();
        let before = step(&mut mapper, 0);
        mapper.tune(&Settings { registration: Change::To(Registration::On), ..Settings::default() });
        let last = (1..6).map(|i| step(&mut mapper, i)).last().unwrap();
        assert!(!before.is_seen() && last.is_seen(), "{last:?}");
        let restored = Mapper::restore(&config, None, &mapper.save(1)).unwrap().mapper;
        assert_eq!(restored.registration(), mapper.registration(), "a checkpoint has it, whatever is configured");
    }

    #[test]
    fn without_registration_dead_reckoning_places_the_frames() {
        let mut mapper = Mapper::new(&config(&["registration.enabled=false"]), None, 0, 1).unwrap();
        let last = (0..4).map(|i| step(&mut mapper, i)).last().unwrap();
        assert_eq!((last.pose.y, last.scale, last.is_seen()), (1.5, 1.0, false));
        assert_eq!(mapper.registration(), None);
    }

    fn judged_frame(is_chained: bool, loops: u8, is_on: bool) -> RegisteredFrame {
        let at = MapPoint::new(0.0, 0.0);
        let pose = FramePose::new(at, 0.0, 0.0);
        let placed = Placed { pose, is_chained, loops, sigma_m: 0.1, evidence: Evidence::default() };
        RegisteredFrame {
            pose: Pose { x: 0.0, y: 0.0, z: 0.0, yaw_rad: 0.0 },
            scale: 1.0,
            dead_reckoned: at,
            found: Some(FoundFrame { placed, closed: 70_000, is_on }),
        }
    }

    #[test]
    fn the_report_follows_the_last_frame_and_the_share_the_last_32() {
        let mut monitor = RegistrationMonitor::default();
        assert_eq!(monitor.report(), None);
        let mut see = |is_chained, loops, is_on| {
            monitor.handle_frame(&judged_frame(is_chained, loops, is_on));
            monitor.report().map(|report| (report.tie, report.share)).unwrap()
        };
        assert_eq!(see(false, 0, true), (FrameTie::Odometry, 0.0));
        assert_eq!(see(true, 0, true), (FrameTie::FrameBefore, 0.5));
        assert_eq!(see(true, 2, true), (FrameTie::EarlierTrack, 2.0 / 3.0));
        let last = (0..40).map(|_| see(false, 0, false)).last();
        assert_eq!(last, Some((FrameTie::Off, 0.0)));
        assert_eq!(monitor.report().map(|report| report.closed), Some(u16::MAX));
    }
}
