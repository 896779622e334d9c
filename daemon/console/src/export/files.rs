//! The file formats of a map: indexed PNG with world file and projection, GeoJSON, PLY, CSV.

use super::annotations::{coco, tag_lab};
use super::cells::{ExploredCell, explored};
use super::geotiff::{Reference, escaped, geotiff};
use super::projection::{TransverseMercator, well_known_text};
use super::regions::{Polygon, regions};
use super::{ExportError, check_picture};
use scenecast_core::label_picture;
use scenecast_protocol::map::{Cell, LabelGrid, Quantity, Rect};
use scenecast_surface::state::{Origin, VehicleMarker, seconds};
use scenecast_surface::{MapCaption, MapCells};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;

/// An indexed PNG, north up, pixel value = label. A PNG has no empty tiles, so its extent is limited.
pub(super) fn indexed_png(cells: &MapCells) -> Result<Vec<u8>, ExportError> {
    check_picture(cells)?;
    let grid: LabelGrid = explored(cells).map(|c| (c.cell, c.label)).collect();
    let bounds = grid.bounds().unwrap_or(Rect { x: 0, y: 0, width: 1, height: 1 });
    Ok(label_picture::encode_coloured(&grid, bounds, |label| cells.book.class_colour(label))?)
}

/// The six lines of a world file: the size of a pixel and the centre of the north-west pixel.
pub(super) fn world_file(cells: &MapCells) -> String {
    let Rect { x, y, height, .. } = cells.rectangle();
    let (west, north) = cells.corner_m(i64::from(x), i64::from(y) + i64::from(height.max(1)));
    let (cell, half) = (cells.cell_m, cells.cell_m / 2.0);
    [cell, 0.0, 0.0, -cell, west + half, north - half].map(|v| format!("{v}\n")).concat()
}

/// The `.aux.xml` file in which GDAL and QGIS look for the projection of a PNG and the classes of pictures. A GeoTIFF has its projection
/// itself.
pub(super) fn companion(cells: &MapCells, projection: Option<String>) -> String {
    let srs = projection
        .map_or(String::new(), |text| format!("  <SRS dataAxisToSRSAxisMapping=\"1,2\">{}</SRS>\n", escaped(&text)));
    let item = |(key, value): (&str, String)| format!("    <MDI key=\"{key}\">{}</MDI>\n", escaped(&value));
    let facts = cells.caption.as_ref().map_or(String::new(), |caption| {
        format!("  <Metadata>\n{}  </Metadata>\n", caption.facts().map(item).concat())
    });
    let highest = cells.counts().keys().max().copied().unwrap_or(0);
    let class = |label: u8| match label {
        0 => "unexplored".to_owned(),
        label => cells.book.class_title(label),
    };
    let classes: String =
        (0..=highest).map(|label| format!("      <Category>{}</Category>\n", escaped(&class(label)))).collect();
    format!(
        "<PAMDataset>\n{srs}{facts}  <PAMRasterBand band=\"1\">\n    <NoDataValue>0</NoDataValue>\n    <CategoryNames>\n{classes}    \
         </CategoryNames>\n  </PAMRasterBand>\n</PAMDataset>\n"
    )
}

