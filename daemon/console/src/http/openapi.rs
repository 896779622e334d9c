//! The OpenAPI document, made from the table of operations and the types of their requests and responses.

use super::handlers::maps::TILES;
use super::operations::{Content, Operation, SchemaOf, operations};
use crate::bodies::{ErrorBody, MapEvent, MapIndex};
use scenecast_protocol::map::MAX_LABEL;
use scenecast_surface::LogKind;
use scenecast_surface::state::MissionState;
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

const DESCRIPTION: &str = "The interface of the operator's page, for programs as well. A member that ends in `_s` is a mission \
time in seconds, `now_s` being the present, unless it is called a duration. Metres are east (x), north (y) and up (z). A request \
needs a `Host` of this machine and, if it has an `Origin`, that of the page; a POST needs the header `X-Scenecast: 1`. If the \
surface has a `console.token_file`, a request needs a token of it, in `Authorization: Bearer TOKEN` or as the cookie of \
`/login`; `x-role` is the least role that may use an operation (viewer, operator, administrator). Orders other than hold \
and abort also need command, which belongs to one client of a principal: see `change_command`. A client names itself in the header \
`X-Scenecast-Client`. \
Text is compressed for clients that accept gzip; maps and files carry an `ETag`.";

pub(super) fn document() -> Vec<u8> {
    serde_json::to_vec_pretty(&describe()).unwrap_or_default()
}

/// A response has every member, but a request may omit some, so each has its own generator.
struct Schemas {
    response: SchemaGenerator,
    request: SchemaGenerator,
}

fn describe() -> Value {
    let settings = || {
        SchemaSettings::draft2020_12().with(|s| {
            s.definitions_path = "/components/schemas".into();
            s.meta_schema = None;
        })
    };
    let mut schemas = Schemas {
        response: settings().for_serialize().into_generator(),
        request: settings().for_deserialize().into_generator(),
    };
    let mut paths: Map<String, Value> = Map::new();
    for operation in operations() {
        let described = describe_operation(&operation, &mut schemas);
        let path = paths.entry(operation.path).or_insert_with(|| json!({}));
        path[operation.method.as_str().to_lowercase()] = described;
    }
    let error = schemas.response.subschema_for::<ErrorBody>();
    let mut types = schemas.response.take_definitions(true);
    // A type of both, such as a fence, has all members in a response but may omit some in a request.
    types.extend(schemas.request.take_definitions(true));
    json!({
        "openapi": "3.1.0",
        "info": { "title": "scenecast", "version": env!("CARGO_PKG_VERSION"), "description": DESCRIPTION },
        "security": [{}, { "token": [] }, { "session": [] }],
        "paths": paths,
        "components": {
            "schemas": types,
            "responses": { "Error": { "description": "The request failed", "content": as_json(error.into()) } },
            "securitySchemes": {
                "token": { "type": "http", "scheme": "bearer" },
                "session": { "type": "apiKey", "in": "cookie", "name": "scenecast-session" },
            },
        },
    })
}

fn as_json(schema: Value) -> Value {
    json!({ "application/json": { "schema": schema } })
}

fn describe_operation(operation: &Operation, schemas: &mut Schemas) -> Value {
    let (status, content) = &operation.success;
    let mut responses = json!({ "default": { "$ref": "#/components/responses/Error" } });
    if operation.body.is_some() {
        responses["422"] = json!({
            "description": "It has the documented form, and its meaning is refused, such as a fence that crosses itself",
            "content": as_json(json!({ "$ref": "#/components/schemas/ErrorBody" })),
        });
    }
    responses[status.to_string()] = describe_response(content, &mut schemas.response);
    let mut described = json!({ "operationId": operation.id, "summary": operation.summary, "responses": responses });
    if let Some(role) = operation.role {
        described["x-role"] = role.name().into();
    }
    let parameters = parameters(operation);
    if !parameters.is_empty() {
        described["parameters"] = parameters.into();
    }
    if let Some(body) = operation.body {
        described["requestBody"] =
            json!({ "required": true, "content": as_json(resolved(body, &mut schemas.request)) });
    } else if operation.id == "login" {
        let form = json!({ "type": "object", "required": ["token"], "properties": { "token": { "type": "string" } } });
        let content = json!({ "application/x-www-form-urlencoded": { "schema": form } });
        described["requestBody"] = json!({ "required": true, "content": content });
    }
    if operation.role.is_none() {
        described["security"] = json!([{}]);
    }
    described
}

fn resolved(schema: SchemaOf, generator: &mut SchemaGenerator) -> Value {
    schema(generator).into()
}

