//! The pictures of the sea floor that the vehicle sends with what the link has to spare.

use super::evidence::FrameClock;
use crate::exemplar::{GOOD_SSIM, compress_to};
use crate::mosaic::{FloorTile, TILE_PX, TilePlace};
use image::RgbImage;
use image::imageops::{FilterType, resize};
use scenecast_protocol::directive::Series;
use scenecast_protocol::exemplar::{ExemplarView, FloorView, edge_px, max_bytes};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::object::ObjectId;
use scenecast_protocol::schedule::BackgroundStream;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Pictures in flight at a time: enough that the next one begins before the surface has told that it has the last one, and with all
/// exemplars not more than the link takes.
const MAX_IN_FLIGHT: usize = 6;
/// One that is longer in flight is written again, as the times in it are told by the vehicle's clock, which wraps.
const MAX_IN_FLIGHT_TIME: Duration = Duration::from_secs(30 * 60);
/// The size class of a whole picture; class 0 is sent first.
const WHOLE: u8 = 1;
/// Tiles that are kept; of more, the oldest is dropped.
const MAX_TILES: usize = 4096;
/// Of these, those with pixels, 50 kB each. The others are kept as they were sent.
const MAX_PICTURES: usize = 512;

/// The picture of a tile: its pixels until it was sent whole, and from then on what was sent.
#[derive(Debug)]
enum Picture {
    Pixels(Arc<RgbImage>),
    Coded(Vec<u8>),
}

#[derive(Debug)]
struct SentTile {
    /// Counts the tiles, so that the oldest are known.
    serial: u64,
    picture: Picture,
    middle_m: (f64, f64),
    width_m: f64,
    /// Mission time of the last frame in it, seconds.
    t_s: f64,
    /// Pixels that a frame has shown.
    seen: u32,
    /// The size class that is sent next; above [`WHOLE`], the surface has it whole, or that is in flight.
    next: u8,
}

#[derive(Debug, Clone, Copy)]
struct InFlight {
    at: TilePlace,
    serial: u64,
    size: u8,
    object: ObjectId,
    since: Instant,
}

/// The tiles, and how much of each was sent.
#[derive(Debug, Default)]
pub(super) struct FloorPictures {
    tiles: BTreeMap<TilePlace, SentTile>,
    in_flight: Vec<InFlight>,
    serial: u64,
    /// The series of the surface that has what was sent.
    series: Option<Series>,
}

impl FloorPictures {
    /// Takes new pictures, each of which replaces an earlier one of its tile of which no more was seen.
    pub(super) fn add(&mut self, tiles: &[FloorTile], link: &mut VehicleLink) {
        for tile in tiles {
            let known = self.tiles.get(&tile.at);
            if known.is_some_and(|known| known.seen > tile.seen) {
                continue;
            }
            // What the surface has whole must not become small again.
            let next = if known.is_some_and(|known| known.next > WHOLE) { WHOLE } else { 0 };
            self.withdraw(link, |in_flight| in_flight.at == tile.at);
            self.serial += 1;
            let FloorTile { at, middle_m, width_m, t_s, seen, .. } = *tile;
            let picture = Picture::Pixels(tile.picture.clone());
            self.tiles.insert(at, SentTile { serial: self.serial, picture, middle_m, width_m, t_s, seen, next });
        }
        let has_pixels = |tile: &SentTile| matches!(tile.picture, Picture::Pixels(_));
        while self.tiles.values().filter(|tile| has_pixels(tile)).count() > MAX_PICTURES {
            self.drop_oldest(has_pixels);
        }
        while self.tiles.len() > MAX_TILES {
            self.drop_oldest(|_| true);
        }
    }

    fn drop_oldest(&mut self, is_one: impl Fn(&SentTile) -> bool) {
        let of_kind = self.tiles.iter().filter(|(_, tile)| is_one(tile));
        let oldest = of_kind.min_by_key(|(_, tile)| tile.serial).map(|(at, _)| *at);
        oldest.map(|at| self.tiles.remove(&at));
    }

