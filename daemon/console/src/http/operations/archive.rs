//! The operations on archived maps.

use super::{Content, Operation, read, schema};
use crate::bodies::ArchiveList;
use crate::export::MapFormat;
use crate::http::handlers::maps::{self, MapQuery};
use crate::http::shared::{ArchiveName, Shared};
use axum::extract::{Query, State};
use axum::routing::get;

/// A file format of an archived map.
macro_rules! archive_file {
    ($path:literal, $id:literal, $summary:literal, $format:expr) => {{
        const FORMAT: MapFormat = $format;
        read($path, $id, $summary, Content::File(FORMAT.content_type()), || {
            get(|State(shared): State<Shared>, ArchiveName(name): ArchiveName, Query(query): Query<MapQuery>| {
                maps::archived(shared, name, query, FORMAT)
            })
        })
    }};
}

/// The operations that read archived maps.
pub(super) fn operations() -> Vec<Operation> {
    vec![
        read(
            "/api/v2/archive",
            "archive",
            "The maps of runs and label epochs that have ended, the newest first",
            Content::Json(schema::<ArchiveList>),
            || get(maps::archives),
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.png",
            "archived_map_png",
            "An archived map as an indexed PNG, north up, pixel value = label",
            MapFormat::Png
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.pgw",
            "archived_map_world_file",
            "The world file of that PNG",
            MapFormat::WorldFile
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.png.aux.xml",
            "archived_map_projection",
            "The projection and the classes of that PNG, in the file that GDAL and QGIS read",
            MapFormat::Projection
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.geojson",
            "archived_map_geojson",
            "Regions of equal label of an archived map",
            MapFormat::GeoJson
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.ply",
            "archived_map_ply",
            "The cells of an archived map as a coloured point cloud",
            MapFormat::Ply
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.csv",
            "archived_map_csv",
            "One line for each explored cell of an archived map",
            MapFormat::Csv
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.labels.csv",
            "archived_map_labels",
            "One line for each label of an archived map, with the label that stands for it at each cut of the tree",
            MapFormat::Labels
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.coco.json",
            "archived_map_coco",
            "The classes of an archived map as annotations of its PNG in the format of COCO",
            MapFormat::Coco
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.taglab.json",
            "archived_map_tag_lab",
            "The classes of an archived map as a dictionary of labels for TagLab",
            MapFormat::TagLab
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.tif.aux.xml",
            "archived_map_tiff_classes",
            "The names of the classes, in the file beside map.tif in which GDAL and QGIS look for them",
            MapFormat::TiffClasses
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.utm.tif.aux.xml",
            "archived_map_utm_classes",
            "The same beside map.utm.tif",
            MapFormat::UtmTiffClasses
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.wgs84.tif.aux.xml",
            "archived_map_wgs84_classes",
            "The same beside map.wgs84.tif",
            MapFormat::Wgs84TiffClasses
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.tif",
            "archived_map_tiff",
            "An archived map as a GeoTIFF, a pixel a cell",
            MapFormat::Tiff
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.utm.tif",
            "archived_map_utm",
            "An archived map as a GeoTIFF in the UTM zone of the origin",
            MapFormat::UtmTiff
        ),
        archive_file!(
            "/api/v2/archive/{name}/map.wgs84.tif",
            "archived_map_wgs84",
            "An archived map as a GeoTIFF in EPSG:4326",
            MapFormat::Wgs84Tiff
        ),
    ]
}
