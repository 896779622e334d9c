//! The scene model's own thread, fed by the camera, and images that place the frames elsewhere than the navigation source does.

use super::checkpoint::Keep;
use crate::camera::{CameraFrame, FramePicture, ReadFrame};
use scene_model::project::Pose;
use scenecast_config::{AutopilotKind, Config};
use scenecast_core::UserError;
use scenecast_protocol::directive::Settings;
use scenecast_sensors::{DepthError, ImageSize};
use scenecast_vehicle::{CameraFinding, Frame, MapChanges, MapProducer, Mapper, RegisteredFrame, SharedExemplars};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// A request to the mapper's thread.
pub(super) enum ToMapper {
    Tune(Settings),
    Frame(Box<CameraFrame>),
    Keep,
}

/// A report of the mapper's thread.
pub(super) enum FromMapper {
    /// What a camera frame has changed of the map, or the map at the start of the run.
    Mapped(Box<Mapped>),
    /// A camera frame that could not be read.
    Missed(UserError),
    /// A checkpoint was refused, or the first one after a refusal was written.
    Checkpoint { is_refused: bool },
}

/// The mapper's results after a camera frame.
pub(super) struct Mapped {
    /// `None` at the start, when the map is that of a checkpoint.
    pub(super) frame: Option<CameraFrame>,
    /// The place of a frame that was mapped.
    pub(super) registered: Option<RegisteredFrame>,
    pub(super) changes: MapChanges,
    /// The best images of each label so far.
    pub(super) exemplars: SharedExemplars,
    /// Why distances that came with the frame were not used.
    pub(super) unusable_depth: Option<DepthError>,
}

pub(super) struct MapperThread {
    pub(super) orders: mpsc::UnboundedSender<ToMapper>,
    pub(super) mapped: mpsc::Receiver<FromMapper>,
    thread: JoinHandle<()>,
}

impl MapperThread {
    /// Starts the thread with a mapper, the settings in force, and the schedule of its checkpoints.
    pub(super) fn start(
        mut mapper: Mapper,
        config: &Config,
        settings: &Settings,
        keep: Keep,
    ) -> Result<Self, UserError> {
        mapper.tune(settings);
        if config.autopilot.kind != AutopilotKind::None {
            // The odometry of an autopilot starts again with each run.
            mapper.handle_gap();
        }
        mapper.check_camera();
        let (orders, incoming) = mpsc::unbounded_channel();
        let (outgoing, mapped) = mpsc::channel(4);
        let size = ImageSize::default();
        let work = move || Work { mapper, keep, outgoing, is_refusal_reported: false, size }.run(incoming);
        let thread = std::thread::Builder::new().name("scene-model".to_owned()).spawn(work);
        let thread = thread.map_err(|e| UserError::Failed(format!("the scene model's thread did not start: {e}")))?;
        Ok(Self { orders, mapped, thread })
    }

    /// Waits until the thread has kept its last checkpoint.
    pub(super) fn finish(self) {
        drop((self.orders, self.mapped));
        if self.thread.join().is_err() {
            tracing::error!("the scene model's thread has panicked: its changes since the last checkpoint are lost");
        }
    }
}

struct Work {
    mapper: Mapper,
    keep: Keep,
    outgoing: mpsc::Sender<FromMapper>,
    /// Whether the host knows that the last checkpoint was refused.
    is_refusal_reported: bool,
    /// Of images without a calibration, and of pixels as configured.
    size: ImageSize,
}

