//! The operator's map of one vehicle: labels, layers and cloud.

use super::Desk;
use crate::node::{Publisher, RosNode};
use crate::transport::Qos;
use scenecast_core::{UserError, palette};
use scenecast_messages::contents::{MAX_GRID_CELLS, cloud, layers, occupancy};
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::sensor_msgs::PointCloud2;
use scenecast_messages::std_msgs::Header;
use scenecast_surface::messages::grid;
use scenecast_surface::state::VehicleState;
use scenecast_surface::{ClientRequest, Reply, SurfaceRequest};
use std::time::{Duration, Instant};

/// Minimum time between two maps.
const MAP_INTERVAL: Duration = Duration::from_secs(1);

/// What a published map depends on: version, epoch, run of an earlier map, placement and, for the cloud, colours.
#[derive(Debug, Clone, PartialEq, Default)]
struct MapKey {
    version: u64,
    epoch: u8,
    earlier_run: Option<u32>,
    shift_m: (f64, f64),
    colours: Vec<(u8, [u8; 3])>,
}

/// The three messages of a map, which are made only for subscribers.
pub(super) struct MapTopics {
    labels: (Publisher<OccupancyGrid>, Option<MapKey>),
    layers: (Publisher<GridMap>, Option<MapKey>),
    cloud: (Publisher<PointCloud2>, Option<MapKey>),
    last: Option<Instant>,
    is_too_large: bool,
}

impl MapTopics {
    pub fn new(node: &RosNode, part: &str) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(&format!("{part}/{name}"));
        Ok(Self {
            labels: (node.publisher(&topic("map")?, Qos::Latched(1))?, None),
            layers: (node.publisher(&topic("layers")?, Qos::Latched(1))?, None),
            cloud: (node.publisher(&topic("cloud")?, Qos::Latched(1))?, None),
            last: None,
            is_too_large: false,
        })
    }

    /// Publishes the map where it has changed and somebody subscribes.
    pub fn publish(&mut self, desk: &Desk, vehicle: &VehicleState, header: impl Fn() -> Header) {
        let key = key(vehicle);
        let is_due =
            |subscribers: usize, published: &Option<MapKey>| subscribers > 0 && *published != Some(key.clone());
        let due = [
            is_due(self.labels.0.subscribers(), &self.labels.1),
            is_due(self.layers.0.subscribers(), &self.layers.1),
            is_due(self.cloud.0.subscribers(), &self.cloud.1),
        ];
        let is_early = self.last.is_some_and(|last| last.elapsed() < MAP_INTERVAL);
        if is_early || !due.contains(&true) || vehicle.map.width == 0 {
            return;
        }
        self.last = Some(Instant::now());
        let request = ClientRequest { by: None, request: SurfaceRequest::Map(vehicle.id) };
        let Some(Reply::Map(cells)) = desk.request(request) else { return };
        let Some(grid) = grid(&cells, key.shift_m) else {
            // It counts as published, so that it is not read again before it changes.
            (self.labels.1, self.layers.1, self.cloud.1) = (Some(key.clone()), Some(key.clone()), Some(key));
            return self.report_size(vehicle);
        };
        self.is_too_large = false;
        let colour = |label| key.colours.iter().find(|c| c.0 == label).map_or(palette::colour(label), |c| c.1);
        // One that was refused is tried again.
        if due[0] && self.labels.0.publish(occupancy(&grid, header())) {
            self.labels.1 = Some(key.clone());
        }
        if due[1] && self.layers.0.publish(layers(&grid, header())) {
            self.layers.1 = Some(key.clone());
        }
        if due[2] && self.cloud.0.publish(cloud(&grid, header(), colour)) {
            self.cloud.1 = Some(key.clone());
        }
    }

    fn report_size(&mut self, vehicle: &VehicleState) {
        if !std::mem::replace(&mut self.is_too_large, true) {
            let (name, map) = (&vehicle.name, &vehicle.map);
            let size = format!("{} x {} cells", map.width, map.height);
            tracing::warn!("ROS 2: the map of {name} spans {size}; one message has at most {MAX_GRID_CELLS}");
        }
    }
}

fn key(vehicle: &VehicleState) -> MapKey {
    let (map, book) = (&vehicle.map, &vehicle.label_book);
    MapKey {
        version: map.version,
        epoch: map.epoch,
        earlier_run: map.earlier.as_ref().map(|earlier| earlier.run),
        shift_m: map.shift_m(),
        colours: vehicle.labels.iter().map(|label| (label.id, book.class_colour(label.id))).collect(),
    }
}
