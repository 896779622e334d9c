//! The vehicle in ROS 2: its own map, pose, path and state.

use crate::node::{Publisher, RosNode};
use crate::stop::{self, Owned, Owner};
use crate::transport::Qos;
use scenecast_config::Ros2;
use scenecast_core::{UserError, palette};
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::contents::{
    Grid, Health, MAP_FRAME, MAX_GRID_CELLS, Place, cloud, diagnostics, header, layers, occupancy, path, pose,
};
use scenecast_messages::diagnostic_msgs::DiagnosticArray;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::{OccupancyGrid, Path};
use scenecast_messages::sensor_msgs::PointCloud2;
use scenecast_protocol::map::{LabelGrid, LayerDescriptor, Quantity};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Time between two looks at the view and the subscribers.
const TICK: Duration = Duration::from_millis(100);
/// Minimum time between two maps, and between two diagnostics.
const MAP_INTERVAL: Duration = Duration::from_secs(1);
/// Minimum distance between two places of the path, metres.
const PATH_STEP_M: f64 = 0.25;
/// Places of the path at most; the oldest ones are dropped.
const MAX_PATH: usize = 2000;

/// The state of a vehicle at one moment, in its map frame.
#[derive(Debug, Clone)]
pub struct VehicleView {
    /// Metres east, north and up.
    pub position_m: [f64; 3],
    /// Heading in radians, clockwise from north.
    pub heading_rad: f64,
    pub sigma_m: f64,
    /// The waypoints ahead, metres east and north.
    pub plan: Vec<[f64; 2]>,
    pub health: Vec<Health>,
    /// The version of the map now.
    pub map_version: u64,
    /// The map; only if [`VehicleOutlet::wants_map`] asked for it.
    pub map: Option<VehicleMap>,
}

/// The host's end of ROS 2 on the vehicle. It never waits.
#[derive(Debug)]
pub struct VehicleOutlet {
    desk: Arc<Desk>,
    _thread: Owner,
}

/// What host and thread share.
#[derive(Debug, Default)]
struct Desk {
    view: Mutex<Option<(SystemTime, VehicleView)>>,
    wants_map: AtomicBool,
}

impl VehicleOutlet {
    /// Whether the next view should have the map: it has subscribers, and was not given since it was wanted.
    pub fn wants_map(&self) -> bool {
        self.desk.wants_map.load(Ordering::Relaxed)
    }

    /// Replaces the view that was not published yet, if there is one; its map is kept if the new view has none.
    pub fn offer(&self, mut view: VehicleView) {
        let mut held = self.desk.view.lock().unwrap_or_else(PoisonError::into_inner);
        if view.map.is_some() {
            self.desk.wants_map.store(false, Ordering::Relaxed);
        } else if let Some((_, before)) = held.take() {
            view.map = before.map;
        }
        *held = Some((SystemTime::now(), view));
    }
}

/// Joins ROS 2, as soon as its transports start: the vehicle does not wait for them.
///
/// # Errors
///
/// The thread did not start.
pub fn start_vehicle(settings: &Ros2) -> Result<VehicleOutlet, UserError> {
    let desk = Arc::new(Desk::default());
    let (owner, owned) = stop::ends();
    let (settings, shared) = (settings.clone(), desk.clone());
    let run = move || {
        let Some(node) = RosNode::start_when_possible(&settings, "scenecast_vehicle", &owned) else { return };
        match VehicleTopics::new(&node) {
            Ok(topics) => Worker { node, topics, desk: shared }.run(&owned),
            Err(error) => tracing::error!("{error}; nothing is published"),
        }
    };
    let thread = std::thread::Builder::new().name("ros2-vehicle".to_owned());
    thread.spawn(run).map_err(|e| UserError::Failed(format!("ROS 2: no thread: {e}")))?;
    Ok(VehicleOutlet { desk, _thread: owner })
}

struct Worker {
    node: RosNode,
    topics: VehicleTopics,
    desk: Arc<Desk>,
}

