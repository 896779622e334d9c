//! The producers of the map: the scene model, or another program.

use crate::{MapUpdate, Mapper};

/// A producer of the label map. The configuration selects one; the vehicle sends the maps of any of them alike.
pub trait MapProducer {
    /// The map after the last frame or item.
    fn current(&self) -> MapUpdate;

    /// The epoch that the labels belong to.
    fn epoch(&self) -> u8;

    /// Mission time of the last frame or item, seconds.
    fn last_s(&self) -> Option<f64>;

    /// Continues after a restart in `epoch`. Labels up to `published` may be known at the surface.
    fn resume(&mut self, epoch: u8, published: u8);

    /// Encodes the producer for its checkpoint. `lineage` is the number of the mission.
    fn save(&self, lineage: u64) -> Vec<u8>;
}

impl MapProducer for Mapper {
    fn current(&self) -> MapUpdate {
        self.current()
    }

    fn epoch(&self) -> u8 {
        self.epoch()
    }

    fn last_s(&self) -> Option<f64> {
        self.last_s()
    }

    fn resume(&mut self, epoch: u8, published: u8) {
        self.resume(epoch, published);
    }

    fn save(&self, lineage: u64) -> Vec<u8> {
        self.save(lineage)
    }
}
