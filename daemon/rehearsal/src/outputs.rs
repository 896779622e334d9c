//! The files of a rehearsal, and an image of the mission.

use super::mission::Mission;
use super::quality::{mission_panels, quality_csv, quality_plot};
use super::report::Report;
use super::world::true_classes;
use image::{ImageFormat, Rgb, RgbImage};
use scenecast_core::palette::colour;
use scenecast_core::{UserError, label_picture};
use scenecast_protocol::map::{Cell, LabelGrid, Rect};
use serde_json::Value;
use std::io::Cursor;
use std::path::Path;

/// Writes report, maps, images and frame log into a folder, which is created if necessary.
pub fn write_outputs(mission: &Mission, report: &Report, wall: Value, dir: &Path) -> Result<(), UserError> {
    let failed = |path: &Path, e: std::io::Error| UserError::Failed(format!("{}: {e}", path.display()));
    std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, format!("cannot be used as a folder: {e}")))?;
    remove_old(dir);
    let bounds = mission.vehicle().map().bounds().unwrap_or(Rect { x: 0, y: 0, width: 1, height: 1 });
    write_map(&dir.join("vehicle-map.png"), mission.vehicle().map(), bounds)?;
    write_map(&dir.join("operator-map.png"), &mission.operator_map(), bounds)?;
    if mission.camera.world.is_annotated() {
        let classes = true_classes(&mission.camera.world, bounds, mission.cell_m());
        write_map(&dir.join("truth.png"), &classes, bounds)?;
    }
    let panorama = panorama(mission).map_err(UserError::failed)?;
    scenecast_files::write_whole(&dir.join("mission.png"), &panorama)?;
    write_quality(mission, dir)?;
    let exemplars = dir.join("exemplars");
    std::fs::create_dir_all(&exemplars).map_err(|e| failed(&exemplars, e))?;
    for (label, webp) in mission.exemplars() {
        scenecast_files::write_whole(&exemplars.join(format!("label-{label}.webp")), webp)?;
    }
    scenecast_files::write_whole(&dir.join("frames.log"), mission.frames().text().as_bytes())?;
    let mut json = report.json.clone();
    json["wall"] = wall;
    let text = serde_json::to_string_pretty(&json).map_err(UserError::failed)? + "\n";
    scenecast_files::write_whole(&dir.join("report.json"), text.as_bytes())
}

/// Writes the quality of both maps over time as a table and as charts.
fn write_quality(mission: &Mission, dir: &Path) -> Result<(), UserError> {
    let samples = mission.quality_series();
    scenecast_files::write_whole(&dir.join("quality.csv"), quality_csv(samples).as_bytes())?;
    let title = format!("{} bit/s, seed {}", mission.config.link.budget_bps, mission.seed);
    let svg = quality_plot(&mission_panels(samples), &title).map_err(UserError::failed)?;
    scenecast_files::write_whole(&dir.join("quality.svg"), svg.as_bytes())
}

/// Removes files of an earlier run that this one might not replace.
fn remove_old(dir: &Path) {
    // A file that cannot be removed leads to an error when it is written.
    let _ = std::fs::remove_file(dir.join("truth.png"));
    for entry in std::fs::read_dir(dir.join("exemplars")).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with("label-") && name.ends_with(".webp") {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn write_map(path: &Path, map: &LabelGrid, bounds: Rect) -> Result<(), UserError> {
    let png =
        label_picture::encode_within(map, bounds).map_err(|e| UserError::Failed(format!("{}: {e}", path.display())))?;
    scenecast_files::write_whole(path, &png)
}

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