impl Worker {
    fn run(mut self, owned: &Owned) {
        let mut version = 0;
        while owned.wait(TICK) {
            let view = self.desk.view.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some((time, view)) = view {
                version = view.map_version;
                self.topics.publish(&self.node, view, time);
            }
            if self.topics.needs_map(version) {
                self.desk.wants_map.store(true, Ordering::Relaxed);
            }
        }
    }
}

struct VehicleTopics {
    labels: Publisher<OccupancyGrid>,
    layers: Publisher<GridMap>,
    cloud: Publisher<PointCloud2>,
    published: MapVersions,
    last_map: Option<Instant>,
    pose: Publisher<PoseWithCovarianceStamped>,
    path: Publisher<Path>,
    plan: Publisher<Path>,
    diagnostics: Publisher<DiagnosticArray>,
    last_state: Option<Instant>,
    track: VecDeque<Place>,
}

impl VehicleTopics {
    fn new(node: &RosNode) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(name);
        Ok(Self {
            labels: node.publisher(&topic("map")?, Qos::Latched(1))?,
            layers: node.publisher(&topic("layers")?, Qos::Latched(1))?,
            cloud: node.publisher(&topic("cloud")?, Qos::Latched(1))?,
            published: MapVersions::default(),
            last_map: None,
            pose: node.publisher(&topic("pose")?, Qos::Reliable(10))?,
            path: node.publisher(&topic("path")?, Qos::Reliable(1))?,
            plan: node.publisher(&topic("plan")?, Qos::Reliable(1))?,
            diagnostics: node.publisher(&topic("diagnostics")?, Qos::Reliable(10))?,
            last_state: None,
            track: VecDeque::new(),
        })
    }

    /// Whether a map of this version has subscribers that do not have it yet, and enough time has passed.
    fn needs_map(&self, version: u64) -> bool {
        self.last_map.is_none_or(|last| last.elapsed() >= MAP_INTERVAL) && self.due(version).contains(&true)
    }

    fn due(&self, version: u64) -> [bool; 3] {
        let subscribers = [self.labels.subscribers(), self.layers.subscribers(), self.cloud.subscribers()];
        self.published.due(subscribers, version)
    }

    fn publish(&mut self, node: &RosNode, view: VehicleView, time: SystemTime) {
        let nanos = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64);
        let stamp = Time::from_nanos(nanos);
        let place = Place { stamp: stamp.clone(), position_m: view.position_m, heading_rad: view.heading_rad };
        self.extend_track(&place);
        if self.pose.subscribers() > 0 {
            self.pose.publish(pose(&place, view.sigma_m, MAP_FRAME));
        }
        if self.last_state.is_none_or(|last| last.elapsed() >= MAP_INTERVAL) {
            self.last_state = Some(Instant::now());
            self.publish_state(node, &view, &place);
        }
        if let Some(map) = view.map {
            self.publish_map(&map, &stamp);
        }
    }

    fn publish_state(&mut self, node: &RosNode, view: &VehicleView, place: &Place) {
        let stamp = &place.stamp;
        if self.path.subscribers() > 0 {
            self.path.publish(path(&self.track, header(stamp.clone(), MAP_FRAME)));
        }
        if self.plan.subscribers() > 0 {
            let up = place.position_m[2];
            let ahead = |&[east, north]: &[f64; 2]| Place { position_m: [east, north, up], ..place.clone() };
            let ahead: Vec<Place> = view.plan.iter().map(ahead).collect();
            self.plan.publish(path(&ahead, header(stamp.clone(), MAP_FRAME)));
        }
        if self.diagnostics.subscribers() > 0 {
            let health = view.health.iter().cloned().chain([node.health()]);
            self.diagnostics.publish(diagnostics(health, "vehicle", header(stamp.clone(), "")));
        }
    }

    fn publish_map(&mut self, map: &VehicleMap, stamp: &Time) {
        let due = self.due(map.version);
        self.last_map = Some(Instant::now());
        let header = || header(stamp.clone(), MAP_FRAME);
        let Some(grid) = self.published.grid(map) else { return };
        // One that was refused is tried again.
        let done = [
            due[0] && self.labels.publish(occupancy(&grid, header())),
            due[1] && self.layers.publish(layers(&grid, header())),
            due[2] && self.cloud.publish(cloud(&grid, header(), palette::colour)),
        ];
        self.published.handle_published(done, map.version);
    }

    fn extend_track(&mut self, place: &Place) {
        let [east, north, _] = place.position_m;
        let is_near = |last: &Place| (east - last.position_m[0]).hypot(north - last.position_m[1]) < PATH_STEP_M;
        if self.track.back().is_some_and(is_near) {
            return;
        }
        if self.track.len() >= MAX_PATH {
            self.track.pop_front();
        }
        self.track.push_back(place.clone());
    }
}

