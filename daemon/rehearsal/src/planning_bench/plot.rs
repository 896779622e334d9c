//! The tracks of a trial over its label map, a panel for each planner.

use super::Trial;
use super::scene::CELL_M;
use image::{ImageFormat, Rgb, RgbImage};
use scenecast_core::palette::colour;
use scenecast_protocol::map::Cell;
use std::io::Cursor;

/// Edge of a cell in the image, pixels.
const PX: u32 = 5;
const GAP: u32 = 12;
const OUTLINE: Rgb<u8> = Rgb([220, 30, 30]);
const TRACK: Rgb<u8> = Rgb([255; 3]);
const SHADE: Rgb<u8> = Rgb([15, 20, 30]);

/// Lawnmower, greedy and horizon from left to right, as a PNG file. Favoured labels have their colours, the others a
/// faint grey of theirs; the fence and the keep-outs are red.
pub fn plot(trial: &Trial) -> image::ImageResult<Vec<u8>> {
    let cells = |metres: f64| (metres / CELL_M).round() as u32;
    let (width, height) = (cells(trial.scene.area.east) * PX, cells(trial.scene.area.north) * PX);
    let panels = trial.runs.len() as u32;
    let mut image = RgbImage::from_pixel(panels * width + (panels - 1) * GAP, height, Rgb([255; 3]));
    for (panel, run) in (0..).zip(&trial.runs) {
        let left = panel * (width + GAP);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let cell = Cell::new((x / PX) as i32, ((height - 1 - y) / PX) as i32);
            image.put_pixel(left + x, y, floor(trial, cell));
        }
        let place = |(x, y): (f64, f64)| {
            let px = f64::from(PX) / CELL_M;
            (f64::from(left) + x * px, f64::from(height) - y * px)
        };
        for outline in trial.task.fence.outlines() {
            outline
                .edges()
                .for_each(|(a, b)| line(&mut image, place(a.to_world().xy()), place(b.to_world().xy()), 1, OUTLINE));
        }
        for (reach, colour) in [(2, SHADE), (1, TRACK)] {
            run.track.windows(2).for_each(|leg| line(&mut image, place(leg[0]), place(leg[1]), reach, colour));
        }
    }
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

fn floor(trial: &Trial, cell: Cell) -> Rgb<u8> {
    let label = trial.scene.labels.get(cell);
    let rgb = colour(label);
    match trial.scene.utility.weight(label) {
        w if w > 0.0 => Rgb(rgb),
        _ => {
            let grey = rgb.iter().map(|&c| u16::from(c)).sum::<u16>() / 3;
            Rgb([(150 + grey / 4) as u8; 3])
        }
    }
}

fn line(image: &mut RgbImage, from: (f64, f64), to: (f64, f64), reach: i64, colour: Rgb<u8>) {
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0) as u32;
    for i in 0..=steps {
        let t = f64::from(i) / f64::from(steps);
        let (x, y) = ((from.0 + (to.0 - from.0) * t) as i64, (from.1 + (to.1 - from.1) * t) as i64);
        for (px, py) in (1 - reach..reach).flat_map(|dy| (1 - reach..reach).map(move |dx| (x + dx, y + dy))) {
            if let (Ok(px), Ok(py)) = (u32::try_from(px), u32::try_from(py))
                && px < image.width()
                && py < image.height()
            {
                image.put_pixel(px, py, colour);
            }
        }
    }
}
