//! Labels of other programs: their sources, and the thread that makes them a map.

#[cfg(any(test, feature = "ros2"))]
mod echo;
mod feed;
#[cfg(unix)]
mod local;
mod moment;
mod own_poses;
mod restore;
mod serve;
mod topic;

use super::checkpoint::Keep;
use super::clock::Clock;
use super::equipment::{LabelHealth, LabelTally};
pub(super) use feed::Feeds;
use feed::{Arrived, Pace};
use own_poses::OwnPoses;
pub(super) use restore::{open, restore};
use scenecast_config::{AutopilotKind, Config, LabelSource, NavigationSource};
use scenecast_core::UserError;
use scenecast_labels::{Content, ImagePose, Item, ItemTime, Refusal};
use scenecast_protocol::map::ClassEntry;
use scenecast_vehicle::{ForeignMap, ForeignSource, MapChanges, MapProducer};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};
use tokio::sync::mpsc;
pub(super) use topic::topic;

/// Longest time for which items are collected before the vehicle gets the changes.
const BATCH: Duration = Duration::from_millis(200);
/// Wait for items while changes wait for the vehicle.
const SHORT: Duration = Duration::from_millis(5);
/// Cells of an update, of the labels and of each band: the vehicle's loop takes a few milliseconds for them.
const SLICE: usize = 1 << 13;

/// A report of the thread.
pub(super) enum FromLabels {
    /// Changes of the map, and the pose of the last image among the items that made them.
    Mapped(Box<MapChanges>, Option<ImagePose>),
    /// A checkpoint was refused, or the first one after a refusal was written.
    Checkpoint { is_refused: bool },
}