impl Work {
    /// Handles requests until the host is gone, then keeps a last checkpoint.
    fn run(mut self, mut incoming: mpsc::UnboundedReceiver<ToMapper>) {
        let mut is_host_alive = true;
        if self.mapper.last_s().is_some() {
            is_host_alive = self.report_unmapped(None, self.mapper.current());
        }
        while is_host_alive && let Some(order) = incoming.blocking_recv() {
            match order {
                ToMapper::Tune(settings) => self.mapper.tune(&settings),
                ToMapper::Keep => {
                    self.keep.keep_now(&self.mapper);
                    is_host_alive = self.report_checkpoint();
                }
                // A frame beyond the frame rate only changes the vehicle's pose.
                ToMapper::Frame(frame) if !self.mapper.takes(frame.t_s) => {
                    is_host_alive = self.report_unmapped(Some(*frame), self.mapper.unchanged());
                }
                ToMapper::Frame(frame) => {
                    let report = self.see(*frame);
                    // The checkpoint comes first, so that it contains every label that the surface receives.
                    self.keep.keep_if_due(&self.mapper);
                    is_host_alive = self.report_checkpoint() && self.report(report);
                }
            }
        }
        self.keep.keep_now(&self.mapper);
    }

    fn report(&self, report: FromMapper) -> bool {
        self.outgoing.blocking_send(report).is_ok()
    }

    /// Sends whether checkpoints are refused, if that has changed.
    fn report_checkpoint(&mut self) -> bool {
        let is_refused = self.keep.is_refused;
        let is_known = std::mem::replace(&mut self.is_refusal_reported, is_refused) == is_refused;
        is_known || self.report(FromMapper::Checkpoint { is_refused })
    }

    /// Sends changes without a new frame in them.
    fn report_unmapped(&mut self, frame: Option<CameraFrame>, changes: MapChanges) -> bool {
        let mapped = self.mapped(frame, None, changes);
        self.report(FromMapper::Mapped(Box::new(mapped)))
    }

    fn see(&mut self, mut frame: CameraFrame) -> FromMapper {
        // A recording may say by its scale that images of other sizes show as much.
        let has_one_size = matches!(frame.picture, FramePicture::Received(_)) || frame.scale == 1.0;
        let read = frame.take_image().and_then(|read| match &read.view {
            None if has_one_size => self.size.check(read.image.dimensions()).map(|()| read).map_err(UserError::input),
            _ => Ok(read),
        });
        match read {
            Ok(ReadFrame { image, view, unusable_depth }) => {
                let at = &frame.pose;
                let pose = Pose { x: at.x_m, y: at.y_m, z: -at.depth_m, yaw_rad: -at.heading_rad };
                let shot = Frame { image: &image, pose, scale: frame.scale, view: view.as_ref() };
                let placed = self.mapper.register(&shot);
                match self.mapper.poll_camera_finding() {
                    Some(CameraFinding::AsConfigured(text)) => tracing::info!("camera: {text}"),
                    Some(CameraFinding::Wrong(advice)) => tracing::warn!("camera: {advice}"),
                    None => {}
                }
                let changes = self.mapper.handle_frame(&shot.placed(&placed), frame.t_s);
                let mapped = self.mapped(Some(frame), Some(placed), changes);
                FromMapper::Mapped(Box::new(Mapped { unusable_depth, ..mapped }))
            }
            Err(error) => FromMapper::Missed(error),
        }
    }

    fn mapped(
        &mut self,
        frame: Option<CameraFrame>,
        registered: Option<RegisteredFrame>,
        changes: MapChanges,
    ) -> Mapped {
        Mapped { frame, registered, changes, exemplars: self.mapper.shared_exemplars(), unusable_depth: None }
    }
}

/// Distance beyond which images and poses disagree, metres; and the part of the track for the drift of images, which have no
/// absolute place.
const LIMITS: (f64, f64) = (5.0, 0.05);
/// Time between two lines of the log.
const PAUSE: Duration = Duration::from_secs(60);

/// Compares where images and poses of a navigation source place the frames.
#[derive(Debug, Default)]
pub(crate) struct Disagreement {
    last: Option<(f64, f64)>,
    track_m: f64,
    logged: Option<Instant>,
}

