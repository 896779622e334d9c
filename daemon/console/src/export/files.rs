//! File formats: indexed PNG with world file and projection, GeoJSON, PLY, CSV.

use super::cells::{ExploredCell, MapCells};
use super::projection::{lon_lat, well_known_text};
use super::regions::{Polygon, regions};
use crate::state::Origin;
use scenecast_core::label_picture;
use scenecast_protocol::map::{LabelGrid, Quantity};
use serde_json::{Value, json};
use std::fmt::Write;

/// An indexed PNG, north up, pixel value = label.
pub(crate) fn indexed_png(cells: &MapCells) -> Option<Vec<u8>> {
    let grid: LabelGrid = cells.bounds.cells().zip(cells.labels.iter().copied()).collect();
    label_picture::encode(&grid).ok()
}

/// The six lines of a world file: the size of a pixel and the centre of the north-west pixel.
pub(crate) fn world_file(cells: &MapCells) -> String {
    let (west, _) = cells.corner_m(0, 0);
    let (_, north) = cells.corner_m(0, cells.bounds.height.max(1));
    let (cell, half) = (cells.cell_m, cells.cell_m / 2.0);
    [cell, 0.0, 0.0, -cell, west + half, north - half].map(|v| format!("{v}\n")).concat()
}

/// The `.aux.xml` file in which GDAL and QGIS look for the projection of a PNG.
pub(crate) fn projection(origin: Option<Origin>) -> String {
    let text = well_known_text(origin).replace('"', "&quot;");
    format!("<PAMDataset>\n  <SRS dataAxisToSRSAxisMapping=\"1,2\">{text}</SRS>\n</PAMDataset>\n")
}

/// Regions of equal label: WGS 84 if the mission has an origin, else metres east and north of it.
pub(crate) fn geojson(cells: &MapCells, origin: Option<Origin>) -> String {
    let corner = |&(column, row): &(u32, u32)| {
        let (x, y) = cells.corner_m(column, row);
        let Some(origin) = origin else { return json!([x, y]) };
        let (lon, lat) = lon_lat(origin, x, y);
        json!([tidy(lon), tidy(lat)])
    };
    let feature = |(label, polygons): (u8, Vec<Polygon>)| {
        let count = cells.labels.iter().filter(|l| **l == label).count();
        let rings = |polygon: &Polygon| polygon.iter().map(|r| r.iter().map(corner).collect()).collect::<Vec<Value>>();
        json!({
            "type": "Feature",
            "id": label,
            "properties": { "label": label, "area_m2": count as f64 * cells.cell_m * cells.cell_m },
            "geometry": { "type": "MultiPolygon", "coordinates": polygons.iter().map(rings).collect::<Vec<_>>() },
        })
    };
    let all = regions(&cells.labels, cells.bounds.width, cells.bounds.height);
    let mut facts = json!({ "map_version": cells.version, "mission_time_s": cells.at_s });
    if origin.is_none() {
        facts["coordinates"] = json!("metres east and north of the mission's origin");
    }
    let features: Vec<Value> = all.into_iter().map(feature).collect();
    json!({ "type": "FeatureCollection", "scenecast": facts, "features": features }).to_string()
}

/// Degrees to a tenth of a millimetre.
fn tidy(degrees: f64) -> f64 {
    (degrees * 1e9).round() / 1e9
}

/// ASCII PLY: the centre of each explored cell in metres east, north and up (0 where the depth is unknown), colour, label.
pub(crate) fn ply(cells: &MapCells) -> String {
    let count = cells.explored().count();
    let mut out = format!(
        "ply\nformat ascii 1.0\ncomment scenecast map, metres east, north, up\nelement vertex {count}\n\
         property double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty uchar label\nend_header\n"
    );
    let depth = cells.layers.iter().find(|l| l.descriptor.quantity == Quantity::Depth);
    for ExploredCell { at, x, y, label, .. } in cells.explored() {
        let [red, green, blue] = scenecast_core::palette::colour(label);
        let up = depth.and_then(|layer| layer.value(at)).map_or(0.0, |depth| -depth);
        let _ = writeln!(out, "{x:.3} {y:.3} {up:.3} {red} {green} {blue} {label}");
    }
    out
}

/// One line for each explored cell: the centre in metres, the label, its age in seconds, the value of each layer if known.
pub(crate) fn csv(cells: &MapCells) -> String {
    let mut out = String::from("east_m,north_m,label,age_s");
    cells.layers.iter().for_each(|layer| out.extend([",", &layer.descriptor.name]));
    for ExploredCell { at, x, y, label, age_s } in cells.explored() {
        let age = if age_s == u16::MAX { String::new() } else { age_s.to_string() };
        let _ = write!(out, "\n{x:.3},{y:.3},{label},{age}");
        for layer in &cells.layers {
            let value = layer.value(at).map_or(String::new(), |value| format!("{value:.3}"));
            let _ = write!(out, ",{value}");
        }
    }
    out.push('\n');
    out
}