/// Whether the vehicle is where the last image with a pose was taken: only if nothing else measures its place.
pub(super) fn move_the_vehicle(config: &Config) -> bool {
    if config.labels.source == LabelSource::SceneModel {
        return false;
    }
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
    tally: Arc<Mutex<LabelTally>>,
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl LabelThread {
    /// Starts with the map of a checkpoint, and with the names of classes that the configuration has.
    pub(super) fn start(
        mut map: ForeignMap,
        names: &[ClassEntry],
        feeds: Feeds,
        keep: Keep,
        clock: Clock,
    ) -> Result<Self, UserError> {
        let kept_names = map.classes().cloned().collect();
        if !names.is_empty() {
            map.add_names(names).map_err(|why| UserError::Input(format!("labels.classes: {why}")))?;
        }
        let (outgoing, mapped) = mpsc::channel(1);
        let own = Arc::new(Mutex::new(OwnPoses::new(clock.scale())));
        let pace = Arc::new(Mutex::new(Pace::new(Instant::now())));
        let tally = Arc::new(Mutex::new(LabelTally::default()));
        let is_over = Arc::new(AtomicBool::new(false));
        let worker = Worker {
            kept_names,
            is_refusal_reported: keep.is_refused,
            map,
            feeds,
            keep,
            clock,
            own: Arc::clone(&own),
            pace: Arc::clone(&pace),
            is_over: Arc::clone(&is_over),
            outgoing,
            tally: Arc::clone(&tally),
            taken: 0,
            refusals: RefusalLog::default(),
        };
        let thread = std::thread::Builder::new().name("labels".to_owned()).spawn(move || worker.run());
        let thread = thread.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
        Ok(Self { mapped, own, pace, tally, is_over, thread })
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

    /// What became of the items so far.
    pub(super) fn health(&self) -> LabelHealth {
        lock(&self.tally).health(Instant::now())
    }

    /// The vehicle has handled an update since `began`; the next one comes accordingly later.
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

struct Worker {
    map: ForeignMap,
    feeds: Feeds,
    keep: Keep,
    clock: Clock,
    own: Arc<Mutex<OwnPoses>>,
    pace: Arc<Mutex<Pace>>,
    is_over: Arc<AtomicBool>,
    outgoing: mpsc::Sender<FromLabels>,
    tally: Arc<Mutex<LabelTally>>,
    /// Items that were taken so far.
    taken: u64,
    refusals: RefusalLog,
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
                is_changed = self.map.has_changes();
            }
            let first = self.feeds.next(if is_changed { SHORT } else { BATCH });
            lock(&self.tally).set_missing(self.feeds.is_missing());
            let Some(first) = first else { continue };
            let (began, mut next) = (Instant::now(), Some(first));
            while let Some(arrived) = next {
                let taken = self.take(arrived);
                is_changed |= taken.is_some();
                pose = taken.flatten().or(pose);
                next = if began.elapsed() < BATCH { self.feeds.next(Duration::ZERO) } else { None };
            }
        }
        if self.taken > 0 {
            // Items come in bursts: the last one may be of the moment of the last checkpoint.
            self.keep.last_s = None;
        }
        self.keep.keep_now(&self.map);
        tracing::info!("labels: {} items were taken, {} refused", self.taken, self.refusals.refused());
    }

    /// Gives a slice of the changes to the vehicle.
    fn give(&mut self, pose: Option<ImagePose>) {
        let mut changes = self.map.take_changes(SLICE);
        // The checkpoint comes first, so that it contains every name that the surface receives: a class keeps its name
        // after a power cut. Names that the disk refuses wait.
        if changes.classes == self.kept_names || self.keep.is_refused {
            self.keep.keep_if_due(&self.map);
        } else {
            self.keep.last_s = None;
            self.keep.keep_now(&self.map);
        }
        if self.keep.is_refused {
            changes.classes.clone_from(&self.kept_names);
        } else {
            self.kept_names.clone_from(&changes.classes);
        }
        self.report_checkpoint();
        lock(&self.pace).handle_given(self.map.has_changes());
        self.report(FromLabels::Mapped(Box::new(changes), pose));
    }

    /// Takes an item; returns the pose in it. `None` if it is refused.
    fn take(&mut self, (source, arrived): (ForeignSource, Arrived)) -> Option<Option<ImagePose>> {
        let Arrived { origin, mark, at, item, answer } = arrived;
        let result = item.and_then(|item| {
            let own = self.own_pose(&item, at)?;
            self.map.handle_item(&item, source, own, self.clock.now().as_secs_f64())?;
            Ok(if let Content::Image { pose, .. } = item.content { pose } else { None })
        });
        // A refused file is not read again after a restart either.
        mark.iter().for_each(|name| self.map.set_mark(source, name));
        match &result {
            Ok(_) => {
                self.taken += 1;
                lock(&self.tally).take();
            }
            Err(why) => {
                let (text, now) = (format!("{origin}: {why}"), Instant::now());
                lock(&self.tally).refuse(text.clone(), now);
                self.refusals.count(text, now).iter().for_each(|line| tracing::warn!("labels: {line}"));
            }
        }
        if let Some(answer) = answer {
            let _ = answer.try_send(result.as_ref().map(drop).map_err(Clone::clone));
        }
        result.ok()
    }

    /// The vehicle's pose for an image without one: that of the item's time, or else of its arrival `at`.
    fn own_pose(&self, item: &Item, at: Option<Instant>) -> Result<Option<ImagePose>, Refusal> {
        let Content::Image { pose: None, .. } = item.content else { return Ok(None) };
        let moment = moment::moment(item.time, at, (Instant::now(), SystemTime::now()));
        // The mission time of an item of an earlier run is that run's.
        let taken = moment.and_then(|moment| self.clock.at(moment)).ok_or(Refusal::NoPoseBefore)?;
        let t_s = if let ItemTime::Mission(t_s) = item.time { t_s } else { taken.as_secs_f64() };
        lock(&self.own).at(t_s).map(Some)
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

/// Most lines in [`PAUSE`]; further refusals are counted.
const LINES: u32 = 10;
const PAUSE: Duration = Duration::from_secs(1);
/// Shortest time between two lines with the same origin and the same reason: a topic repeats its refused message for ever.
const REPEAT_INTERVAL: Duration = Duration::from_secs(30);

/// Refused items so far, and which of them the log has.
#[derive(Debug, Default)]
struct RefusalLog {
    refused: u64,
    /// Refused items since the last line.
    unsaid: u64,
    /// The beginning of a pause, and the lines since then.
    lines: Option<(Instant, u32)>,
    /// The last time of each text. [`LINES`] bounds its size, since older ones are forgotten.
    said: BTreeMap<String, Instant>,
}

impl RefusalLog {
    fn refused(&self) -> u64 {
        self.refused
    }

    /// Counts a refused item; returns the line of the log if it has one.
    fn count(&mut self, text: String, now: Instant) -> Option<String> {
        self.refused += 1;
        let is_within = |since: Instant, time: Duration| now.saturating_duration_since(since) < time;
        let (since, lines) = self.lines.filter(|&(since, _)| is_within(since, PAUSE)).unwrap_or((now, 0));
        let is_repeated = self.said.get(&text).is_some_and(|&at| is_within(at, REPEAT_INTERVAL));
        if is_repeated || lines >= LINES {
            self.unsaid += 1;
            return None;
        }
        self.lines = Some((since, lines + 1));
        let more = match std::mem::take(&mut self.unsaid) {
            0 => String::new(),
            others => format!(", {others} of them since the last line"),
        };
        let line = format!("{text}; refused so far: {}{more}", self.refused);
        self.said.retain(|_, at| is_within(*at, REPEAT_INTERVAL));
        self.said.insert(text, now);
        Some(line)
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod refusal_log_tests {
    use super::*;

    #[test]
    fn a_repeated_refusal_is_logged_rarely() {
        let (mut log, start) = (RefusalLog::default(), Instant::now());
        let mut lines = Vec::new();
        for tenth in 0..=300 {
            let now = start + Duration::from_millis(100 * tenth);
            for band in ["slope", "rough"] {
                lines.extend(log.count(format!("/map: band {band:?}"), now));
            }
        }
        let expected = [
            "/map: band \"slope\"; refused so far: 1",
            "/map: band \"rough\"; refused so far: 2",
            "/map: band \"slope\"; refused so far: 601, 598 of them since the last line",
            "/map: band \"rough\"; refused so far: 602",
        ];
        assert_eq!((lines, log.refused()), (expected.map(str::to_owned).to_vec(), 602));
    }

    #[test]
    fn distinct_refusals_are_bounded_in_lines_and_memory() {
        let (mut log, start) = (RefusalLog::default(), Instant::now());
        let at = |ms| start + Duration::from_millis(ms);
        let lines = (0..100_000).filter_map(|i| log.count(format!("{i}.json: class 255"), at(i))).count();
        assert_eq!((lines, log.refused()), (1000, 100_000));
        assert!(log.said.len() <= 310, "{}", log.said.len());
    }
}
