//! The map in view: that of an earlier run until the current one has as many cells.

use super::Surface;
use super::refusal::OrderRefusal;
use scenecast_protocol::link::IssueError;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{LabelGrid, LayerReplica, Rect, Replica, SharedTiles};
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;

impl Surface {
    pub fn map(&self, vehicle: Address) -> Option<&LabelGrid> {
        Some(self.replica(vehicle)?.shown())
    }

    /// The labels of the map in view with the time of each cell: those of the earlier map, if it is in view.
    pub fn replica(&self, vehicle: Address) -> Option<&Replica> {
        let earlier = self.records.get(&vehicle).and_then(|d| d.earlier_map()).map(|earlier| earlier.map.labels());
        earlier.or_else(|| self.link.vehicle(vehicle).map(|v| v.replica()))
    }

    /// The layers of the map in view.
    pub fn map_layers(&self, vehicle: Address) -> Vec<&LayerReplica> {
        if let Some(earlier) = self.records.get(&vehicle).and_then(|d| d.earlier_map()) {
            return earlier.map.layers().map(|(_, layer)| layer).collect();
        }
        let Some(view) = self.link.vehicle(vehicle) else { return Vec::new() };
        view.layers().iter().filter_map(|(id, _)| view.layer(id)).collect()
    }

    /// The number of cells with a label that the vehicle has sent in its current run, in view or not.
    pub fn current_cells(&self, vehicle: Address) -> usize {
        let count = |view: PeerView<'_>| view.replica().counts().map(|(_, cells)| cells as usize).sum();
        self.link.vehicle(vehicle).map_or(0, count)
    }

    /// The labels of the map in view in tiles. They are shared, so a clone stays as it is and costs little.
    pub fn map_tiles(&self, vehicle: Address) -> Option<SharedTiles> {
        Some(self.replica(vehicle)?.tiles().clone())
    }

    /// The smallest rectangle around the explored cells of the map in view.
    pub fn map_bounds(&self, vehicle: Address) -> Option<Rect> {
        self.replica(vehicle)?.bounds()
    }

    /// A number that grows whenever the operator's map of a vehicle or one of its layers changes.
    pub fn map_version(&self, vehicle: Address) -> u64 {
        let (record, view) = (self.records.get(&vehicle), self.link.vehicle(vehicle));
        record.zip(view).map_or(0, |(record, view)| record.map_version(&view))
    }

    /// The number of cells of each label on the operator's map.
    pub fn labels(&self, vehicle: Address) -> Option<BTreeMap<u8, u32>> {
        Some(self.replica(vehicle)?.counts().collect())
    }

    /// The labels of the map in view that an order may name.
    pub(super) fn labels_for_orders(&self, vehicle: Address) -> Result<BTreeMap<u8, u32>, OrderRefusal> {
        let record = self.records.get(&vehicle).ok_or(IssueError::NoVehicle)?;
        if let Some(earlier) = record.earlier_map().filter(|earlier| earlier.epoch != record.epoch) {
            return Err(OrderRefusal::EarlierMap { in_view: earlier.epoch, now: record.epoch });
        }
        Ok(self.labels(vehicle).ok_or(IssueError::NoVehicle)?)
    }
}
