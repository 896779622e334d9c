//! The pictures of the sea floor that the vehicle sends with what the link has to spare.

use super::evidence::FrameClock;
use crate::exemplar::{GOOD_SSIM, compress_to};
use crate::mosaic::{FloorTile, TilePlace};
use image::RgbImage;
use image::imageops::{FilterType, resize};
use scenecast_protocol::directive::Series;
use scenecast_protocol::exemplar::{ExemplarView, FloorView, edge_px, max_bytes};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::object::ObjectId;
use scenecast_protocol::schedule::BackgroundStream;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// Pictures in flight at a time: enough that the next one begins before the surface has told that it has the last one, and with all
/// exemplars not more than the link takes.
const MAX_IN_FLIGHT: usize = 6;
/// The size class of a whole picture; class 0 is sent first.
const WHOLE: u8 = 1;
/// Tiles that are kept; of more, the oldest is dropped.
const MAX_TILES: usize = 4096;
/// Of these, those with pixels, 50 kB each. The others are kept as they were sent.
const MAX_PICTURES: usize = 512;

/// The picture of a tile, as it is kept.
#[derive(Debug)]
enum Kept {
    /// It was not sent whole yet.
    Picture(FloorTile),
    /// As it was sent whole.
    Sent(FloorView),
}

#[derive(Debug)]
struct Tile {
    kept: Kept,
    /// Counts the tiles, so that the oldest are known.
    serial: u64,
    /// How many sizes the surface has, or are in flight.
    sizes: u8,
}

#[derive(Debug, Clone, Copy)]
struct InFlight {
    at: TilePlace,
    serial: u64,
    size: u8,
    object: ObjectId,
}

/// The tiles, and how much of each was sent.
#[derive(Debug, Default)]
pub(super) struct FloorPictures {
    tiles: BTreeMap<TilePlace, Tile>,
    in_flight: Vec<InFlight>,
    serial: u64,
    /// The series of the surface that has what was sent.
    series: Option<Series>,
}

impl FloorPictures {
    /// Takes new pictures, each of which replaces an earlier one of its tile.
    pub(super) fn add(&mut self, tiles: &[FloorTile]) {
        for tile in tiles {
            self.serial += 1;
            let new = Tile { kept: Kept::Picture(tile.clone()), serial: self.serial, sizes: 0 };
            self.tiles.insert(tile.at, new);
        }
        let is_picture = |tile: &Tile| matches!(tile.kept, Kept::Picture(_));
        while self.tiles.values().filter(|tile| is_picture(tile)).count() > MAX_PICTURES {
            self.drop_oldest(is_picture);
        }
        while self.tiles.len() > MAX_TILES {
            self.drop_oldest(|_| true);
        }
    }

    fn drop_oldest(&mut self, is_one: impl Fn(&Tile) -> bool) {
        let of_kind = self.tiles.iter().filter(|(_, tile)| is_one(tile));
        let oldest = of_kind.min_by_key(|(_, tile)| tile.serial).map(|(at, _)| *at);
        oldest.map(|at| self.tiles.remove(&at));
    }

    /// Sends the next pictures: every tile in its small size, the oldest first, then the whole ones, those with the greatest `weight` of
    /// their tile and its middle first.
    pub(super) fn serve(
        &mut self,
        weight: impl Fn(TilePlace, (f64, f64)) -> f64,
        frames: &FrameClock,
        link: &mut VehicleLink,
        now: Instant,
    ) {
        self.follow(link.persistent_state().series());
        if !link.background().has(BackgroundStream::Floor) {
            return self.withdraw(link);
        }
        while self.in_flight.len() < MAX_IN_FLIGHT && link.background_object_bytes() < max_bytes(WHOLE) {
            let Some(at) = self.next(&weight) else { return };
            let Some(tile) = self.tiles.get_mut(&at) else { return };
            let view = match &tile.kept {
                Kept::Sent(view) => Some(view.clone()),
                Kept::Picture(picture) => coded(picture, tile.sizes, frames, now),
            };
            tile.sizes += 1;
            let Some(view) = view else { continue };
            if view.size >= WHOLE {
                (tile.kept, tile.sizes) = (Kept::Sent(view.clone()), WHOLE + 1);
            }
            let Some(object) = link.push_last_object(view.encode()) else { continue };
            self.in_flight.push(InFlight { at, serial: tile.serial, size: view.size, object });
        }
    }

    /// Another surface has no picture yet.
    fn follow(&mut self, series: Option<Series>) {
        if self.series.is_some() && series != self.series {
            self.tiles.values_mut().for_each(|tile| tile.sizes = 0);
        }
        self.series = series;
    }

