//! Labels of other programs: their sources, and the thread that makes them a map.

mod feed;
#[cfg(unix)]
mod local;
mod own_poses;
mod pace;
mod restore;
mod serve;

use feed::Arrived;
pub(super) use feed::Feed;
use own_poses::OwnPoses;
use pace::Pace;
pub(super) use restore::restore;

use super::clock::Clock;
use super::mapping::Keep;
use scenecast_config::{AutopilotKind, Config, NavigationSource};
use scenecast_core::UserError;
use scenecast_labels::{Content, ImagePose, Item, Refusal};
use scenecast_protocol::map::ClassEntry;
use scenecast_vehicle::{ForeignMap, ForeignUpdate, MapProducer};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// Longest time for which items are collected before the vehicle gets the map with them.
const BATCH: Duration = Duration::from_millis(200);
/// Most lines of the log about refused items in [`LOG_PAUSE`]; the others are counted.
const LOG_LINES: u32 = 10;
const LOG_PAUSE: Duration = Duration::from_secs(1);

/// A report of the thread.
pub(super) enum FromLabels {
    /// The map after some items, and the pose of the last image among them.
    Mapped(Box<ForeignUpdate>, Option<ImagePose>),
    /// A checkpoint was refused, or the first one after a refusal was written.
    Checkpoint { is_refused: bool },
}

/// Whether the vehicle is where the last image with a pose was taken: only if nothing else measures its place.
pub(super) fn move_the_vehicle(config: &Config) -> bool {
    let is_navigated = config.camera.source.is_live() && config.navigation.source != NavigationSource::Autopilot;
    config.autopilot.kind == AutopilotKind::None && !is_navigated
}

fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The thread that turns labels of other programs into a map.
pub(super) struct LabelThread {
    mapped: mpsc::Receiver<FromLabels>,
    own: Arc<Mutex<OwnPoses>>,
    pace: Arc<Mutex<Pace>>,
    is_over: Arc<AtomicBool>,
    /// Items that were refused so far.
    refused: Arc<AtomicU64>,
    thread: JoinHandle<()>,
}

impl LabelThread {
    pub(super) fn start(map: ForeignMap, feed: Feed, keep: Keep, clock: Clock) -> Result<Self, UserError> {
        let (outgoing, mapped) = mpsc::channel(1);
        let own = Arc::new(Mutex::new(OwnPoses::new(clock.scale())));
        let pace = Arc::new(Mutex::new(Pace::new(Instant::now())));
        let is_over = Arc::new(AtomicBool::new(false));
        let refused = Arc::new(AtomicU64::new(0));
        let worker = Worker {
            kept_names: map.classes().cloned().collect(),
            is_refusal_reported: keep.is_refused,
            map,
            feed,
            keep,
            clock,
            own: Arc::clone(&own),
            pace: Arc::clone(&pace),
            is_over: Arc::clone(&is_over),
            outgoing,
            counts: Counts::default(),
            refused: Arc::clone(&refused),
        };
        let thread = std::thread::Builder::new().name("labels".to_owned()).spawn(move || worker.run());
        let thread = thread.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
        Ok(Self { mapped, own, pace, is_over, refused, thread })
    }

    /// Items that were refused so far.
    pub(super) fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }

    /// The next report; never without one. Cancel-safe.
    pub(super) async fn next(this: &mut Option<Self>) -> Option<FromLabels> {
        match this {
            Some(labels) => labels.mapped.recv().await,
            None => std::future::pending().await,
        }
    }

    /// Takes the pose that the vehicle has at `now`, for images without one.
    pub(super) fn handle_pose(&self, pose: ImagePose, now: scenecast_protocol::time::Instant) {
        lock(&self.own).push(pose, now);
    }

    /// The vehicle has handled a map since `began`; the next one comes accordingly later.
    pub(super) fn handle_taken(&self, began: Instant) {
        lock(&self.pace).handle_taken(began, Instant::now());
    }

    /// Waits until the thread has kept its last checkpoint.
    pub(super) fn finish(self) {
        self.is_over.store(true, Ordering::Relaxed);
        drop(self.mapped);
        if self.thread.join().is_err() {
            tracing::error!("the labels' thread has panicked: its changes since the last checkpoint are lost");
        }
    }
}

/// Items that were taken and refused so far.
#[derive(Debug, Default)]
struct Counts {
    taken: u64,
    refused: u64,
    /// Refused items that were not logged, and the lines of the log since a moment.
    unsaid: u64,
    said: u32,
    since: Option<Instant>,
}

