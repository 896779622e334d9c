//! The views of the sea floor that have arrived from a vehicle.

use super::exemplar_cache::StoredExemplar;
use crate::state::{FloorImage, FloorList, seconds};
use scenecast_protocol::exemplar::FloorView;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// The middle of a view in the vehicle's map frame, decimetres east and north: a view with the same middle replaces it.
pub type FloorPlace = (i32, i32);

/// The views of the sea floor on one map of a vehicle, each with the number of its arrival. The number of its image is the part that was
/// seen, in 63rds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FloorViews {
    /// The epoch of the map that they lie on.
    epoch: u8,
    views: BTreeMap<FloorPlace, (u64, StoredExemplar)>,
    version: u64,
    bytes: usize,
}

impl FloorViews {
    /// The most views, and their most bytes. Beyond them the oldest is dropped.
    const MAX_VIEWS: usize = 4096;
    const MAX_BYTES: usize = 12 << 20;

    /// None of a map in this epoch.
    pub(super) fn of_epoch(epoch: u8) -> Self {
        Self { epoch, ..Self::default() }
    }

    /// The map has this epoch: views of another one are gone.
    pub(super) fn follow(&mut self, epoch: u8) {
        if self.epoch != epoch {
            *self = Self::of_epoch(epoch);
        }
    }

    /// The epoch of the map that they lie on.
    pub fn epoch(&self) -> u8 {
        self.epoch
    }

    /// The number of the last view: mission time in microseconds, so that it grows across restarts too.
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

    /// Takes a view, whose latest camera frame was `taken` then. Returns whether there is something new to see.
    pub(super) fn handle(&mut self, view: &FloorView, taken: Option<Instant>, now: Instant) -> bool {
        let Some(webp) = view.webp() else { return false };
        // It may come before the report that tells the epoch.
        self.follow(view.epoch);
        let (number, size, sent_bytes, view) = (view.seen, view.size, view.encode().len(), view.view);
        let known = self.get((view.east_dm, view.north_dm)).map(|known| (known.number, known.size));
        if known.is_some_and(|known| known > (number, size)) {
            // An earlier size is late, or a vehicle that was restarted has seen less of it.
            return false;
        }
        self.insert(StoredExemplar { number, size, webp, sent_bytes, received: now, requested: false, view, taken });
        true
    }

    /// Puts a view in the place of one with the same middle.
    pub(super) fn insert(&mut self, view: StoredExemplar) {
        self.version = view.received.as_micros().max(self.version + 1);
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

impl FloorImage {
    /// The path on this server of the image with this middle and number of arrival.
    pub fn url(vehicle: u8, (east_dm, north_dm): FloorPlace, number: u64) -> String {
        format!("/api/v2/vehicles/{vehicle}/floor/{east_dm}_{north_dm}.webp?number={number}")
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

fn floor_image(vehicle: u8, place: FloorPlace, number: u64, view: &StoredExemplar) -> FloorImage {
    let (x_m, y_m) = view.view.middle_m();
    FloorImage {
        url: FloorImage::url(vehicle, place, number),
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
        FloorView { epoch: 1, seen: 50, size, view, bytes: [&[0x10, 0, 0][..], &vec![9; bytes]].concat() }
    }

    #[test]
    fn a_view_replaces_one_with_the_same_middle() {
        let mut views = FloorViews::default();
        for (n, east_dm) in [10, 30, 10].into_iter().enumerate() {
            assert!(views.handle(&view(east_dm, n as u8 / 2, 40), None, Instant::from_secs_f64(n as f64)));
        }
        let all: Vec<_> = views.iter().map(|(place, number, view)| (place, number, view.size)).collect();
        assert_eq!((all, views.version()), (vec![((10, 10), 2_000_000, 1), ((30, 10), 1_000_000, 0)], 2_000_000));
        let now = Instant::from_secs_f64(3.0);
        assert!(!views.handle(&view(10, 0, 40), None, now), "the smaller one is late");
        assert!(!views.handle(&FloorView { seen: 20, ..view(10, 1, 40) }, None, now), "less of it was seen");
        assert!(views.handle(&FloorView { seen: 63, ..view(10, 0, 40) }, None, now), "more of it was seen");
        let broken = FloorView { bytes: vec![1], ..view(50, 0, 1) };
        assert!(!views.handle(&broken, None, Instant::ZERO) && views.get((50, 10)).is_none());
    }

    #[test]
    fn views_of_an_earlier_map_are_gone_and_others_stay() {
        let mut views = FloorViews::default();
        views.handle(&view(10, 0, 40), None, Instant::ZERO);
        views.follow(1);
        assert_eq!(views.count(), 1);
        views.handle(&FloorView { epoch: 2, ..view(30, 0, 40) }, None, Instant::ZERO);
        views.follow(2);
        assert_eq!((views.count(), views.epoch(), views.bytes()), (1, 2, views.get((30, 10)).unwrap().webp.len()));
        views.follow(3);
        assert_eq!((views.count(), views.bytes()), (0, 0));
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