fn describe_response(content: &Content, generator: &mut SchemaGenerator) -> Value {
    match content {
        Content::Json(schema) => json!({ "description": "Success", "content": as_json(resolved(*schema, generator)) }),
        Content::File(kind) => json!({ "description": "Success", "content": { *kind: {} } }),
        Content::Events => json!({
            "description": "A stream of events (WHATWG HTML, section 9.2), `data` being JSON",
            "content": { "text/event-stream": {
                "schema": { "type": "string" },
                "x-events": {
                    "state": generator.subschema_for::<MissionState>(),
                    "map": generator.subschema_for::<MapEvent>(),
                },
            } },
        }),
        Content::Tiles => json!({
            "description": "An index in JSON, then the tiles",
            "content": { TILES: {
                "schema": { "type": "string", "format": "binary" },
                "x-index": generator.subschema_for::<MapIndex>(),
            } },
        }),
        Content::Empty => json!({ "description": "Success; the response has no content" }),
        Content::Headers => json!({ "description": "Success; `Location` is the next page" }),
    }
}

fn parameters(operation: &Operation) -> Vec<Value> {
    let mut parameters = Vec::new();
    if operation.path.contains("{id}") {
        let schema = json!({ "type": "integer", "minimum": 1, "maximum": 14 });
        let text = "Address of the vehicle";
        parameters.push(json!({ "name": "id", "in": "path", "required": true, "description": text, "schema": schema }));
    }
    if operation.path.contains("{name}") {
        let schema = json!({ "type": "string", "pattern": "^archive-[0-9]+-epoch-[0-9]+-run-[0-9]+-[0-9]+$" });
        let text = "Name of the archived map, from the list";
        parameters
            .push(json!({ "name": "name", "in": "path", "required": true, "description": text, "schema": schema }));
    }
    if operation.path.contains("{x}") {
        for (name, text) in [("x", "Column of the cell"), ("y", "Row of the cell")] {
            let schema = json!({ "type": "integer", "minimum": i32::MIN, "maximum": i32::MAX });
            parameters
                .push(json!({ "name": name, "in": "path", "required": true, "description": text, "schema": schema }));
        }
    }
    if operation.path.contains("{file}") {
        let schema = json!({ "type": "string", "pattern": "^[0-9]+(-[0-9]+)?\\.webp$" });
        let text = "Label and .webp, or label, number of the image and .webp";
        parameters
            .push(json!({ "name": "file", "in": "path", "required": true, "description": text, "schema": schema }));
    }
    if operation.id == "fit_settings" {
        let schema = json!({ "type": "number", "minimum": 1, "maximum": 10_000_000 });
        let text = "Budget of the stream of the map, bit/s; by default the map's share of the vehicle's budget";
        parameters.push(json!({ "name": "bits_per_s", "in": "query", "description": text, "schema": schema }));
    }
    if operation.id == "map_tiles" {
        let text = "The tag of the tiles that the client holds; without it, or with one that is out of date, all tiles";
        let schema = json!({ "type": "string", "example": "0badcafe-12" });
        parameters.push(json!({ "name": "since", "in": "query", "description": text, "schema": schema }));
    }
    if matches!(operation.id, "log" | "log_csv") {
        for (name, text, schema) in [
            (
                "vehicle",
                "Only the entries of the vehicle with this address",
                json!({ "type": "integer", "minimum": 0, "maximum": 255 }),
            ),
            ("kind", "Only the entries of this kind", json!({ "enum": LogKind::ALL.map(LogKind::name) })),
            ("since", "Only the entries with a higher number", json!({ "type": "integer", "minimum": 0 })),
        ] {
            parameters.push(json!({ "name": name, "in": "query", "description": text, "schema": schema }));
        }
    }
    if operation.id == "map" {
        let (corner, size) = ((i64::from(i32::MIN), i64::from(i32::MAX)), (1, i64::from(u32::MAX)));
        for (name, text, (low, high)) in [
            ("x0", "Column of the south-west cell of a region, which needs all four parameters", corner),
            ("y0", "Row of the south-west cell of the region", corner),
            ("width", "Columns of the region", size),
            ("height", "Rows of the region", size),
        ] {
            let schema = json!({ "type": "integer", "minimum": low, "maximum": high });
            parameters.push(json!({ "name": name, "in": "query", "description": text, "schema": schema }));
        }
    }
    if operation.path.contains("/map.") {
        let schema = json!({ "type": "integer", "minimum": 1, "maximum": MAX_LABEL });
        let text = "The number of labels at which the tree of the labels is cut; all by default";
        parameters.push(json!({ "name": "labels", "in": "query", "description": text, "schema": schema }));
    }
    if operation.body.is_some() || operation.id == "logout" {
        let schema = json!({ "type": "string", "const": "1" });
        let text = "The page of another site cannot send it";
        parameters.push(
            json!({ "name": "X-Scenecast", "in": "header", "required": true, "description": text, "schema": schema }),
        );
        let schema = json!({ "type": "string", "pattern": "^[A-Za-z0-9._-]{1,32}$" });
        let text = "The name that the client gives itself: command belongs to the client that took it";
        parameters.push(json!({ "name": "X-Scenecast-Client", "in": "header", "description": text, "schema": schema }));
    }
    parameters
}