    /// Sends the next pictures on the map of `epoch`: every tile in its small size, the newest first, then the whole ones, those with the
    /// greatest `weight` of their tile and its middle first.
    pub(super) fn serve(
        &mut self,
        epoch: u8,
        weight: impl Fn(TilePlace, (f64, f64)) -> f64,
        frames: &FrameClock,
        link: &mut VehicleLink,
        now: Instant,
    ) {
        self.follow(link.persistent_state().series());
        let is_listed = link.background().has(BackgroundStream::Floor);
        self.withdraw(link, |in_flight| !is_listed || now.since(in_flight.since) > MAX_IN_FLIGHT_TIME);
        while is_listed && self.in_flight.len() < MAX_IN_FLIGHT && link.background_object_bytes() < max_bytes(WHOLE) {
            let Some(at) = self.next(&weight) else { return };
            let Some(tile) = self.tiles.get_mut(&at) else { return };
            let size = tile.next;
            tile.next += 1;
            let Some(view) = tile.view(epoch, size, frames, now) else { continue };
            let Some(object) = link.push_last_object(view.encode()) else { continue };
            self.in_flight.push(InFlight { at, serial: tile.serial, size, object, since: now });
        }
    }

    /// Another surface has no picture yet.
    fn follow(&mut self, series: Option<Series>) {
        if self.series.is_some() && series != self.series {
            self.send_all_again();
        }
        self.series = series;
    }

    fn send_all_again(&mut self) {
        for tile in self.tiles.values_mut() {
            tile.next = if matches!(tile.picture, Picture::Coded(_)) { WHOLE } else { 0 };
        }
    }

    fn next(&self, weight: impl Fn(TilePlace, (f64, f64)) -> f64) -> Option<TilePlace> {
        // Two sizes of one tile might arrive in the other order.
        let is_free = |at: &TilePlace| !self.in_flight.iter().any(|in_flight| in_flight.at == *at);
        let of_size = |size: u8| self.tiles.iter().filter(move |(at, tile)| tile.next == size && is_free(at));
        let small = of_size(0).max_by_key(|(_, tile)| tile.serial);
        let whole = || {
            let weighed = of_size(WHOLE).map(|(at, tile)| (weight(*at, tile.middle_m), tile.serial, at));
            weighed.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))).map(|(_, _, at)| at)
        };
        small.map(|(at, _)| at).or_else(whole).copied()
    }

    /// The surface has an object completely.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.in_flight.retain(|in_flight| in_flight.object != id);
    }

    /// A new run of the link has begun, in which nothing is in flight. What the surface has, it keeps.
    pub(super) fn handle_restart(&mut self, link: &mut VehicleLink) {
        self.withdraw(link, |_| true);
    }

    /// Another map has begun, on which the surface has no picture.
    pub(super) fn begin_epoch(&mut self, link: &mut VehicleLink) {
        self.withdraw(link, |_| true);
        self.send_all_again();
    }

    /// Stops some of what is in flight; it is sent again later.
    fn withdraw(&mut self, link: &mut VehicleLink, is_one: impl Fn(&InFlight) -> bool) {
        let (gone, kept) = std::mem::take(&mut self.in_flight).into_iter().partition(is_one);
        self.in_flight = kept;
        let gone: Vec<InFlight> = gone;
        for InFlight { at, serial, size, object, .. } in gone {
            link.cancel_object(object);
            if let Some(tile) = self.tiles.get_mut(&at).filter(|tile| tile.serial == serial) {
                tile.next = tile.next.min(size);
            }
        }
    }
}

impl SentTile {
    /// The picture in a size class; `None` if it cannot be compressed. Once it was compressed whole, its pixels are not kept.
    fn view(&mut self, epoch: u8, size: u8, frames: &FrameClock, now: Instant) -> Option<FloorView> {
        let (size, bytes) = match &self.picture {
            Picture::Coded(bytes) => (WHOLE, bytes.clone()),
            Picture::Pixels(pixels) => (size, coded(pixels, size)?),
        };
        if size == WHOLE {
            self.picture = Picture::Coded(bytes.clone());
        }
        let view = ExemplarView::new(self.width_m, self.middle_m, frames.taken(self.t_s), now);
        let seen = (f64::from(self.seen) / f64::from(TILE_PX * TILE_PX) * f64::from(FloorView::WHOLE)).round();
        let seen = (seen as u8).clamp(1, FloorView::WHOLE);
        (view.width_mm > 0).then_some(FloorView { epoch, seen, size, view, bytes })
    }
}