/// Regions of equal label, and markers: WGS 84 if the mission has an origin, else metres east and north of it.
pub(super) fn geojson(cells: &MapCells, origin: Option<Origin>) -> String {
    let projection = origin.map(TransverseMercator::about);
    // A place on the given side of 180 degrees of longitude, where RFC 7946 cuts what lies across it.
    let position = |(x, y): (f64, f64), side: i64| {
        let Some(projection) = &projection else { return json!([x, y]) };
        let (lon, lat) = projection.lon_lat(x, y);
        json!([tidy((lon - 360.0 * side as f64).clamp(-180.0, 180.0)), tidy(lat)])
    };
    let side_of = |(x, y): (f64, f64)| {
        projection.as_ref().map_or(0, |projection| ((projection.lon_lat(x, y).0 + 180.0) / 360.0).floor() as i64)
    };
    let counts = cells.counts();
    let feature = |(label, polygons): (u8, Vec<(i64, Polygon)>)| {
        let count = counts.get(&label).copied().unwrap_or(0);
        let rings = |(side, polygon): &(i64, Polygon)| {
            let corner = |&(column, row): &(i64, i64)| position(cells.corner_m(column, row), *side);
            polygon.iter().map(|r| r.iter().map(corner).collect()).collect::<Vec<Value>>()
        };
        let class = cells.book.shown_as(label);
        json!({
            "type": "Feature",
            "id": label,
            "properties": {
                "label": label,
                "name": cells.book.name(label),
                "class": class,
                "class_name": cells.book.title(class),
                "colour": cells.book.colour_text(class),
                "area_m2": f64::from(count) * cells.cell_m * cells.cell_m,
            },
            "geometry": { "type": "MultiPolygon", "coordinates": polygons.iter().map(rings).collect::<Vec<_>>() },
        })
    };
    let Rect { x, y, width, height } = cells.rectangle();
    let (west, south) = (i64::from(x), i64::from(y));
    let (east, north) = (west + i64::from(width), south + i64::from(height));
    let corners = [(west, south), (east, south), (west, north), (east, north)];
    let corners = corners.map(|(column, row)| side_of(cells.corner_m(column, row)));
    let is_across = corners.iter().any(|side| *side != corners[0]);
    let mut sides: BTreeMap<i64, Vec<(Cell, u8)>> = BTreeMap::new();
    for cell in explored(cells) {
        let side = if is_across { side_of((cell.x, cell.y)) } else { corners[0] };
        sides.entry(side).or_default().push((cell.cell, cell.label));
    }
    let mut all: BTreeMap<u8, Vec<(i64, Polygon)>> = BTreeMap::new();
    for (side, found) in sides {
        for (label, polygons) in regions(found.into_iter()) {
            all.entry(label).or_default().extend(polygons.into_iter().map(|polygon| (side, polygon)));
        }
    }
    let mut facts = json!({ "map_version": cells.version, "mission_time_s": seconds(cells.at) });
    if let Some(caption) = &cells.caption {
        (facts["mission"], facts["epoch"]) = (caption.mission.as_str().into(), caption.epoch.into());
        (facts["vehicle"], facts["vehicle_name"]) = (caption.address.into(), caption.name.as_str().into());
        facts["utc"] = caption.utc.as_str().into();
        facts["known_by"] = caption.side.name().into();
    }
    let marker = |(m, utc): &(VehicleMarker, Option<String>)| {
        json!({
            "type": "Feature",
            "id": format!("marker-{}", m.number),
            "properties": { "marker": m.text, "author": m.author, "mission_time_s": m.at_s, "utc": utc },
            "geometry": { "type": "Point", "coordinates": position((m.x_m, m.y_m), side_of((m.x_m, m.y_m))) },
        })
    };
    let features: Vec<Value> = all.into_iter().map(feature).chain(cells.markers.iter().map(marker)).collect();
    let mut file = json!({ "type": "FeatureCollection", "scenecast": facts, "features": features });
    if origin.is_none() {
        file["scenecast"]["coordinates"] = json!("metres east and north of the mission's origin");
        // Without it, programs take the metres for degrees.
        file["crs"] = json!({ "type": "name", "properties": { "name": well_known_text(None) } });
    }
    file.to_string()
}

/// Degrees to a tenth of a millimetre.
fn tidy(degrees: f64) -> f64 {
    (degrees * 1e9).round() / 1e9
}

/// ASCII PLY: the centre of each explored cell in metres east, north and up (0 where the depth is unknown), colour, label.
pub(super) fn ply(cells: &MapCells, origin: Option<Origin>) -> String {
    let title = cells.caption.as_ref().map_or("scenecast map".to_owned(), MapCaption::title);
    let from = origin.map_or(String::new(), |Origin { lat_deg, lon_deg }| {
        format!(" from latitude {lat_deg}, longitude {lon_deg} (WGS 84)")
    });
    let counts = cells.counts();
    let count: u32 = counts.values().sum();
    let class = |label: u8| cells.book.class_title(label).replace(char::is_control, " ");
    let classes: String = counts.keys().map(|&label| format!("comment label {label}: {}\n", class(label))).collect();
    let mut out = format!(
        "ply\nformat ascii 1.0\ncomment {title}, metres east, north, up{from}\n{classes}element vertex {count}\n\
         property double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty uchar label\nend_header\n"
    );
    let depth = cells.layers.iter().find(|l| l.descriptor.quantity == Quantity::Depth);
    for ExploredCell { cell, x, y, label, .. } in explored(cells) {
        let [red, green, blue] = cells.book.class_colour(label);
        let up = depth.and_then(|layer| layer.value(cell)).map_or(0.0, |depth| -depth);
        let _ = writeln!(out, "{x:.3} {y:.3} {up:.3} {red} {green} {blue} {label}");
    }
    out
}