impl Counts {
    fn refuse(&mut self, origin: &str, why: &Refusal) {
        self.refused += 1;
        if self.since.is_none_or(|at| at.elapsed() >= LOG_PAUSE) {
            (self.said, self.since) = (0, Some(Instant::now()));
        }
        if self.said >= LOG_LINES {
            self.unsaid += 1;
            return;
        }
        self.said += 1;
        let more = match std::mem::take(&mut self.unsaid) {
            0 => String::new(),
            others => format!(", {others} of them since the last line"),
        };
        tracing::warn!("labels: {origin}: {why}; refused so far: {}{more}", self.refused);
    }
}

struct Worker {
    map: ForeignMap,
    feed: Feed,
    keep: Keep,
    clock: Clock,
    own: Arc<Mutex<OwnPoses>>,
    pace: Arc<Mutex<Pace>>,
    is_over: Arc<AtomicBool>,
    outgoing: mpsc::Sender<FromLabels>,
    counts: Counts,
    /// The refused items of `counts`, for the vehicle.
    refused: Arc<AtomicU64>,
    is_refusal_reported: bool,
    /// The names of classes in the last checkpoint that was written.
    kept_names: Vec<ClassEntry>,
}

impl Worker {
    fn run(mut self) {
        // Whether the vehicle's map is older, and the pose of the last image since then.
        let (mut is_changed, mut pose) = (self.map.last_s().is_some(), None);
        while !self.is_over.load(Ordering::Relaxed) && !self.outgoing.is_closed() {
            if is_changed && lock(&self.pace).is_due(Instant::now()) {
                self.give(pose.take());
                is_changed = false;
            }
            let Some(first) = self.feed.next(BATCH) else { continue };
            let (began, mut next) = (Instant::now(), Some(first));
            while let Some(arrived) = next {
                let taken = self.take(arrived);
                is_changed |= taken.is_some();
                pose = taken.flatten().or(pose);
                next = if began.elapsed() < BATCH { self.feed.next(Duration::ZERO) } else { None };
            }
        }
        if self.counts.taken > 0 {
            // Items come in bursts: the last one may be of the moment of the last checkpoint.
            self.keep.last_s = None;
        }
        self.keep.keep_now(&self.map);
        tracing::info!("labels: {} items were taken, {} refused", self.counts.taken, self.counts.refused);
    }

    /// Gives the map to the vehicle.
    fn give(&mut self, pose: Option<ImagePose>) {
        let mut update = self.map.update();
        // The checkpoint comes first, so that it contains every name that the surface receives: a class keeps its name
        // after a power cut. Names that the disk refuses wait.
        if update.classes == self.kept_names || self.keep.is_refused {
            self.keep.keep_if_due(&self.map);
        } else {
            self.keep.last_s = None;
            self.keep.keep_now(&self.map);
        }
        if self.keep.is_refused {
            update.classes.clone_from(&self.kept_names);
        } else {
            self.kept_names.clone_from(&update.classes);
        }
        self.report_checkpoint();
        lock(&self.pace).handle_given();
        self.report(FromLabels::Mapped(Box::new(update), pose));
    }

    /// Takes an item; returns the pose in it. `None` if it is refused.
    fn take(&mut self, arrived: Arrived) -> Option<Option<ImagePose>> {
        let Arrived { origin, mark, at, item, answer } = arrived;
        let result = item.and_then(|item| {
            let own = self.own_pose(&item, at)?;
            self.map.handle_item(&item, own, self.clock.now().as_secs_f64())?;
            Ok(if let Content::Image { pose, .. } = item.content { pose } else { None })
        });
        // A refused file is not read again after a restart either.
        mark.iter().for_each(|name| self.map.set_mark(name));
        match &result {
            Ok(_) => self.counts.taken += 1,
            Err(why) => {
                self.counts.refuse(&origin, why);
                self.refused.store(self.counts.refused, Ordering::Relaxed);
            }
        }
        if let Some(answer) = answer {
            let _ = answer.try_send(result.as_ref().map(drop).map_err(ToString::to_string));
        }
        result.ok()
    }

    /// The vehicle's pose for an image without one: that of the item's time, or else of its arrival `at`.
    fn own_pose(&self, item: &Item, at: Option<Instant>) -> Result<Option<ImagePose>, Refusal> {
        let Content::Image { pose: None, .. } = item.content else { return Ok(None) };
        // The mission time of an item of an earlier run is that run's.
        let arrived = at.and_then(|at| self.clock.at(at)).ok_or(Refusal::NoPoseBefore)?;
        lock(&self.own).at(item.t_s.unwrap_or(arrived.as_secs_f64())).map(Some)
    }

    fn report(&self, report: FromLabels) {
        let _ = self.outgoing.blocking_send(report);
    }

    fn report_checkpoint(&mut self) {
        let is_refused = self.keep.is_refused;
        if std::mem::replace(&mut self.is_refusal_reported, is_refused) != is_refused {
            self.report(FromLabels::Checkpoint { is_refused });
        }
    }
}

#[cfg(test)]
mod tests;
