//! The scene model's own thread, fed by a recorded camera.

use super::clock::Clock;
use crate::auv::{MapUpdate, Mapper};
use crate::config::Config;
use crate::problem::Problem;
use crate::rehearsal::{RecordedFrame, Recording};
use image::RgbImage;
use scene_model::project::Pose;
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::sync::mpsc;

/// What the thread is told.
pub(super) enum ToMapper {
    /// Resample so many words a second.
    RefineRate(u32),
    /// The camera saw something.
    Frame(Box<RecordedFrame>),
}

/// What the thread has made of a camera frame.
pub(super) struct Seen {
    pub(super) frame: RecordedFrame,
    pub(super) update: MapUpdate,
    /// The best image of each label so far.
    pub(super) exemplars: BTreeMap<u8, Arc<RgbImage>>,
}

/// The thread's two ends.
pub(super) struct MapperThread {
    pub(super) orders: mpsc::UnboundedSender<ToMapper>,
    pub(super) seen: mpsc::Receiver<Result<Seen, Problem>>,
}

/// Starts the thread.
pub(super) fn spawn(config: &Config, epoch: u8) -> Result<MapperThread, Problem> {
    let mut mapper = Mapper::new(config, epoch, config.runtime.seed)?;
    let (orders, mut incoming) = mpsc::unbounded_channel();
    let (outgoing, seen) = mpsc::channel(4);
    let work = move || {
        while let Some(order) = incoming.blocking_recv() {
            let result = match order {
                ToMapper::RefineRate(rate) => {
                    mapper.set_refine_rate(rate);
                    continue;
                }
                ToMapper::Frame(frame) => see(&mut mapper, *frame),
            };
            if outgoing.blocking_send(result).is_err() {
                return;
            }
        }
    };
    let thread = std::thread::Builder::new().name("scene-model".to_owned()).spawn(work);
    thread.map_err(|e| Problem::Failed(format!("the scene model's thread did not start: {e}")))?;
    Ok(MapperThread { orders, seen })
}

fn see(mapper: &mut Mapper, frame: RecordedFrame) -> Result<Seen, Problem> {
    let image = frame.image()?;
    let pose = Pose { x: frame.x_m, y: frame.y_m, z: -frame.depth_m, yaw_rad: -frame.heading_rad };
    let update = mapper.handle_frame(&image, &pose, frame.scale, frame.t_s);
    let best = |label| Some((label, Arc::new(mapper.exemplar(label)?.clone())));
    let exemplars = (1..=update.labels).filter_map(best).collect();
    Ok(Seen { frame, update, exemplars })
}

/// The frames of the camera, in order, each at its time; nothing if there is no camera.
pub(super) struct Camera {
    frames: std::iter::Peekable<std::vec::IntoIter<RecordedFrame>>,
    clock: Clock,
}

impl Camera {
    /// A camera that plays a recording, if there is one.
    pub(super) fn new(recording: Option<Recording>, clock: Clock) -> Self {
        let frames = recording.map(|r| r.frames).unwrap_or_default();
        Self { frames: frames.into_iter().peekable(), clock }
    }

    /// Whether all frames were taken.
    pub(super) fn is_over(&mut self) -> bool {
        self.frames.peek().is_none()
    }

    /// The next frame, at its time; waits for ever when there is none.
    pub(super) async fn next(&mut self) -> RecordedFrame {
        match self.frames.peek() {
            Some(frame) => {
                let at = scenecast_protocol::time::Instant::from_secs_f64(frame.t_s);
                tokio::time::sleep_until(self.clock.wall(at)).await;
            }
            None => std::future::pending().await,
        }
        match self.frames.next() {
            Some(frame) => frame,
            None => std::future::pending().await,
        }
    }
}
