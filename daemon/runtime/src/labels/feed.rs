//! Where items come from, a folder or a queue that connections fill, and how often the vehicle gets the map of another program.

use scenecast_files::LabelFolder;
use scenecast_labels::{Item, Refusal};
use scenecast_vehicle::ForeignSource;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Pause between two looks at a folder.
const LOOK_PAUSE: Duration = Duration::from_millis(200);
/// Items that wait in a queue; a source waits as long as it is full.
const QUEUE: usize = 4;

/// The answer to a source: whether its item was taken.
pub(crate) type Answer = Result<(), Refusal>;

/// An item with its source.
pub(crate) struct Arrived {
    /// The item's place for people: a file, or the other end of a connection.
    pub(crate) origin: String,
    /// The name by which its source resumes after a restart.
    pub(crate) mark: Option<String>,
    /// When it came in, or when its file was written; `None` before this program's computer started, or if unknown.
    pub(crate) at: Option<Instant>,
    pub(crate) item: Result<Item, Refusal>,
    pub(crate) answer: Option<SyncSender<Answer>>,
}

/// The end of a queue that a source fills. [`LabelQueue::push`] blocks while the queue is full.
#[derive(Debug, Clone)]
pub(crate) struct LabelQueue {
    items: SyncSender<Arrived>,
    is_missing: Arc<AtomicBool>,
}

impl LabelQueue {
    /// A queue and its other end.
    pub(crate) fn new() -> (Self, Feed) {
        let (sender, receiver) = sync_channel(QUEUE);
        let is_missing = Arc::new(AtomicBool::new(false));
        let feed = QueueFeed { items: receiver, is_missing: Arc::clone(&is_missing) };
        (Self { items: sender, is_missing }, Feed::Queue(feed))
    }

    /// Gives an item; returns `false` once nobody takes items any more.
    pub(crate) fn push(&self, arrived: Arrived) -> bool {
        self.items.send(arrived).is_ok()
    }

    /// Sets whether the source cannot be opened.
    #[cfg_attr(not(any(test, feature = "ros2")), expect(dead_code, reason = "sockets are open from the start"))]
    pub(crate) fn set_missing(&self, is_missing: bool) {
        self.is_missing.store(is_missing, Ordering::Relaxed);
    }
}

/// A source of items: the files of a folder, or a queue that others fill.
pub(crate) enum Feed {
    Folder(FolderFeed),
    Queue(QueueFeed),
}

impl Feed {
    /// The files of a folder.
    pub(crate) fn folder(folder: LabelFolder) -> Self {
        let began = Instant::now();
        Self::Folder(FolderFeed { folder, names: VecDeque::new(), looked: None, began, is_missing: false })
    }

    /// Whether its folder is not there, its topic cannot be opened, or whoever filled its queue has ended.
    pub(crate) fn is_missing(&self) -> bool {
        match self {
            Self::Folder(folder) => folder.is_missing,
            Self::Queue(queue) => queue.is_missing.load(Ordering::Relaxed),
        }
    }

    /// The next item; `None` if there is none within `wait`.
    pub(crate) fn next(&mut self, wait: Duration) -> Option<Arrived> {
        match self {
            Self::Folder(folder) => folder.next(wait),
            Self::Queue(queue) => queue.next(wait),
        }
    }
}

/// The end of a queue that gives items.
pub(crate) struct QueueFeed {
    items: Receiver<Arrived>,
    is_missing: Arc<AtomicBool>,
}

impl QueueFeed {
    fn next(&mut self, wait: Duration) -> Option<Arrived> {
        if wait.is_zero() {
            return self.items.try_recv().ok();
        }
        match self.items.recv_timeout(wait) {
            Ok(arrived) => Some(arrived),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                self.is_missing.store(true, Ordering::Relaxed);
                std::thread::sleep(wait);
                None
            }
        }
    }
}

/// Looks at a folder now and then.
pub(crate) struct FolderFeed {
    folder: LabelFolder,
    /// The names of the last look that were not read yet.
    names: VecDeque<String>,
    looked: Option<Instant>,
    began: Instant,
    is_missing: bool,
}

