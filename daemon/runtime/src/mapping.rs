//! The scene model's own thread, fed by a recorded camera.

use super::checkpoint::CheckpointFile;
use super::clock::Clock;
use super::journal::Folder;
use scene_model::project::Pose;
use scenecast_core::UserError;
use scenecast_files::{RecordedFrame, Recording};
use scenecast_protocol::directive::Settings;
use scenecast_vehicle::{MapUpdate, Mapper, SharedExemplars};
use std::thread::JoinHandle;
use tokio::sync::mpsc;

/// What the thread is told.
pub(super) enum ToMapper {
    /// Follow these settings.
    Tune(Settings),
    /// The camera saw something.
    Frame(Box<RecordedFrame>),
    /// Keep a checkpoint now.
    Keep,
}

/// What the thread tells.
pub(super) enum FromMapper {
    /// The map, after a camera frame or at the start.
    Seen(Seen),
    /// A camera frame that could not be read.
    Missed(UserError),
}

/// What the thread has made of a camera frame.
pub(super) struct Seen {
    /// None at the start, when the map is that of a checkpoint.
    pub(super) frame: Option<RecordedFrame>,
    pub(super) update: MapUpdate,
    /// The best images of each label so far.
    pub(super) exemplars: SharedExemplars,
}

/// The thread's two ends.
pub(super) struct MapperThread {
    pub(super) orders: mpsc::UnboundedSender<ToMapper>,
    pub(super) seen: mpsc::Receiver<FromMapper>,
    thread: JoinHandle<()>,
}

impl MapperThread {
    /// Starts the thread.
    pub(super) fn start(mapper: Mapper, keep: Keep) -> Result<Self, UserError> {
        let (orders, incoming) = mpsc::unbounded_channel();
        let (outgoing, seen) = mpsc::channel(4);
        let work = move || Work { mapper, keep, outgoing }.run(incoming);
        let thread = std::thread::Builder::new().name("scene-model".to_owned()).spawn(work);
        let thread = thread.map_err(|e| UserError::Failed(format!("the scene model's thread did not start: {e}")))?;
        Ok(Self { orders, seen, thread })
    }

    /// Waits until the thread has kept what it knows.
    pub(super) fn finish(self) {
        drop((self.orders, self.seen));
        if self.thread.join().is_err() {
            tracing::error!("the scene model's thread has panicked: what it knew since the last checkpoint is lost");
        }
    }
}

/// When and where checkpoints are kept.
pub(super) struct Keep {
    pub(super) file: CheckpointFile<Folder>,
    pub(super) lineage: u64,
    /// Seconds of mission time from one to the next; 0: none.
    pub(super) every_s: f64,
    /// Mission time of the last one, or of the first frame.
    pub(super) last_s: Option<f64>,
}

impl Keep {
    /// Keeps a checkpoint if one is due. A disk that refuses does not end the mission: the one before it stays.
    fn keep(&mut self, mapper: &Mapper, is_due: impl Fn(f64) -> bool) {
        let Some(now_s) = mapper.last_s().filter(|_| self.every_s > 0.0) else { return };
        if !is_due(self.last_s.map_or(f64::INFINITY, |last_s| (now_s - last_s).abs())) {
            return;
        }
        match self.file.keep(&mapper.save(self.lineage)) {
            Ok(()) => self.last_s = Some(now_s),
            Err(problem) => tracing::error!("no checkpoint of the scene model at {now_s} s: {problem}"),
        }
    }

    fn keep_if_due(&mut self, mapper: &Mapper) {
        let every_s = self.every_s;
        // From the first frame on, for there is little to keep of that one.
        self.last_s = self.last_s.or(mapper.last_s());
        self.keep(mapper, |since_s| since_s >= every_s);
    }

    fn keep_now(&mut self, mapper: &Mapper) {
        self.keep(mapper, |since_s| since_s > 0.0);
    }
}

struct Work {
    mapper: Mapper,
    keep: Keep,
    outgoing: mpsc::Sender<FromMapper>,
}

impl Work {
    /// Works until nobody listens any more, then keeps what it knows.
    fn run(mut self, mut incoming: mpsc::UnboundedReceiver<ToMapper>) {
        let mut is_heard = true;
        if self.mapper.last_s().is_some() {
            is_heard = self.tell_current(None);
        }
        while is_heard && let Some(order) = incoming.blocking_recv() {
            match order {
                ToMapper::Tune(settings) => self.mapper.tune(&settings),
                ToMapper::Keep => self.keep.keep_now(&self.mapper),
                // A frame that the frame rate leaves out changes nothing but where the vehicle is.
                ToMapper::Frame(frame) if !self.mapper.takes(frame.t_s) => {
                    is_heard = self.tell_current(Some(*frame));
                }
                ToMapper::Frame(frame) => {
                    let told = self.see(*frame);
                    // First the checkpoint: then it has every label that the surface hears of.
                    self.keep.keep_if_due(&self.mapper);
                    is_heard = self.tell(told);
                }
            }
        }
        self.keep.keep_now(&self.mapper);
    }

    fn tell(&self, what: FromMapper) -> bool {
        self.outgoing.blocking_send(what).is_ok()
    }

    /// Sends the map as it is, without a new frame in it.
    fn tell_current(&mut self, frame: Option<RecordedFrame>) -> bool {
        let update = self.mapper.current();
        let seen = self.seen(frame, update);
        self.tell(FromMapper::Seen(seen))
    }

    fn see(&mut self, frame: RecordedFrame) -> FromMapper {
        match frame.image() {
            Ok(image) => {
                let pose = Pose { x: frame.x_m, y: frame.y_m, z: -frame.depth_m, yaw_rad: -frame.heading_rad };
                let update = self.mapper.handle_frame(&image, &pose, frame.scale, frame.t_s);
                FromMapper::Seen(self.seen(Some(frame), update))
            }
            Err(problem) => FromMapper::Missed(problem),
        }
    }

    fn seen(&mut self, frame: Option<RecordedFrame>, update: MapUpdate) -> Seen {
        Seen { frame, update, exemplars: self.mapper.shared_exemplars() }
    }
}

/// The frames of the camera, in order, each at its time; nothing if there is no camera.
pub(super) struct Camera {
    frames: std::iter::Peekable<std::vec::IntoIter<RecordedFrame>>,
    clock: Clock,
    /// Mission time at which this run's clock began.
    began_s: f64,
}

impl Camera {
    /// A camera that plays a recording, if there is one: behind the frame of `seen_s`, if an earlier run has seen that one.
    pub(super) fn new(recording: Option<Recording>, clock: Clock, seen_s: Option<f64>) -> Self {
        let mut frames = recording.map(|r| r.frames).unwrap_or_default();
        let seen = seen_s.and_then(|t_s| frames.iter().rposition(|frame| frame.t_s == t_s));
        let began_s = match seen {
            Some(index) => frames.drain(..=index).next_back().map_or(0.0, |frame| frame.t_s),
            None => 0.0,
        };
        Self { frames: frames.into_iter().peekable(), clock, began_s }
    }

    /// Whether all frames were taken.
    pub(super) fn is_over(&mut self) -> bool {
        self.frames.peek().is_none()
    }

    /// The next frame, at its time; waits for ever when there is none.
    pub(super) async fn next(&mut self) -> RecordedFrame {
        match self.frames.peek() {
            Some(frame) => {
                let at = scenecast_protocol::time::Instant::from_secs_f64((frame.t_s - self.began_s).max(0.0));
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
