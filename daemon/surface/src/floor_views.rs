//! The views of the sea floor that have arrived from a vehicle.

use super::exemplar_cache::StoredExemplar;
use crate::state::{FloorImage, FloorList, seconds};
use scenecast_protocol::exemplar::FloorView;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// The middle of a view in the vehicle's map frame, decimetres east and north: a view with the same middle replaces it.
pub type FloorPlace = (i32, i32);

/// The views of the sea floor of one run of a vehicle, each with the number of its arrival.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FloorViews {
    views: BTreeMap<FloorPlace, (u64, StoredExemplar)>,
    version: u64,
    bytes: usize,
}

impl FloorViews {
    /// The most views, and their most bytes. Beyond them the oldest is dropped.
    const MAX_VIEWS: usize = 4096;
    const MAX_BYTES: usize = 12 << 20;

    /// A number that grows with each view that arrives.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The number of views that are held.
    pub fn count(&self) -> usize {
        self.views.len()
    }

    /// Bytes of all images as they are stored.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The views with the numbers of their arrival.
    pub fn iter(&self) -> impl Iterator<Item = (FloorPlace, u64, &StoredExemplar)> {
        self.views.iter().map(|(place, (number, view))| (*place, *number, view))
    }

    /// The view with this middle.
    pub fn get(&self, place: FloorPlace) -> Option<&StoredExemplar> {
        self.views.get(&place).map(|(_, view)| view)
    }

    /// Takes a view, whose latest camera frame was `taken` then. Returns whether it was one.
    pub(super) fn handle(&mut self, view: &FloorView, taken: Option<Instant>, now: Instant) -> bool {
        let Some(webp) = view.webp() else { return false };
        let (size, sent_bytes, view) = (view.size, view.encode().len(), view.view);
        self.insert(StoredExemplar { number: 0, size, webp, sent_bytes, received: now, requested: false, view, taken });
        true
    }

    /// Puts a view in the place of one with the same middle.
    pub(super) fn insert(&mut self, view: StoredExemplar) {
        self.version += 1;
        self.bytes += view.webp.len();
        let before = self.views.insert((view.view.east_dm, view.view.north_dm), (self.version, view));
        self.bytes -= before.map_or(0, |(_, before)| before.webp.len());
        while self.views.len() > Self::MAX_VIEWS || self.bytes > Self::MAX_BYTES {
            let oldest = self.views.iter().min_by_key(|(_, (number, _))| *number).map(|(place, _)| *place);
            let Some((_, gone)) = oldest.and_then(|place| self.views.remove(&place)) else { return };
            self.bytes -= gone.webp.len();
        }
    }
}

/// The views of a vehicle that have arrived after a version.
pub fn floor_list(vehicle: u8, views: &FloorViews, since: u64) -> FloorList {
    let image =
        |(place, number, view): (FloorPlace, u64, &StoredExemplar)| (number, floor_image(vehicle, place, number, view));
    let mut images: Vec<_> = views.iter().filter(|(_, number, _)| *number > since).map(image).collect();
    images.sort_by_key(|(number, _)| *number);
    FloorList { version: views.version(), images: images.into_iter().map(|(_, image)| image).collect() }
}

fn floor_image(vehicle: u8, (east_dm, north_dm): FloorPlace, number: u64, view: &StoredExemplar) -> FloorImage {
    let (x_m, y_m) = view.view.middle_m();
    FloorImage {
        url: format!("/api/v2/vehicles/{vehicle}/floor/{east_dm}_{north_dm}.webp?number={number}"),
        x_m,
        y_m,
        width_m: view.width_m().unwrap_or_default(),
        at_s: seconds(view.received),
        taken_s: view.taken.map(seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::exemplar::ExemplarView;

    fn view(east_dm: i32, size: u8, bytes: usize) -> FloorView {
        let view = ExemplarView { width_mm: 2000, east_dm, north_dm: 10, clock_ms: None };
        FloorView { size, view, bytes: [&[0x10, 0, 0][..], &vec![9; bytes]].concat() }
    }

    #[test]
    fn a_view_replaces_one_with_the_same_middle() {
        let mut views = FloorViews::default();
        for (n, east_dm) in [10, 30, 10].into_iter().enumerate() {
            assert!(views.handle(&view(east_dm, n as u8 / 2, 40), None, Instant::from_secs_f64(n as f64)));
        }
        let all: Vec<_> = views.iter().map(|(place, number, view)| (place, number, view.size)).collect();
        assert_eq!((all, views.version()), (vec![((10, 10), 3, 1), ((30, 10), 2, 0)], 3));
        let broken = FloorView { bytes: vec![1], ..view(50, 0, 1) };
        assert!(!views.handle(&broken, None, Instant::ZERO) && views.get((50, 10)).is_none());
    }

    #[test]
    fn views_are_bounded_and_the_newest_are_kept() {
        let mut views = FloorViews::default();
        for n in 0..2000 {
            views.handle(&view(20 * n, 1, 8000), None, Instant::ZERO);
        }
        assert!(views.bytes() <= FloorViews::MAX_BYTES && views.count() > 1000);
        assert_eq!(views.bytes(), views.iter().map(|(_, _, view)| view.webp.len()).sum::<usize>());
        assert!(views.get((0, 10)).is_none() && views.get((20 * 1999, 10)).is_some());
    }
}
