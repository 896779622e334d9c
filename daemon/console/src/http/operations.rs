//! Every path and method of the server, in one table from which the router and the OpenAPI document are made.

mod archive;
mod directive;

use super::handlers::maps::{self, MapQuery};
use super::handlers::viewers::{self, VIEWERS};
use super::handlers::{login, metrics, orders, readings};
use super::shared::{Shared, VehicleId};
use crate::bodies::{LogList, MapBody};
use crate::export::MapFormat;
use crate::report::HTML;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Method};
use axum::routing::{MethodRouter, get, post};
use scenecast_surface::fit::Fit;
use scenecast_surface::state::{
    AcceptedOrder, CellHistory, CommandState, FloorList, MissionState, PrincipalInfo, ReplayEventList, ReplayOrder,
    ReplayState,
};
use scenecast_surface::{
    CommandOrder, DismissOrder, DraftOrder, LabelOrder, MarkerOrder, NoteOrder, RemoveMarkerOrder, Role, SurfaceRequest,
};
use schemars::{JsonSchema, Schema, SchemaGenerator};

/// Adds the schema of a type to a generator.
pub(super) type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

fn schema<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}

/// The content of a successful response.
pub(super) enum Content {
    Json(SchemaOf),
    /// A file or a text with this content type.
    File(&'static str),
    /// A stream of server-sent events, which stays open.
    Events,
    /// Changed tiles of a map, binary.
    Tiles,
    Headers,
    Empty,
}

/// A path and a method.
pub(super) struct Operation {
    pub(super) method: Method,
    pub(super) path: &'static str,
    /// The name for generated clients.
    pub(super) id: &'static str,
    /// The least role that may use it; `None` if no principal is needed.
    pub(super) role: Option<Role>,
    /// One line of text for people.
    pub(super) summary: &'static str,
    /// The schema of the request's body.
    pub(super) body: Option<SchemaOf>,
    /// Status and content of a successful response.
    pub(super) success: (u16, Content),
    pub(super) route: fn() -> MethodRouter<Shared>,
}

fn read(
    path: &'static str,
    id: &'static str,
    summary: &'static str,
    content: Content,
    route: fn() -> MethodRouter<Shared>,
) -> Operation {
    let role = Some(Role::Viewer);
    Operation { method: Method::GET, path, id, role, summary, body: None, success: (200, content), route }
}

fn order(
    path: &'static str,
    id: &'static str,
    summary: &'static str,
    body: SchemaOf,
    route: fn() -> MethodRouter<Shared>,
) -> Operation {
    let success = (202, Content::Json(schema::<AcceptedOrder>));
    let role = Some(Role::Operator);
    Operation { method: Method::POST, path, id, role, summary, body: Some(body), success, route }
}

/// A change of the surface's own data, which is done at once.
fn change(
    path: &'static str,
    id: &'static str,
    summary: &'static str,
    body: SchemaOf,
    route: fn() -> MethodRouter<Shared>,
) -> Operation {
    let (role, success) = (Some(Role::Operator), (204, Content::Empty));
    Operation { method: Method::POST, path, id, role, summary, body: Some(body), success, route }
}

/// A file format of the map of a vehicle.
macro_rules! map_file {
    ($path:literal, $id:literal, $summary:literal, $format:expr) => {{
        const FORMAT: MapFormat = $format;
        read($path, $id, $summary, Content::File(FORMAT.content_type()), || {
            get(
                |State(shared): State<Shared>,
                 VehicleId(id): VehicleId,
                 Query(query): Query<MapQuery>,
                 headers: HeaderMap| { maps::file(shared, id, query, headers, FORMAT) },
            )
        })
    }};
}

pub(super) fn operations() -> Vec<Operation> {
    let mut all = readings();
    all.extend(map_files());
    all.extend(archive::operations());
    all.extend(changes());
    all.extend(directive::operations());
    all.extend(commands());
    all.extend(logins());
    all
}

fn readings() -> Vec<Operation> {
    vec![
        read(
            "/api/v2/log",
            "log",
            "The log of the mission: orders and edits with their authors, answers, silences, new labels, images; its last 2000 \
             entries at most. `vehicle`, `kind` and `since` (a number) select some.",
            Content::Json(schema::<LogList>),
            || get(readings::log),
        ),
        read(
            "/api/v2/log.csv",
            "log_csv",
            "The same as a table, with the same selections",
            Content::File("text/csv; charset=utf-8"),
            || get(readings::table),
        ),
        read(
            "/api/v2/replay/events",
            "replay_events",
            "The events of a record, for its time line; 404 for a surface that is live",
            Content::Json(schema::<ReplayEventList>),
            || get(readings::replay_events),
        ),
        Operation {
            method: Method::GET,
            path: VIEWERS,
            id: "foxglove",
            role: Some(Role::Viewer),
            summary: "Maps and states as messages of ROS 2 for Foxglove and Lichtblick: a WebSocket of the subprotocol foxglove.sdk.v1",
            body: None,
            success: (101, Content::Empty),
            route: || get(viewers::viewers),
        },
        read(
            "/api/v2/report.html",
            "report",
            "The report of the dive so far, one HTML file that needs no other",
            Content::File(HTML),
            || get(readings::report),
        ),
        Operation {
            method: Method::POST,
            path: "/api/v2/replay",
            id: "replay",
            role: Some(Role::Viewer),
            summary: "Show another moment of a record, play or stop it; 404 for a surface that is live",
            body: Some(schema::<ReplayOrder>),
            success: (200, Content::Json(schema::<ReplayState>)),
            route: || post(readings::replay),
        },
        read("/api/v2/state", "state", "The state", Content::Json(schema::<MissionState>), || get(readings::state)),
        read(
            "/api/v2/events",
            "events",
            "Changes: `state` with the whole state after each change and at least once a second; `map` after a change of a \
             map. A slow reader misses states, but never the last one.",
            Content::Events,
            || get(readings::events),
        ),
        read(
            "/api/v2/vehicles/{id}/map",
            "map",
            "The map or a region of it in JSON, with the age of its cells: at most 1048576 cells",
            Content::Json(schema::<MapBody>),
            || get(maps::map),
        ),
        read(
            "/api/v2/vehicles/{id}/map/tiles",
            "map_tiles",
            "The map in binary tiles, of any extent, or those that have changed since a tag; docs/reference/map-tiles.md has the \
             format",
            Content::Tiles,
            || get(maps::tiles),
        ),
        read(
            "/api/v2/vehicles/{id}/cells/{x}/{y}",
            "cell_history",
            "The labels that a cell had before its present one, the newest first; of the last 131072 changes of the map",
            Content::Json(schema::<CellHistory>),
            || get(maps::cell_history),
        ),
        read(
            "/api/v2/vehicles/{id}/exemplars/{file}",
            "exemplar",
            "A received image of a label: the latest as in 3.webp, or the one with a number as in 3-17.webp",
            Content::File("image/webp"),
            || get(readings::exemplar),
        ),
        read(
            "/api/v2/vehicles/{id}/floor",
            "floor",
            "The images of the sea floor itself that have arrived, or those after the version `since`",
            Content::Json(schema::<FloorList>),
            || get(readings::floor),
        ),
        read(
            "/api/v2/vehicles/{id}/floor/{file}",
            "floor_image",
            "A received image of the sea floor, by its address in the list",
            Content::File("image/webp"),
            || get(readings::floor_image),
        ),
        read(
            "/api/v2/vehicles/{id}/fit",
            "fit_settings",
            "The most informative settings of the scene model whose stream fits a budget, and the trade-off",
            Content::Json(schema::<Fit>),
            || get(readings::fit),
        ),
        read(
            "/api/v2/truth.png",
            "truth",
            "The true classes of a simulated sea floor as an indexed PNG, north up; `truth` of the state has its outline and its \
             classes",
            Content::File("image/png"),
            || get(readings::truth),
        ),
        read("/api/openapi.json", "openapi", "This document", Content::File("application/json"), || {
            get(readings::document)
        }),
        read(
            "/metrics",
            "metrics",
            "Metrics for Prometheus, text format 0.0.4",
            Content::File(metrics::CONTENT_TYPE),
            || get(metrics::metrics),
        ),
    ]
}

fn map_files() -> Vec<Operation> {
    vec![
        map_file!(
            "/api/v2/vehicles/{id}/map.png",
            "map_png",
            "The map as an indexed PNG, north up, pixel value = label",
            MapFormat::Png
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.pgw",
            "map_world_file",
            "The world file of that PNG",
            MapFormat::WorldFile
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.png.aux.xml",
            "map_projection",
            "The projection and the classes of that PNG, in the file that GDAL and QGIS read",
            MapFormat::Projection
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.geojson",
            "map_geojson",
            "Regions of equal label; in WGS 84 if the mission has an origin, else in metres east and north of it",
            MapFormat::GeoJson
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.ply",
            "map_ply",
            "The cells as a coloured point cloud, metres east, north, up",
            MapFormat::Ply
        ),
        map_file!("/api/v2/vehicles/{id}/map.csv", "map_csv", "One line for each explored cell", MapFormat::Csv),
        map_file!(
            "/api/v2/vehicles/{id}/map.labels.csv",
            "map_labels",
            "One line for each label: name, class, colour, cells, area, and the label that stands for it at each cut of the tree",
            MapFormat::Labels
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.coco.json",
            "map_coco",
            "The classes as annotations of map.png in the format of COCO",
            MapFormat::Coco
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.taglab.json",
            "map_tag_lab",
            "The classes as a dictionary of labels for TagLab, which reads map.png as a label image by their colours",
            MapFormat::TagLab
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.tif.aux.xml",
            "map_tiff_classes",
            "The names of the classes, in the file beside map.tif in which GDAL and QGIS look for them",
            MapFormat::TiffClasses
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.utm.tif.aux.xml",
            "map_utm_classes",
            "The same beside map.utm.tif",
            MapFormat::UtmTiffClasses
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.wgs84.tif.aux.xml",
            "map_wgs84_classes",
            "The same beside map.wgs84.tif",
            MapFormat::Wgs84TiffClasses
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.tif",
            "map_tiff",
            "The map as a tiled GeoTIFF, a pixel a cell, in transverse Mercator about the mission's origin, or in metres without one",
            MapFormat::Tiff
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.utm.tif",
            "map_utm",
            "The map as a GeoTIFF in the UTM zone of the origin",
            MapFormat::UtmTiff
        ),
        map_file!(
            "/api/v2/vehicles/{id}/map.wgs84.tif",
            "map_wgs84",
            "The map as a GeoTIFF in EPSG:4326",
            MapFormat::Wgs84Tiff
        ),
    ]
}

fn changes() -> Vec<Operation> {
    vec![
        change(
            "/api/v2/vehicles/{id}/labels",
            "set_label",
            "Sets name, colour and merging of a label of the current map; they stay at the surface",
            schema::<LabelOrder>,
            || orders::to_vehicle(SurfaceRequest::Label),
        ),
        change(
            "/api/v2/vehicles/{id}/draft",
            "keep_draft",
            "Keeps the weights that an operator has set and not sent, for all pages; they stay at the surface",
            schema::<DraftOrder>,
            || post(orders::draft),
        ),
        change(
            "/api/v2/vehicles/{id}/notes",
            "add_note",
            "Adds a note about the vehicle; it stays at the surface",
            schema::<NoteOrder>,
            || post(orders::note),
        ),
        change(
            "/api/v2/vehicles/{id}/markers",
            "add_marker",
            "Sets a marker on the map; it stays at the surface",
            schema::<MarkerOrder>,
            || post(orders::marker),
        ),
        change(
            "/api/v2/vehicles/{id}/markers/remove",
            "remove_marker",
            "Removes a marker from the map",
            schema::<RemoveMarkerOrder>,
            || orders::to_vehicle(SurfaceRequest::RemoveMarker),
        ),
        change(
            "/api/v2/vehicles/{id}/earlier-map/dismiss",
            "dismiss_earlier_map",
            "Shows the current map in place of that of an earlier run, although it has fewer cells",
            schema::<DismissOrder>,
            || orders::to_vehicle(|id, DismissOrder {}| SurfaceRequest::DismissEarlierMap(id)),
        ),
    ]
}

fn commands() -> Vec<Operation> {
    vec![
        read(
            "/api/v2/principal",
            "principal",
            "Name and role of the principal that the request's token or cookie identifies",
            Content::Json(schema::<PrincipalInfo>),
            || get(login::principal),
        ),
        Operation {
            success: (200, Content::Json(schema::<CommandState>)),
            ..order(
                "/api/v2/command",
                "change_command",
                "Requests command, hands it over, takes it or gives it up. Without command, orders other than hold and abort \
                 are refused with status 409.",
                schema::<CommandOrder>,
                || post(orders::command),
            )
        },
    ]
}

/// Operations that need no principal.
fn logins() -> Vec<Operation> {
    let form = read(
        "/login",
        "login_form",
        "The form that requests the token",
        Content::File("text/html; charset=utf-8"),
        || get(login::login_form),
    );
    let post_form = |path, id, summary, route| Operation {
        method: Method::POST,
        path,
        id,
        role: None,
        summary,
        body: None,
        success: (303, Content::Headers),
        route,
    };
    vec![
        Operation { role: None, ..form },
        post_form("/login", "login", "Sets a cookie in exchange for the token", || post(login::login)),
        post_form("/logout", "logout", "Ends the session of the cookie", || post(login::logout)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_operation_has_its_own_name_and_path() {
        let all = operations();
        let names: BTreeSet<&str> = all.iter().map(|o| o.id).collect();
        let paths: BTreeSet<(&str, &str)> = all.iter().map(|o| (o.path, o.method.as_str())).collect();
        assert_eq!((names.len(), paths.len()), (all.len(), all.len()));
    }

    #[test]
    fn only_readings_and_logins_are_open_to_viewers() {
        for o in operations() {
            let is_open = o.role.is_none_or(|role| role == Role::Viewer);
            assert_eq!(
                is_open,
                o.method == Method::GET || ["login", "logout", "replay", "dry_run"].contains(&o.id),
                "{}",
                o.path
            );
            assert_eq!(o.role.is_none(), o.path.starts_with("/log"), "{}", o.path);
        }
    }
}