/// The bytes of a picture in a size class; `None` if it cannot be compressed.
fn coded(picture: &RgbImage, size: u8) -> Option<Vec<u8>> {
    let edge = edge_px(size);
    let smaller: RgbImage;
    let picture = match picture.width() == edge {
        true => picture,
        false => {
            smaller = resize(picture, edge, edge, FilterType::Triangle);
            &smaller
        }
    };
    Some(compress_to(picture, GOOD_SSIM, max_bytes(size))?.bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::default_link as link;
    use image::Rgb;
    use scenecast_protocol::schedule::BackgroundOrder;

    fn tile(column: i32) -> FloorTile {
        let picture = RgbImage::from_fn(128, 128, |x, y| Rgb([(x * 2) as u8, (y * 2) as u8, column as u8]));
        let middle_m = (2.0 * f64::from(column) + 1.0, 1.0);
        FloorTile { at: (column, 0), picture: picture.into(), seen: 128 * 128, middle_m, width_m: 2.0, t_s: 0.0 }
    }

    /// Column and size class of what is sent; the surface has each object at once.
    fn sent(floor: &mut FloorPictures, link: &mut VehicleLink) -> Vec<(i32, u8)> {
        let mut sent = Vec::new();
        loop {
            floor.serve(0, |(column, _), _| f64::from(column), &FrameClock::default(), link, Instant::ZERO);
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
        floor.add(&[tile(3), tile(1), tile(2)], &mut link);
        assert_eq!(
            sent(&mut floor, &mut link),
            [(2, 0), (1, 0), (3, 0), (3, 1), (2, 1), (1, 1)],
            "the newest small ones, then by weight"
        );
    }

    #[test]
    fn what_is_there_whole_does_not_become_small_or_less() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&[FloorTile { seen: 9000, ..tile(1) }], &mut link);
        assert_eq!(sent(&mut floor, &mut link), [(1, 0), (1, 1)]);
        floor.add(&[FloorTile { seen: 6000, ..tile(1) }], &mut link);
        assert_eq!(sent(&mut floor, &mut link), [], "less of it was seen");
        floor.add(&[tile(1)], &mut link);
        assert_eq!(sent(&mut floor, &mut link), [(1, 1)], "more of it was seen");
    }

    #[test]
    fn a_new_run_resends_what_was_in_flight_and_another_map_all() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&[tile(1), tile(2)], &mut link);
        floor.serve(0, |_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        let sizes: Vec<u8> = floor.in_flight.iter().map(|in_flight| in_flight.size).collect();
        assert_eq!(sizes, [0, 0], "a tile is in flight once at a time");
        floor.handle_restart(&mut link);
        assert_eq!(sent(&mut floor, &mut link), [(2, 0), (1, 0), (2, 1), (1, 1)]);
        floor.handle_restart(&mut link);
        assert_eq!(sent(&mut floor, &mut link), [], "the surface has all");
        floor.begin_epoch(&mut link);
        assert_eq!(sent(&mut floor, &mut link), [(2, 1), (1, 1)]);
    }

    #[test]
    fn little_is_in_flight_and_nothing_that_is_not_listed() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&(0..40).map(tile).collect::<Vec<_>>(), &mut link);
        floor.serve(0, |_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        assert!((1..=MAX_IN_FLIGHT).contains(&floor.in_flight.len()));
        link.set_background(BackgroundOrder::new(&[BackgroundStream::Exemplars]).unwrap());
        floor.serve(0, |_, _| 0.0, &FrameClock::default(), &mut link, Instant::ZERO);
        assert_eq!((floor.in_flight.len(), link.background_object_bytes()), (0, 0));
    }

    #[test]
    fn the_newest_tiles_are_kept() {
        let (mut floor, mut link) = (FloorPictures::default(), link());
        floor.add(&(0..600).map(tile).collect::<Vec<_>>(), &mut link);
        assert_eq!(floor.tiles.len(), MAX_PICTURES);
        assert!(!floor.tiles.contains_key(&(0, 0)) && floor.tiles.contains_key(&(599, 0)));
    }
}