impl Disagreement {
    /// Takes the places of a frame by its pose and by its image, metres; returns a line for the log if they are far apart.
    pub(crate) fn handle(&mut self, pose: (f64, f64), image: (f64, f64), now: Instant) -> Option<String> {
        let apart = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
        self.track_m += self.last.replace(pose).map_or(0.0, |last| apart(last, pose));
        let apart_m = apart(pose, image);
        let is_far = apart_m > LIMITS.0 + LIMITS.1 * self.track_m;
        if !is_far || self.logged.is_some_and(|at| now.duration_since(at) < PAUSE) {
            return None;
        }
        self.logged = Some(now);
        Some(format!(
            "images and poses disagree: they place a frame {apart_m:.0} m apart after {:.0} m of track. Check camera.mount_deg and \
             the size of pixels (camera.metres_per_pixel, the calibration, the altitude); registration.enabled = false maps by \
             the poses alone",
            self.track_m
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checkpoint::CheckpointFile;
    use crate::journal::Folder;
    use image::{Rgb, RgbImage};
    use scenecast_files::{FrameImage, RecordedFrame};

    #[test]
    fn refused_checkpoints_are_reported_until_one_is_written() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-refused-checkpoint", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        let in_the_way = dir.join("scene.checkpoint.part");
        std::fs::create_dir_all(&in_the_way).unwrap();
        let image = dir.join("frame.png");
        RgbImage::from_fn(160, 120, |x, y| Rgb([x as u8, y as u8, (x * y % 31) as u8])).save(&image).unwrap();
        let config = scenecast_config::load(None, &[]).unwrap();
        let mapper = Mapper::new(&config, None, 0, 1).unwrap();
        let file = CheckpointFile::new(Folder::hold(&dir).unwrap());
        let keep = Keep { file, lineage: 1, every_s: 1.0, last_s: None, is_refused: false };
        let mut thread = MapperThread::start(mapper, &config, &Settings::default(), keep).unwrap();
        let mut reports = |t_s: f64| {
            let (x_m, y_m, depth_m, heading_rad, scale) = (0.0, 0.0, 4.0, 0.0, 1.0);
            let shot = FrameImage::File(image.clone());
            let frame =
                RecordedFrame { t_s, image: shot, x_m, y_m, depth_m, heading_rad, scale, geometry: None, depth: None };
            assert!(thread.orders.send(ToMapper::Frame(Box::new(frame.into()))).is_ok());
            let mut reports: Vec<bool> = Vec::new();
            loop {
                match thread.mapped.blocking_recv().unwrap() {
                    FromMapper::Checkpoint { is_refused } => reports.push(is_refused),
                    FromMapper::Mapped(_) => return reports,
                    FromMapper::Missed(error) => panic!("{error}"),
                }
            }
        };
        assert!(reports(0.0).is_empty(), "none is due");
        assert_eq!(reports(2.0), [true]);
        assert!(reports(4.0).is_empty(), "it is known");
        std::fs::remove_dir(&in_the_way).unwrap();
        assert_eq!(reports(6.0), [false]);
        thread.finish();
    }

    #[test]
    fn a_wrong_mounting_is_logged_once_a_minute() {
        let (mut disagreement, began) = (Disagreement::default(), Instant::now());
        let mut at = |s: u64, turn: f64| {
            let north = s as f64;
            let image = (north * turn.sin(), north * turn.cos());
            disagreement.handle((0.0, north), image, began + Duration::from_secs(s))
        };
        assert!((0..4).all(|s| at(s, 1.5).is_none()), "near the start they are near each other");
        let said: Vec<u64> = (4..100).filter(|s| at(*s, 1.5).is_some()).collect();
        assert_eq!(said, [4, 64]);
        let mut drifting = Disagreement::default();
        let good = (0..1000).all(|s| drifting.handle((0.0, f64::from(s)), (0.0, 1.03 * f64::from(s)), began).is_none());
        assert!(good, "images drift");
    }
}
