//! A picture of the maps: the three flights under way and at rest, the true classes, and the seams of the first map.

use super::flight::{Flight, Labelled};
use super::site::Site;
use image::{Rgb, RgbImage};
use scenecast_core::palette::colour;

/// Pixels of a cell, and between two maps.
const CELL: u32 = 4;
const GAP: u32 = 12;
const SEAM: Rgb<u8> = Rgb([220, 0, 0]);

/// The maps of the flights along, back and across under way, then at rest, the true classes, and in red the borders between neighbours of
/// one class that have different labels on the first map, from left to right.
pub(super) fn of(site: &Site, flights: &[Flight; 3]) -> RgbImage {
    let (columns, rows) = site.size();
    let mut picture = RgbImage::from_pixel(8 * columns * CELL + 7 * GAP, rows * CELL, Rgb([255; 3]));
    let maps = flights.iter().map(|flight| &flight.under_way).chain(flights.iter().map(|flight| &flight.rested));
    let maps: Vec<&Labelled> = maps.collect();
    let name = |label: u32| Rgb(colour((label % 254 + 1) as u8));
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let place = (column as i32, -1 - row as i32);
        let labels = maps.iter().map(|map| map.label(place, usize::MAX).map(name));
        let truth = site.class(place).map(name);
        let seam = Some(Rgb([235; 3])).map(|other| if is_seam(site, maps[0], place) { SEAM } else { other });
        for (panel, shown) in (0..).zip(labels.chain([truth, seam])) {
            let Some(shown) = shown else { continue };
            let left = panel * (columns * CELL + GAP) + column * CELL;
            for (y, x) in (0..CELL).flat_map(|y| (0..CELL).map(move |x| (y, x))) {
                picture.put_pixel(left + x, row * CELL + y, shown);
            }
        }
    }
    picture
}

fn is_seam(site: &Site, map: &Labelled, (x, y): (i32, i32)) -> bool {
    let own = (site.class((x, y)), map.label((x, y), usize::MAX));
    [(x + 1, y), (x, y + 1)].into_iter().any(|there| {
        let other = map.label(there, usize::MAX);
        own.0.is_some() && site.class(there) == own.0 && other.is_some() && other != own.1
    })
}