    fn next(&self, weight: impl Fn(TilePlace, (f64, f64)) -> f64) -> Option<TilePlace> {
        let small = self.tiles.iter().filter(|(_, tile)| tile.sizes == 0).min_by_key(|(_, tile)| tile.serial);
        let whole = || {
            let open = self.tiles.iter().filter(|(_, tile)| tile.sizes == WHOLE);
            let weighed = open.map(|(at, tile)| (weight(*at, tile.kept.middle_m()), tile.serial, at));
            weighed.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))).map(|(_, _, at)| at)
        };
        small.map(|(at, _)| at).or_else(whole).copied()
    }

    /// The surface has an object completely.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.in_flight.retain(|in_flight| in_flight.object != id);
    }

    /// A new run of the link has begun, in which nothing is in flight.
    pub(super) fn handle_restart(&mut self, link: &mut VehicleLink) {
        self.withdraw(link);
    }

    /// Stops what is in flight; it is sent again later.
    fn withdraw(&mut self, link: &mut VehicleLink) {
        for InFlight { at, serial, size, object } in std::mem::take(&mut self.in_flight) {
            link.cancel_object(object);
            if let Some(tile) = self.tiles.get_mut(&at).filter(|tile| tile.serial == serial) {
                tile.sizes = tile.sizes.min(size);
            }
        }
    }
}

impl Kept {
    /// The middle in the map frame, metres east and north.
    fn middle_m(&self) -> (f64, f64) {
        match self {
            Self::Picture(picture) => picture.middle_m,
            Self::Sent(view) => view.view.middle_m(),
        }
    }
}

/// The picture of a tile in a size class; `None` if it cannot be compressed.
fn coded(tile: &FloorTile, size: u8, frames: &FrameClock, now: Instant) -> Option<FloorView> {
    let edge = edge_px(size);
    let smaller: RgbImage;
    let picture = match tile.picture.width() == edge {
        true => &*tile.picture,
        false => {
            smaller = resize(&*tile.picture, edge, edge, FilterType::Triangle);
            &smaller
        }
    };
    let bytes = compress_to(picture, GOOD_SSIM, max_bytes(size))?.bytes;
    let view = ExemplarView::new(tile.width_m, tile.middle_m, frames.taken(tile.t_s), now);
    (view.width_mm > 0).then_some(FloorView { size, view, bytes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_config;
    use image::Rgb;
    use scenecast_config::{Config, modem_profile};
    use scenecast_protocol::schedule::BackgroundOrder;

    fn link() -> VehicleLink {
        let config = Config::default();
        let profile = modem_profile(&config, config.modem.bit_rate);
        let link = link_config(&config, None, profile).unwrap();
        VehicleLink::new(link, config.map.codec, 1, Default::default(), Instant::ZERO)
    }

    fn tile(column: i32) -> FloorTile {
        let picture = RgbImage::from_fn(128, 128, |x, y| Rgb([(x * 2) as u8, (y * 2) as u8, column as u8]));
        let middle_m = (2.0 * f64::from(column) + 1.0, 1.0);
        FloorTile { at: (column, 0), picture: picture.into(), middle_m, width_m: 2.0, t_s: 0.0 }
    }

    /// Column and size class of what is sent; the surface has each object at once.
    fn sent(floor: &mut FloorPictures, link: &mut VehicleLink) -> Vec<(i32, u8)> {
        let mut sent = Vec::new();
        loop {
            floor.serve(|(column, _), _| f64::from(column), &FrameClock::default(), link, Instant::ZERO);
            if floor.in_flight.is_empty() {
                return sent;
            }
            for InFlight { at, size, object, .. } in std::mem::take(&mut floor.in_flight) {
                sent.push((at.0, size));
                link.cancel_object(object);
            }
        }
    }

    #[test]
    fn every_tile_is_sent_small_before_any_is_sent_whole() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&[tile(3), tile(1), tile(2)]);
        assert_eq!(sent(&mut floor, &mut link), [(3, 0), (1, 0), (2, 0), (3, 1), (2, 1), (1, 1)], "then by weight");
        floor.add(&[tile(1)]);
        assert_eq!(sent(&mut floor, &mut link), [(1, 0), (1, 1)], "more of it was seen");
    }

    #[test]
    fn what_was_in_flight_is_sent_again_after_a_restart_of_the_link() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&[tile(1)]);
        floor.serve(|_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        let object = floor.in_flight[0].object;
        floor.handle_restart(&mut link);
        assert_eq!(sent(&mut floor, &mut link), [(1, 1)], "it was on its way whole");
        floor.handle_delivered(object);
        floor.tiles.values_mut().for_each(|tile| tile.sizes = 0);
        assert_eq!(sent(&mut floor, &mut link), [(1, 1)], "another surface gets it whole at once");
    }

    #[test]
    fn no_more_is_in_flight_than_the_link_takes_and_nothing_unless_it_is_listed() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&(0..40).map(tile).collect::<Vec<_>>());
        floor.serve(|_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        assert!((1..=MAX_IN_FLIGHT).contains(&floor.in_flight.len()));
        link.set_background(BackgroundOrder::new(&[BackgroundStream::Exemplars]).unwrap());
        floor.serve(|_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        assert_eq!((floor.in_flight.len(), link.background_object_bytes()), (0, 0));
    }

    #[test]
    fn the_newest_tiles_are_kept() {
        let mut floor = FloorPictures::default();
        floor.add(&(0..600).map(tile).collect::<Vec<_>>());
        assert_eq!(floor.tiles.len(), MAX_PICTURES);
        assert!(!floor.tiles.contains_key(&(0, 0)) && floor.tiles.contains_key(&(599, 0)));
    }
}
