//! The files of a rehearsal.

use super::mission::Mission;
use super::panorama::panorama;
use super::quality::{mission_panels, quality_csv, quality_plot};
use super::report::Report;
use super::truth::true_classes;
use scenecast_core::UserError;
use scenecast_core::label_picture;
use scenecast_protocol::map::{LabelGrid, Rect};
use serde_json::Value;
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
    let panorama = panorama(mission).map_err(|e| UserError::Failed(e.to_string()))?;
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
    let text = serde_json::to_string_pretty(&json).map_err(|e| UserError::Failed(e.to_string()))? + "\n";
    scenecast_files::write_whole(&dir.join("report.json"), text.as_bytes())
}

/// Writes the quality of both maps over time as a table and as charts.
fn write_quality(mission: &Mission, dir: &Path) -> Result<(), UserError> {
    let samples = mission.quality_series();
    scenecast_files::write_whole(&dir.join("quality.csv"), quality_csv(samples).as_bytes())?;
    let title = format!("{} bit/s, seed {}", mission.config.link.budget_bps, mission.seed);
    let svg = quality_plot(&mission_panels(samples), &title).map_err(|e| UserError::Failed(e.to_string()))?;
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
