//! Labels of other programs: their sources, and the thread that makes them a map.

mod feed;
#[cfg(unix)]
mod local;
mod restore;
mod serve;

use feed::Arrived;
pub(super) use feed::Feed;
pub(super) use restore::restore;

use super::clock::Clock;
use super::mapping::Keep;
use scenecast_core::UserError;
use scenecast_labels::{Content, ImagePose, Refusal};
use scenecast_vehicle::{ForeignMap, ForeignUpdate, MapProducer};
use std::sync::atomic::{AtomicBool, Ordering};
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

/// The thread that turns labels of other programs into a map.
pub(super) struct LabelThread {
    mapped: mpsc::Receiver<FromLabels>,
    own: Arc<Mutex<Option<ImagePose>>>,
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl LabelThread {
    pub(super) fn start(map: ForeignMap, feed: Feed, keep: Keep, clock: Clock) -> Result<Self, UserError> {
        let (outgoing, mapped) = mpsc::channel(1);
        let (own, is_over) = (Arc::default(), Arc::new(AtomicBool::new(false)));
        let counts = Counts::default();
        let is_refusal_reported = keep.is_refused;
        let worker = Worker {
            map,
            feed,
            keep,
            clock,
            own: Arc::clone(&own),
            is_over: Arc::clone(&is_over),
            outgoing,
            counts,
            is_refusal_reported,
        };
        let thread = std::thread::Builder::new().name("labels".to_owned()).spawn(move || worker.run());
        let thread = thread.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
        Ok(Self { mapped, own, is_over, thread })
    }

    /// The next report; never without one. Cancel-safe.
    pub(super) async fn next(this: &mut Option<Self>) -> Option<FromLabels> {
        match this {
            Some(labels) => labels.mapped.recv().await,
            None => std::future::pending().await,
        }
    }

    /// Sets the vehicle's own pose, for images without one.
    pub(super) fn set_pose(&self, pose: ImagePose) {
        *self.own.lock().unwrap_or_else(PoisonError::into_inner) = Some(pose);
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
    own: Arc<Mutex<Option<ImagePose>>>,
    is_over: Arc<AtomicBool>,
    outgoing: mpsc::Sender<FromLabels>,
    counts: Counts,
    is_refusal_reported: bool,
}

impl Worker {
    fn run(mut self) {
        if self.map.last_s().is_some() {
            self.report(FromLabels::Mapped(Box::new(self.map.update()), None));
        }
        while !self.is_over.load(Ordering::Relaxed) && !self.outgoing.is_closed() {
            let Some(first) = self.feed.next(BATCH) else { continue };
            let began = Instant::now();
            let mut pose = self.take(first);
            let mut is_changed = pose.is_some();
            while began.elapsed() < BATCH {
                let Some(next) = self.feed.next(Duration::ZERO) else { break };
                let taken = self.take(next);
                is_changed |= taken.is_some();
                pose = taken.flatten().map(Some).or(pose);
            }
            if is_changed {
                // The checkpoint comes first, so that it contains every label that the surface receives.
                self.keep.keep_if_due(&self.map);
                self.report_checkpoint();
                self.report(FromLabels::Mapped(Box::new(self.map.update()), pose.flatten()));
            }
        }
        if self.counts.taken > 0 {
            // Items come in bursts: the last one may be of the moment of the last checkpoint.
            self.keep.last_s = None;
        }
        self.keep.keep_now(&self.map);
        tracing::info!("labels: {} items were taken, {} refused", self.counts.taken, self.counts.refused);
    }

    /// Takes an item; returns the pose in it. `None` if it is refused.
    fn take(&mut self, arrived: Arrived) -> Option<Option<ImagePose>> {
        let Arrived { origin, mark, item, answer } = arrived;
        let own = *self.own.lock().unwrap_or_else(PoisonError::into_inner);
        let t_s = self.clock.now().as_secs_f64();
        let result = item.and_then(|item| {
            self.map.handle_item(&item, own, t_s)?;
            Ok(if let Content::Image { pose, .. } = item.content { pose } else { None })
        });
        // A refused file is not read again after a restart either.
        mark.iter().for_each(|name| self.map.set_mark(name));
        match &result {
            Ok(_) => self.counts.taken += 1,
            Err(why) => self.counts.refuse(&origin, why),
        }
        if let Some(answer) = answer {
            let _ = answer.try_send(result.as_ref().map(drop).map_err(ToString::to_string));
        }
        result.ok()
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
