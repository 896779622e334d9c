//! Topics of ROS 2 with labels or bands, and which of their messages are used, where each may come to two inboxes.

use super::feed::Feed;
use crate::ros2::RosSensors;
use scenecast_config::{LabelMessage, RosName};
use scenecast_core::UserError;
use scenecast_vehicle::ForeignSource;
use std::time::{Duration, Instant};

/// A topic to be read.
#[derive(Debug, Clone)]
#[cfg_attr(not(feature = "ros2"), expect(dead_code, reason = "a build without ROS 2 refuses topics"))]
pub(crate) struct TopicFeed {
    pub(crate) topic: RosName,
    pub(crate) message: LabelMessage,
    pub(crate) source: ForeignSource,
    /// The frame of reference of grids; empty: the usual ones.
    pub(crate) frame: String,
}

/// Reads a topic on a thread of its own.
#[cfg(feature = "ros2")]
pub(crate) fn topic(sensors: &RosSensors, wanted: TopicFeed) -> Result<Feed, UserError> {
    with::topic(sensors.node(), wanted)
}

/// This build has no ROS 2, and refuses topics before.
#[cfg(not(feature = "ros2"))]
pub(crate) fn topic(_: &RosSensors, wanted: TopicFeed) -> Result<Feed, UserError> {
    Err(UserError::Input(format!("{}: this build has no ROS 2", wanted.topic)))
}

#[cfg(feature = "ros2")]
mod with {
    use super::{ForeignSource, LabelMessage, TopicFeed};
    use crate::labels::feed::{Arrived, Feed, LabelQueue};
    use crate::labels::topic::Echoes;
    use scenecast_config::RosName;
    use scenecast_core::UserError;
    use scenecast_labels::ros::{band_of_occupancy, bands_of_grid_map, item_of_image, item_of_occupancy};
    use scenecast_labels::{Item, Refusal};
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_ros2::{Inbox, Received, RosNode};
    use scenecast_sources::SensorNode;
    use std::sync::Arc;
    use std::time::Duration;

    /// Time between two tries to open the topic.
    const RETRY_INTERVAL: Duration = Duration::from_secs(5);
    /// Longest wait for one of two inboxes.
    const LOOK: Duration = Duration::from_millis(100);

    type Items = Vec<Result<Item, Refusal>>;

    pub(super) fn topic(node: Arc<SensorNode>, wanted: TopicFeed) -> Result<Feed, UserError> {
        let (queue, feed) = LabelQueue::new();
        let read = move || {
            let open = || node.get().map_err(|e| e.to_string()).and_then(|node| open(&node, &wanted));
            let reader = open_at_last(&queue, &wanted.topic, open, std::thread::sleep);
            reader(&queue);
        };
        let started = std::thread::Builder::new().name("labels-topic".to_owned()).spawn(read);
        started.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
        Ok(feed)
    }

    /// Opens the topic, as often as that takes. Meanwhile the source is missing.
    fn open_at_last<T>(
        queue: &LabelQueue,
        topic: &RosName,
        mut open: impl FnMut() -> Result<T, String>,
        pause: impl Fn(Duration),
    ) -> T {
        let mut is_logged = false;
        loop {
            let opened = open();
            queue.set_missing(opened.is_err());
            match opened {
                Ok(opened) => return opened,
                Err(error) if !is_logged => tracing::error!("labels: {topic}: {error}; it is tried again"),
                Err(_) => {}
            }
            is_logged = true;
            pause(RETRY_INTERVAL);
        }
    }

    type Reader = Box<dyn FnOnce(&LabelQueue)>;

