//! For comparison: sends the whole map as a PNG file after each change.

use scenecast_core::label_picture;
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::object::ObjectId;

/// A map that is sent as one object at a time. The newest version follows as soon as the last object has arrived.
#[derive(Debug, Default)]
pub(super) struct WholePng {
    map: LabelGrid,
    version: u64,
    /// The version that was sent last; 0: none.
    sent: u64,
    outstanding: Option<ObjectId>,
}

impl WholePng {
    pub(super) fn map(&self) -> &LabelGrid {
        &self.map
    }

    pub(super) fn version(&self) -> u64 {
        self.version
    }

    /// Sets the labels of cells. A change makes a new version.
    pub(super) fn set(&mut self, cells: impl Iterator<Item = (Cell, u8)>) {
        let changed = cells.filter(|&(cell, label)| self.map.set(cell, label) != label).count();
        self.version += u64::from(changed > 0);
    }

    pub(super) fn is_converged(&self) -> bool {
        self.outstanding.is_none() && self.sent == self.version
    }

    /// Hands the newest version to the link, unless an object is in flight or the version was sent.
    pub(super) fn push(&mut self, link: &mut VehicleLink) {
        if self.outstanding.is_some() || self.sent == self.version {
            return;
        }
        if let Ok(png) = label_picture::encode(&self.map) {
            self.outstanding = link.push_object(label_picture::with_place(&self.map, &png));
            self.sent = self.version;
        }
    }

    /// The surface has an object completely.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.outstanding = self.outstanding.filter(|&o| o != id);
    }

    /// The surface has lost its map.
    pub(super) fn send_again(&mut self) {
        (self.sent, self.outstanding) = (0, None);
    }
}