impl FolderFeed {
    fn next(&mut self, wait: Duration) -> Option<Arrived> {
        if self.names.is_empty() && self.looked.is_none_or(|at| at.elapsed() >= LOOK_PAUSE) {
            self.looked = Some(Instant::now());
            let found = self.folder.scan();
            let was_missing = std::mem::replace(&mut self.is_missing, found.is_err());
            match found {
                Ok(names) => self.names = names.into(),
                Err(error) if !was_missing => tracing::error!("labels: {error}; the folder is looked at again"),
                Err(_) => {}
            }
        }
        while let Some(name) = self.names.pop_front() {
            if let Some(found) = self.folder.read(&name, self.began.elapsed().as_secs_f64()) {
                let at = self.folder.age_of(&name).and_then(|age| Instant::now().checked_sub(age));
                let (origin, mark) = (format!("{name}.json"), Some(found.name));
                return Some(Arrived { origin, mark, at, item: found.item, answer: None });
            }
        }
        std::thread::sleep(wait.min(LOOK_PAUSE));
        None
    }
}

/// The sources of a vehicle, which are read in turn.
pub(crate) struct Feeds {
    feeds: Vec<(ForeignSource, Feed)>,
    turn: usize,
}

impl Feeds {
    pub(crate) fn new(feeds: Vec<(ForeignSource, Feed)>) -> Self {
        Self { feeds, turn: 0 }
    }

    /// Whether a source is missing, as of [`Feed::is_missing`].
    pub(crate) fn is_missing(&self) -> bool {
        self.feeds.iter().any(|(_, feed)| feed.is_missing())
    }

    /// The next item with its source; `None` if there is none within `wait`.
    pub(crate) fn next(&mut self, wait: Duration) -> Option<(ForeignSource, Arrived)> {
        let count = self.feeds.len();
        for _ in 0..count {
            self.turn = (self.turn + 1) % count;
            let wait = wait / count as u32;
            if let Some((source, feed)) = self.feeds.get_mut(self.turn)
                && let Some(arrived) = feed.next(wait)
            {
                return Some((*source, arrived));
            }
        }
        None
    }
}

/// Shortest time between two updates, and between two slices of a large one.
const MIN_INTERVAL: Duration = Duration::from_millis(200);
const BETWEEN_SLICES: Duration = Duration::from_millis(10);
/// The vehicle handles updates for at most one part of so many of its time, so that a large map does not delay its modem.
const PART: u32 = 6;

/// When the next update is due: never before the vehicle has handled the last one, and later the longer that took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pace {
    From(Instant),
    /// The vehicle handles an update; whether more of the same waits.
    Handling {
        has_more: bool,
    },
}

impl Pace {
    pub(super) fn new(now: Instant) -> Self {
        Self::From(now)
    }

    pub(super) fn is_due(self, now: Instant) -> bool {
        matches!(self, Self::From(at) if now >= at)
    }

    /// An update is given to the vehicle; `has_more` if further changes wait.
    pub(super) fn handle_given(&mut self, has_more: bool) {
        *self = Self::Handling { has_more };
    }

    /// The vehicle has handled the update since `began`.
    pub(super) fn handle_taken(&mut self, began: Instant, now: Instant) {
        let took = now.saturating_duration_since(began);
        let shortest = if *self == (Self::Handling { has_more: true }) { BETWEEN_SLICES } else { MIN_INTERVAL };
        *self = Self::From(now + shortest.max(took * (PART - 1)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_that_cannot_be_opened_or_has_ended_is_missing() {
        let (queue, feed) = LabelQueue::new();
        let mut feeds = Feeds::new(vec![(ForeignSource::Bands, feed)]);
        assert!(!feeds.is_missing());
        for is_missing in [true, false] {
            queue.set_missing(is_missing);
            assert_eq!(feeds.is_missing(), is_missing);
        }
        drop(queue);
        assert!(feeds.next(Duration::from_nanos(1)).is_none() && feeds.is_missing());
    }

    #[test]
    fn a_map_that_takes_long_is_updated_less_often() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut pace = Pace::new(start);
        assert!(pace.is_due(start));
        pace.handle_given(false);
        assert!(!pace.is_due(at(60_000)), "the vehicle has not handled it");
        pace.handle_taken(at(1_000), at(1_001));
        assert!(!pace.is_due(at(1_200)) && pace.is_due(at(1_201)));
        pace.handle_given(true);
        pace.handle_taken(at(2_000), at(2_000));
        assert!(!pace.is_due(at(2_009)) && pace.is_due(at(2_010)), "slices follow each other soon");
        pace.handle_given(true);
        pace.handle_taken(at(2_000), at(5_000));
        assert!(!pace.is_due(at(19_999)) && pace.is_due(at(20_000)));
    }
}