/// One line for each explored cell: the centre in metres, the label, its age in seconds, the value of each layer if known; the
/// operator's name of the label; the label that it is shown as, with its name and colour; vehicle and time of the map; latitude and
/// longitude (WGS 84) if the mission has an origin.
pub(super) fn csv(cells: &MapCells, origin: Option<Origin>) -> String {
    let mut out = String::from("east_m,north_m,label,age_s");
    cells.layers.iter().for_each(|layer| out.extend([",", &layer.descriptor.name]));
    out.push_str(CLASS_COLUMNS);
    let classes: BTreeMap<u8, String> =
        cells.counts().into_keys().map(|label| (label, class_fields(cells, label))).collect();
    let caption = caption_fields(cells);
    out.push_str(if caption.is_some() { CAPTION_COLUMNS } else { "" });
    let projection = origin.map(TransverseMercator::about);
    out.push_str(if projection.is_some() { ",lat_deg,lon_deg" } else { "" });
    for ExploredCell { cell, x, y, label, age_s } in explored(cells) {
        let age = age_s.map_or(String::new(), |age| age.to_string());
        let _ = write!(out, "\n{x:.3},{y:.3},{label},{age}");
        for layer in &cells.layers {
            let value = layer.value(cell).map_or(String::new(), |value| format!("{value:.3}"));
            let _ = write!(out, ",{value}");
        }
        out.extend([classes.get(&label).map_or("", String::as_str), caption.as_deref().unwrap_or_default()]);
        if let Some(projection) = &projection {
            let (lon, lat) = projection.lon_lat(x, y);
            let _ = write!(out, ",{},{}", tidy(lat), tidy((lon + 180.0).rem_euclid(360.0) - 180.0));
        }
    }
    out.push('\n');
    out
}

const CLASS_COLUMNS: &str = ",name,class,class_name,colour";
const CAPTION_COLUMNS: &str = ",vehicle,vehicle_name,utc";

/// What the operator says of a label, as fields of a table.
fn class_fields(cells: &MapCells, label: u8) -> String {
    let (book, class) = (&cells.book, cells.book.shown_as(label));
    format!(",{},{class},{},{}", quoted(book.name(label)), quoted(Some(&book.title(class))), book.colour_text(class))
}

/// Vehicle and time of a map, as fields of a table.
fn caption_fields(cells: &MapCells) -> Option<String> {
    let MapCaption { address, name, utc, .. } = cells.caption.as_ref()?;
    Some(format!(",{address},{},{utc}", quoted(Some(name))))
}

/// A text as a field of a table; empty without one.
fn quoted(text: Option<&str>) -> String {
    text.map_or(String::new(), |text| format!("\"{}\"", harmless(text).replace('"', "\"\"")))
}

/// A text that no spreadsheet takes for a formula.
pub(crate) fn harmless(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}").into() } else { text.into() }
}

/// A line for each label of the map: what the operator says of it, its cells and area, whose map it is, and at each cut of the tree the
/// label that stands for it.
pub(super) fn labels(cells: &MapCells) -> String {
    let cuts = || (2..=cells.tree.as_ref().map_or(0, |tree| tree.merges().len())).rev();
    let caption = caption_fields(cells);
    let mut out = format!("label{CLASS_COLUMNS},cells,area_m2");
    out.push_str(if caption.is_some() { CAPTION_COLUMNS } else { "" });
    cuts().for_each(|count| _ = write!(out, ",of_{count}"));
    for (label, count) in cells.counts() {
        let (class, area_m2) = (class_fields(cells, label), f64::from(count) * cells.cell_m * cells.cell_m);
        let _ = write!(out, "\n{label}{class},{count},{area_m2:.3}{}", caption.as_deref().unwrap_or_default());
        let groups = cells.tree.iter().flat_map(|tree| cuts().map(|count| tree.group_of(label, count)));
        groups.for_each(|group| _ = write!(out, ",{group}"));
    }
    out.push('\n');
    out
}

