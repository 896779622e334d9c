//! Every path and method of the server, in one table that makes both the router and the OpenAPI document.

use super::maps::{self, Format};
use super::orders::{BudgetOrder, ConstraintsOrder, ExemplarOrder, UtilityOrder};
use super::server::{self, Shared, VehicleId};
use super::state::{Accepted, Map, State as Everything};
use super::{events, fit, metrics, openapi, token};
use axum::extract::State;
use axum::http::{HeaderMap, Method};
use axum::routing::{MethodRouter, get, post};
use scenecast_surface::{FenceOrder, LimitsOrder, SettingsOrder};
use schemars::{JsonSchema, Schema, SchemaGenerator};

/// The schema of a type.
pub(super) type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

fn schema<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}

/// What an answer carries.
pub(super) enum Content {
    /// JSON of this shape.
    Json(SchemaOf),
    /// A file or text of this type.
    File(&'static str),
    /// Server-sent events.
    Events,
    /// Nothing but its headers.
    Nothing,
}

/// A path and a method.
pub(super) struct Operation {
    pub(super) method: Method,
    pub(super) path: &'static str,
    /// Name for programs that are generated from the document.
    pub(super) id: &'static str,
    /// One line for people.
    pub(super) summary: &'static str,
    /// What the request carries.
    pub(super) body: Option<SchemaOf>,
    /// Status and content of the answer when all is well.
    pub(super) answer: (u16, Content),
    pub(super) route: fn() -> MethodRouter<Shared>,
}

fn read(
    path: &'static str,
    id: &'static str,
    summary: &'static str,
    content: Content,
    route: fn() -> MethodRouter<Shared>,
) -> Operation {
    Operation { method: Method::GET, path, id, summary, body: None, answer: (200, content), route }
}

fn order(
    path: &'static str,
    id: &'static str,
    summary: &'static str,
    body: SchemaOf,
    route: fn() -> MethodRouter<Shared>,
) -> Operation {
    let answer = (202, Content::Json(schema::<Accepted>));
    Operation { method: Method::POST, path, id, summary, body: Some(body), answer, route }
}

/// A format of the map of a vehicle.
macro_rules! map_file {
    ($path:literal, $id:literal, $summary:literal, $format:expr) => {{
        const FORMAT: Format = $format;
        read($path, $id, $summary, Content::File(FORMAT.content_type), || {
            get(|State(shared): State<Shared>, VehicleId(id): VehicleId, headers: HeaderMap| {
                maps::file(shared, id, headers, FORMAT)
            })
        })
    }};
}

/// All operations.
pub(super) fn operations() -> Vec<Operation> {
    let mut all = readings();
    all.extend(map_files());
    all.extend(orders());
    all.extend(entrance());
    all
}

fn readings() -> Vec<Operation> {
    vec![
        read("/api/v1/state", "state", "The state", Content::Json(schema::<Everything>), || get(server::state)),
        read(
            "/api/v1/events",
            "events",
            "Changes: `state` with the whole state whenever it changes and at least once a second; `map` when a map has \
             changed. A slow reader misses states, never the last one.",
            Content::Events,
            || get(events::events),
        ),
        read(
            "/api/v1/vehicles/{id}/map",
            "map",
            "The map with the age of its cells",
            Content::Json(schema::<Map>),
            || get(maps::map),
        ),
        read(
            "/api/v1/vehicles/{id}/exemplars/{file}",
            "exemplar",
            "An image of a label, if it is here: the newest as in 3.webp, or one by its number as in 3-17.webp",
            Content::File("image/webp"),
            || get(server::exemplar),
        ),
        read("/api/openapi.json", "openapi", "This document", Content::File("application/json"), || {
            get(openapi::document)
        }),
        read(
            "/metrics",
            "metrics",
            "Figures for Prometheus, text format 0.0.4",
            Content::File(metrics::CONTENT_TYPE),
            || get(metrics::metrics),
        ),
    ]
}

fn map_files() -> Vec<Operation> {
    vec![
        map_file!(
            "/api/v1/vehicles/{id}/map.png",
            "map_png",
            "The map as an indexed PNG, north up, pixel value = label",
            maps::PNG
        ),
        map_file!("/api/v1/vehicles/{id}/map.pgw", "map_world_file", "The world file of that PNG", maps::WORLD),
        map_file!(
            "/api/v1/vehicles/{id}/map.png.aux.xml",
            "map_projection",
            "The projection of that PNG, where GDAL and QGIS look for it",
            maps::PROJECTION
        ),
        map_file!(
            "/api/v1/vehicles/{id}/map.geojson",
            "map_geojson",
            "Regions of equal label; WGS 84 if the mission has an origin, else metres east and north of it",
            maps::GEOJSON
        ),
        map_file!(
            "/api/v1/vehicles/{id}/map.ply",
            "map_ply",
            "The cells as a coloured point cloud, metres east, north, up",
            maps::PLY
        ),
        read(
            "/api/v1/vehicles/{id}/fit",
            "fit_settings",
            "The settings of the scene model that tell most of those whose stream fits a budget, and what they give up",
            Content::Json(schema::<fit::Fit>),
            || get(fit::read),
        ),
        map_file!("/api/v1/vehicles/{id}/map.csv", "map_csv", "A line for each explored cell", maps::CSV),
    ]
}

fn orders() -> Vec<Operation> {
    vec![
        order(
            "/api/v1/vehicles/{id}/utility",
            "set_utility",
            "Sends weights of labels and of unseen cells",
            schema::<UtilityOrder>,
            || post(server::utility),
        ),
        order(
            "/api/v1/vehicles/{id}/exemplars",
            "ask_exemplar",
            "Asks the vehicle for an image of a label: first the best, then another or a larger one; or cancels that. At most 8 \
             are under way at a time.",
            schema::<ExemplarOrder>,
            || post(server::request),
        ),
        order(
            "/api/v1/vehicles/{id}/constraints",
            "set_constraints",
            "Tells the vehicle to stay, to abort, or to go on",
            schema::<ConstraintsOrder>,
            || post(server::constraints),
        ),
        order(
            "/api/v1/vehicles/{id}/fence",
            "set_fence",
            "Sends a fence in place of the last. Vertices in metres east and north in the world, where they stay when a fix moves \
             the vehicle's map; 3 to 34 an outline, at most 15 keep-outs. \
             Refused: edges that cross or touch, no area, a keep-out around the whole fence, a return point where the \
             vehicle may not be, more than fits a frame. The vehicle refuses a fence outside of which it is.",
            schema::<FenceOrder>,
            || post(server::fence),
        ),
        order(
            "/api/v1/vehicles/{id}/limits",
            "set_limits",
            "Sends limits in place of the last. Reactions are hold, return or surface. The vehicle refuses a band in which it \
             does not fly.",
            schema::<LimitsOrder>,
            || post(server::limits),
        ),
        order(
            "/api/v1/vehicles/{id}/settings",
            "set_settings",
            "Changes how the vehicle builds its map, which cells and layers of it it tells, and how it chooses its way. What is \
             left out or null stays as it is there; 0 or an empty text is as the vehicle is configured. Labels keep their meaning.",
            schema::<SettingsOrder>,
            || post(server::settings),
        ),
        order(
            "/api/v1/budget",
            "set_budget",
            "Changes the budget of the surface, at once, and of each vehicle, by the directive, and what it is spent on",
            schema::<BudgetOrder>,
            || post(server::budget),
        ),
    ]
}

fn entrance() -> Vec<Operation> {
    vec![
        read(
            "/login",
            "login_form",
            "The form that asks for the token",
            Content::File("text/html; charset=utf-8"),
            || get(token::login_form),
        ),
        Operation {
            method: Method::POST,
            path: "/login",
            id: "login",
            summary: "Gives a cookie for the token",
            body: None,
            answer: (303, Content::Nothing),
            route: || post(token::login),
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_operation_has_a_name_and_a_place_of_its_own() {
        let all = operations();
        let names: BTreeSet<&str> = all.iter().map(|o| o.id).collect();
        let places: BTreeSet<(&str, &str)> = all.iter().map(|o| (o.path, o.method.as_str())).collect();
        assert_eq!((names.len(), places.len()), (all.len(), all.len()));
    }
}
