//! For comparison: the whole map as a PNG whenever it has changed, instead of what changed.

use scenecast_core::label_picture;
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::object::ObjectId;

/// A map that travels as one object at a time, the newest version as soon as the last one is through.
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

    /// Sets labels of cells; a change makes a new version.
    pub(super) fn set(&mut self, cells: impl Iterator<Item = (Cell, u8)>) {
        let changed = cells.filter(|&(cell, label)| self.map.set(cell, label) != label).count();
        self.version += u64::from(changed > 0);
    }

    /// Whether the surface has the newest version.
    pub(super) fn is_converged(&self) -> bool {
        self.outstanding.is_none() && self.sent == self.version
    }

    /// Hands the newest version to the link, unless one is under way or nothing has changed.
    pub(super) fn push(&mut self, link: &mut VehicleLink) {
        if self.outstanding.is_some() || self.sent == self.version {
            return;
        }
        if let Ok(png) = label_picture::encode(&self.map) {
            self.outstanding = link.push_object(label_picture::with_place(&self.map, &png));
            self.sent = self.version;
        }
    }

    /// The surface has all of an object.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.outstanding = self.outstanding.filter(|&o| o != id);
    }

    /// The surface has lost what it had.
    pub(super) fn send_again(&mut self) {
        (self.sent, self.outstanding) = (0, None);
    }
}