    fn open(node: &RosNode, wanted: &TopicFeed) -> Result<Reader, String> {
        let failed = |e: UserError| e.to_string();
        let TopicFeed { topic, message, source, frame } = wanted.clone();
        let origin = topic.to_string();
        Ok(match message {
            LabelMessage::Image => {
                let inboxes = vec![node.subscribe_images(&topic).map_err(failed)?];
                let topic = Topic { origin, inboxes, is_overtaken_lost: true, echoes: Echoes::default() };
                Box::new(move |queue| topic.read(queue, |image| (&image.header.stamp, vec![item_of_image(image)])))
            }
            LabelMessage::OccupancyGrid => {
                let inboxes = vec![
                    node.subscribe_label_map(&topic).map_err(failed)?,
                    node.subscribe(&topic, scenecast_ros2::Qos::Reliable(1), 1).map_err(failed)?,
                ];
                let name = origin.clone();
                let topic = Topic { origin, inboxes, is_overtaken_lost: false, echoes: Echoes::default() };
                Box::new(move |queue| {
                    topic.read(queue, |grid| {
                        let item = match source {
                            ForeignSource::Labels => item_of_occupancy(grid, &frame),
                            ForeignSource::Bands => band_of_occupancy(grid, &name, &frame),
                        };
                        (&grid.header.stamp, vec![item])
                    });
                })
            }
            LabelMessage::GridMap => {
                let inboxes = vec![
                    node.subscribe_grid_map(&topic).map_err(failed)?,
                    node.subscribe(&topic, scenecast_ros2::Qos::Reliable(1), 1).map_err(failed)?,
                ];
                let topic = Topic { origin, inboxes, is_overtaken_lost: false, echoes: Echoes::default() };
                Box::new(move |queue| topic.read(queue, |map| (&map.header.stamp, bands_of_grid_map(map, &frame))))
            }
        })
    }

    /// The inboxes of a topic: for grids one that takes the last message of publishers that keep it, and one that matches the
    /// others. A message that comes to both is used once.
    struct Topic<M> {
        origin: String,
        inboxes: Vec<Inbox<M>>,
        /// Whether a message that a newer one displaced is a loss: an image is, a whole grid is not.
        is_overtaken_lost: bool,
        echoes: Echoes,
    }

    impl<M> Topic<M> {
        fn read(mut self, queue: &LabelQueue, items: impl Fn(&M) -> (&Time, Items)) {
            let mut counted = vec![(0, 0); self.inboxes.len()];
            let mut turn = 0;
            loop {
                turn = (turn + 1) % self.inboxes.len();
                self.inboxes[turn].wait(LOOK);
                for (inbox, counted) in self.inboxes.iter().zip(&mut counted) {
                    let now = (inbox.malformed(), if self.is_overtaken_lost { inbox.dropped() } else { 0 });
                    let before = std::mem::replace(counted, now);
                    for (count, text) in [
                        (now.0 - before.0, "messages have another type than the topic"),
                        (now.1 - before.1, "messages were dropped: newer ones came before they were read"),
                    ] {
                        let refusal = Err(Refusal::Message(format!("{count} {text}")));
                        if count > 0 && !queue.push(arrived(&self.origin, None, refusal)) {
                            return;
                        }
                    }
                }
                let found = self.inboxes.iter().enumerate().filter_map(|(of, inbox)| Some((of, inbox.take()?)));
                let found: Vec<(usize, Received<M>)> = found.collect();
                for (inbox, received) in found {
                    let (stamp, items) = items(&received.message);
                    let is_used = self.echoes.is_used(inbox, stamp.nanos(), received.at);
                    let items = if is_used { items } else { Vec::new() };
                    if !items.into_iter().all(|item| queue.push(arrived(&self.origin, Some(received.at), item))) {
                        return;
                    }
                }
            }
        }
    }

    fn arrived(origin: &str, at: Option<std::time::Instant>, item: Result<Item, Refusal>) -> Arrived {
        Arrived { origin: origin.to_owned(), mark: None, at, item, answer: None }
    }

    #[cfg(test)]
    mod tests {
        use super::*;
        use std::cell::RefCell;

