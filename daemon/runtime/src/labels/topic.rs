//! Topics of ROS 2 with labels or bands.

use super::feed::Feed;
use crate::ros2::RosSensors;
use scenecast_config::{LabelMessage, RosName};
use scenecast_core::UserError;
use scenecast_vehicle::ForeignSource;

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
    use crate::labels::echo::Echoes;
    use crate::labels::feed::{Arrived, Feed, LabelQueue};
    use scenecast_config::RosName;
    use scenecast_core::UserError;
    use scenecast_labels::ros::{band_of_occupancy, bands_of_grid_map, item_of_image, item_of_occupancy};
    use scenecast_labels::{Item, Refusal};
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_ros2::{Inbox, Received, RosNode};
    use scenecast_sources::SensorNode;
    use std::fmt::Display;
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
            let open = || node.get().map_err(UserError::failed).and_then(|node| open(&node, &wanted));
            let reader = open_at_last(&queue, &wanted.topic, open, std::thread::sleep);
            reader(&queue);
        };
        let started = std::thread::Builder::new().name("labels-topic".to_owned()).spawn(read);
        started.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
        Ok(feed)
    }

    /// Opens the topic, as often as that takes. Meanwhile the source is missing.
    fn open_at_last<T, E: Display>(
        queue: &LabelQueue,
        topic: &RosName,
        mut open: impl FnMut() -> Result<T, E>,
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

    fn open(node: &RosNode, wanted: &TopicFeed) -> Result<Reader, UserError> {
        let TopicFeed { topic, message, source, frame } = wanted.clone();
        let origin = topic.to_string();
        Ok(match message {
            LabelMessage::Image => {
                let inboxes = vec![node.subscribe_images(&topic)?];
                let topic = Topic { origin, inboxes, is_overtaken_lost: true, echoes: Echoes::default() };
                Box::new(move |queue| topic.read(queue, |image| (&image.header.stamp, vec![item_of_image(image)])))
            }
            LabelMessage::OccupancyGrid => {
                let inboxes = vec![
                    node.subscribe_label_map(&topic)?,
                    node.subscribe(&topic, scenecast_ros2::Qos::Reliable(1), 1)?,
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
                    node.subscribe_grid_map(&topic)?,
                    node.subscribe(&topic, scenecast_ros2::Qos::Reliable(1), 1)?,
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
                    let counts = [
                        (now.0 - before.0, Refusal::OtherType as fn(u64) -> Refusal),
                        (now.1 - before.1, Refusal::Overtaken),
                    ];
                    for (count, refusal) in counts {
                        if count > 0 && !queue.push(arrived(&self.origin, None, Err(refusal(count)))) {
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
                if tries < 3 { Err("the node does not start") } else { Ok(tries) }
            };
            let pause = |time| pauses.borrow_mut().push((time, feed.is_missing()));
            assert_eq!(open_at_last(&queue, &scenecast_ros2::topic("/labels").unwrap(), open, pause), 3);
            assert_eq!((pauses.into_inner(), feed.is_missing()), (vec![(RETRY_INTERVAL, true); 2], false));
        }
    }
}
