//! An image of a mission: the sea floor with the vehicle's track on the left, the operator's map on the right.

use super::mission::Mission;
use image::{ImageFormat, Rgb, RgbImage};
use scenecast_core::palette::colour;
use scenecast_protocol::map::Cell;
use std::io::Cursor;

const HALF: u32 = 520;
const GAP: u32 = 12;
const PAPER: Rgb<u8> = Rgb([255; 3]);
const UNSEEN: Rgb<u8> = Rgb([226, 232, 236]);

/// The panorama as a PNG file.
pub(super) fn panorama(mission: &Mission) -> image::ImageResult<Vec<u8>> {
    let area = mission.pictured_area();
    let metres_per_column = (area.east - area.west) / f64::from(HALF);
    let rows = ((area.north - area.south) / metres_per_column).round().clamp(1.0, 4000.0) as u32;
    let mut image = RgbImage::from_pixel(2 * HALF + GAP, rows, PAPER);
    let operator = mission.operator_map();
    let floor = mission.camera.world.picture(&area, HALF, rows, metres_per_column);
    let cell = |metres: f64| (metres / mission.cell_m()).floor() as i32;
    for row in 0..rows {
        for column in 0..HALF {
            let x = area.west + (f64::from(column) + 0.5) * metres_per_column;
            let y = area.north - (f64::from(row) + 0.5) * metres_per_column;
            if let Some(colour) = floor[(row * HALF + column) as usize] {
                image.put_pixel(column, row, colour);
            }
            let label = operator.get(Cell::new(cell(x), cell(y)));
            let seen = if label == 0 { UNSEEN } else { Rgb(colour(label)) };
            image.put_pixel(HALF + GAP + column, row, seen);
        }
    }
    for step in mission.logbook.track.windows(2) {
        let place = |(x, y): (f64, f64)| ((x - area.west) / metres_per_column, (area.north - y) / metres_per_column);
        line(&mut image, place(step[0]), place(step[1]));
    }
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

/// A white line with a dark edge, on the left half only.
fn line(image: &mut RgbImage, from: (f64, f64), to: (f64, f64)) {
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
    for (reach, colour) in [(1, Rgb([20, 30, 40])), (0, Rgb([255; 3]))] {
        for i in 0..=steps as u32 {
            let t = f64::from(i) / steps;
            let (x, y) = ((from.0 + (to.0 - from.0) * t) as i64, (from.1 + (to.1 - from.1) * t) as i64);
            for (px, py) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (x + dx, y + dy))) {
                if (0..i64::from(HALF)).contains(&px) && (0..i64::from(image.height())).contains(&py) {
                    image.put_pixel(px as u32, py as u32, colour);
                }
            }
        }
    }
}