        #[test]
        fn a_topic_is_missing_until_it_is_open() {
            let (queue, feed) = LabelQueue::new();
            let (mut tries, pauses) = (0, RefCell::new(Vec::new()));
            let open = || {
                tries += 1;
                if tries < 3 { Err("the node does not start".to_owned()) } else { Ok(tries) }
            };
            let pause = |time| pauses.borrow_mut().push((time, feed.is_missing()));
            assert_eq!(open_at_last(&queue, &scenecast_ros2::topic("/labels").unwrap(), open, pause), 3);
            assert_eq!((pauses.into_inner(), feed.is_missing()), (vec![(RETRY_INTERVAL, true); 2], false));
        }
    }
}

/// Longest time between the two arrivals of a message. After it, an inbox alone has what the other one lacks.
const MAX_DELAY: Duration = Duration::from_secs(1);

/// The message that was used last.
#[derive(Debug, Clone, Copy)]
struct Used {
    inbox: usize,
    stamp_ns: i64,
    at: Instant,
}

/// Recognises the messages that the other inbox has had, and those before them. An inbox alone is always believed: its order
/// is the publisher's, whose stamps may repeat, be missing or go back.
#[derive(Debug, Default)]
pub(super) struct Echoes {
    last: Option<Used>,
}

impl Echoes {
    /// Whether a message that came to an inbox at a moment is used.
    pub(super) fn is_used(&mut self, inbox: usize, stamp_ns: i64, at: Instant) -> bool {
        let is_echo = self.last.is_some_and(|last| {
            let is_soon = at.saturating_duration_since(last.at) < MAX_DELAY;
            inbox != last.inbox && stamp_ns <= last.stamp_ns && is_soon
        });
        if !is_echo {
            self.last = Some(Used { inbox, stamp_ns, at });
        }
        !is_echo
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of the messages, as inbox, stamp and milliseconds of arrival, are used.
    fn used(messages: &[(usize, i64, u64)]) -> Vec<bool> {
        let (mut echoes, start) = (Echoes::default(), Instant::now());
        messages.iter().map(|&(inbox, ns, ms)| echoes.is_used(inbox, ns, start + Duration::from_millis(ms))).collect()
    }

    #[test]
    fn a_message_in_both_inboxes_is_used_once() {
        assert_eq!(
            used(&[(0, 5, 0), (1, 5, 1), (1, 6, 100), (0, 6, 101), (0, 7, 200)]),
            [true, false, true, false, true]
        );
        assert_eq!(used(&[(0, 5, 0), (1, 5, 1), (0, 5, 9_000), (1, 5, 9_001)]), [true, false, true, false]);
    }

    #[test]
    fn a_publisher_that_repeats_its_stamp_is_heard() {
        for stamp in [0, 5] {
            assert_eq!(used(&[(1, stamp, 0), (1, stamp, 10), (1, stamp, 2_000)]), [true; 3], "one inbox");
            let both =
                [(0, stamp, 0), (1, stamp, 1), (0, stamp, 100), (1, stamp, 101), (1, stamp, 200), (0, stamp, 201)];
            assert_eq!(used(&both), [true, false, true, false, false, true]);
        }
    }

    #[test]
    fn an_older_message_never_follows_from_the_other_inbox() {
        assert_eq!(used(&[(0, 7, 100), (1, 6, 90), (1, 7, 101), (1, 8, 200)]), [true, false, false, true]);
        assert_eq!(
            used(&[(0, 7, 0), (0, 2, 100), (1, 2, 101)]),
            [true, true, false],
            "the publisher's clock went back"
        );
    }

    #[test]
    fn the_other_inbox_is_heard_once_the_first_is_silent() {
        // A publisher that keeps its last message ends, and one that does not begins, with an earlier clock.
        assert_eq!(used(&[(0, 9, 0), (1, 3, 2_000), (1, 4, 2_100), (0, 9, 2_150)]), [true, true, true, true]);
        assert_eq!(used(&[(0, 9, 0), (1, 9, 2_000)]), [true, true], "a repeated stamp");
    }
}