/// The map of a vehicle: labels, and levels of its layers.
#[derive(Debug, Clone)]
pub struct VehicleMap {
    pub version: u64,
    pub cell_m: f64,
    pub labels: LabelGrid,
    pub layers: Vec<(LayerDescriptor, LabelGrid)>,
}

/// The published version of labels, layers and cloud. A map that no message can have counts as published, so that it is not
/// copied again before it changes.
#[derive(Debug, Default)]
pub(crate) struct MapVersions {
    published: [Option<u64>; 3],
    is_too_large: bool,
}

impl MapVersions {
    /// Which topics have subscribers that do not have this version yet.
    pub fn due(&self, subscribers: [usize; 3], version: u64) -> [bool; 3] {
        std::array::from_fn(|i| subscribers[i] > 0 && self.published[i] != Some(version))
    }

    /// Notes which topics have this version.
    pub fn handle_published(&mut self, done: [bool; 3], version: u64) {
        self.published.iter_mut().zip(done).filter(|(_, done)| *done).for_each(|(topic, _)| *topic = Some(version));
    }

    /// The grid to publish; `None` if the map is empty or too large for a message, of which it warns once.
    pub fn grid(&mut self, map: &VehicleMap) -> Option<Grid> {
        let grid = grid(map);
        let bounds = map.labels.bounds();
        let is_too_large = grid.is_none() && bounds.is_some();
        if let Some(area) = bounds.filter(|_| is_too_large && !self.is_too_large) {
            let size = format!("{} x {} cells", area.width, area.height);
            tracing::warn!("ROS 2: the map spans {size}; one message has at most {MAX_GRID_CELLS}");
        }
        self.is_too_large = is_too_large;
        if grid.is_none() {
            self.handle_published([true; 3], map.version);
        }
        grid
    }
}

fn grid(map: &VehicleMap) -> Option<Grid> {
    let mut grid = Grid::new(map.labels.bounds()?, map.cell_m, (0.0, 0.0), |cell| map.labels.get(cell))?;
    for (layer, levels) in &map.layers {
        let is_depth = layer.quantity == Quantity::Depth;
        grid.add_layer(&layer.name, is_depth, |cell| layer.middle(levels.get(cell)));
    }
    Some(grid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::Cell;

    fn map(version: u64, cells: &[Cell]) -> VehicleMap {
        let mut labels = LabelGrid::default();
        for &cell in cells {
            labels.set(cell, 1);
        }
        VehicleMap { version, cell_m: 0.5, labels, layers: Vec::new() }
    }

    #[test]
    fn a_map_too_large_for_a_message_is_not_asked_for_again() {
        let (mut versions, wide) = (MapVersions::default(), map(7, &[Cell::new(0, 0), Cell::new(2999, 2999)]));
        assert_eq!(versions.due([1, 0, 1], 7), [true, false, true]);
        assert_eq!(versions.grid(&wide), None);
        assert!(versions.is_too_large, "it is reported");
        assert_eq!(versions.due([1, 1, 1], 7), [false; 3]);
        assert_eq!(versions.due([1, 1, 1], 8), [true; 3], "another version");
    }

    #[test]
    fn a_map_is_due_until_each_topic_has_it() {
        let (mut versions, small) = (MapVersions::default(), map(7, &[Cell::new(0, 0)]));
        assert_eq!(versions.grid(&small).unwrap().labels, [1]);
        versions.handle_published([true, false, false], 7);
        assert_eq!(versions.due([1, 1, 0], 7), [false, true, false]);
        assert_eq!(versions.grid(&map(8, &[])), None);
        assert_eq!((versions.due([1; 3], 8), versions.is_too_large), ([false; 3], false), "nothing to publish");
    }
}