/// A file format of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFormat {
    /// An indexed PNG, of at most 2^23 pixels.
    Png,
    /// The world file of that PNG.
    WorldFile,
    /// The projection of that PNG.
    Projection,
    /// Regions of equal label as polygons.
    GeoJson,
    /// A point cloud for CloudCompare and the like.
    Ply,
    /// A line for each explored cell.
    Csv,
    /// A line for each label: name, class, colour, area, and the label that stands for it at each cut of the tree.
    Labels,
    /// The classes as annotations of that PNG, as COCO has them.
    Coco,
    /// The classes as a dictionary of labels for TagLab.
    TagLab,
    /// A GeoTIFF in the projection of the mission, a pixel a cell.
    Tiff,
    /// A GeoTIFF in the zone of UTM.
    UtmTiff,
    /// A GeoTIFF in longitude and latitude.
    Wgs84Tiff,
    /// The classes of the GeoTIFFs, in the file beside each in which GDAL and QGIS look for them.
    TiffClasses,
    UtmTiffClasses,
    Wgs84TiffClasses,
}

impl MapFormat {
    pub const ALL: [Self; 15] = [
        Self::Png,
        Self::WorldFile,
        Self::Projection,
        Self::GeoJson,
        Self::Ply,
        Self::Csv,
        Self::Labels,
        Self::Coco,
        Self::TagLab,
        Self::Tiff,
        Self::UtmTiff,
        Self::Wgs84Tiff,
        Self::TiffClasses,
        Self::UtmTiffClasses,
        Self::Wgs84TiffClasses,
    ];

    /// The end of the name of a file in this format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::WorldFile => "pgw",
            Self::Projection => "png.aux.xml",
            Self::GeoJson => "geojson",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Labels => "labels.csv",
            Self::Coco => "coco.json",
            Self::TagLab => "taglab.json",
            Self::Tiff => "tif",
            Self::UtmTiff => "utm.tif",
            Self::Wgs84Tiff => "wgs84.tif",
            Self::TiffClasses => "tif.aux.xml",
            Self::UtmTiffClasses => "utm.tif.aux.xml",
            Self::Wgs84TiffClasses => "wgs84.tif.aux.xml",
        }
    }

    /// A map as a file in this format; `origin` is the place of x = y = 0 of the world frame.
    ///
    /// # Errors
    ///
    /// The map is too large for the format, or the format needs an origin.
    pub fn export(self, cells: &MapCells, origin: Option<Origin>) -> Result<Vec<u8>, ExportError> {
        match self {
            Self::Png => indexed_png(cells),
            Self::WorldFile => Ok(world_file(cells).into()),
            Self::Projection => Ok(companion(cells, Some(well_known_text(origin))).into()),
            Self::TiffClasses | Self::UtmTiffClasses | Self::Wgs84TiffClasses => Ok(companion(cells, None).into()),
            Self::Coco => coco(cells),
            Self::TagLab => Ok(tag_lab(cells).into()),
            Self::GeoJson => Ok(geojson(cells, origin).into()),
            Self::Ply => Ok(ply(cells, origin).into()),
            Self::Csv => Ok(csv(cells, origin).into()),
            Self::Labels => Ok(labels(cells).into()),
            Self::Tiff => geotiff(cells, origin, Reference::Mission),
            Self::UtmTiff => geotiff(cells, origin, Reference::Utm),
            Self::Wgs84Tiff => geotiff(cells, origin, Reference::Wgs84),
        }
    }

    pub(crate) const fn content_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::WorldFile => "text/plain",
            Self::Projection | Self::TiffClasses | Self::UtmTiffClasses | Self::Wgs84TiffClasses => "application/xml",
            Self::Coco | Self::TagLab => "application/json",
            Self::GeoJson => "application/geo+json",
            Self::Ply => "application/ply",
            Self::Csv | Self::Labels => "text/csv",
            Self::Tiff | Self::UtmTiff | Self::Wgs84Tiff => "image/tiff",
        }
    }
}
