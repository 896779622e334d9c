//! The OpenAPI document, made from the table of operations and from the types that they take and give.

use super::operations::{Content, Operation, SchemaOf, operations};
use super::state::{MapEvent, Refusal, State};
use axum::body::Bytes;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};
use std::sync::OnceLock;

const ABOUT: &str = "What the operator's page uses, for programs too. Times end in `_s`: seconds of mission time, `now_s` \
being now, unless they are said to be durations. Metres are east (x), north (y) and up (z). A request needs a `Host` of this \
machine and, if it has an `Origin`, that of the page; a POST needs the header `X-Scenecast: 1`. If the surface has a \
`console.token_file`, a request needs its token, in `Authorization: Bearer TOKEN` or by the cookie of `/login`. Text is \
compressed for those who take gzip; maps and files carry an `ETag`.";

/// Serves the document.
pub(super) async fn document() -> Response {
    static DOCUMENT: OnceLock<Bytes> = OnceLock::new();
    let text = DOCUMENT.get_or_init(|| serde_json::to_vec_pretty(&describe()).unwrap_or_default().into());
    ([(header::CONTENT_TYPE, "application/json")], text.clone()).into_response()
}

/// What is sent has every member, what is taken need not; so each has a generator.
struct Schemas {
    sent: SchemaGenerator,
    taken: SchemaGenerator,
}

fn describe() -> Value {
    let settings = || {
        SchemaSettings::draft2020_12().with(|s| {
            s.definitions_path = "/components/schemas".into();
            s.meta_schema = None;
        })
    };
    let mut schemas = Schemas {
        sent: settings().for_serialize().into_generator(),
        taken: settings().for_deserialize().into_generator(),
    };
    let mut paths: Map<String, Value> = Map::new();
    for operation in operations() {
        let described = describe_operation(&operation, &mut schemas);
        let path = paths.entry(operation.path).or_insert_with(|| json!({}));
        path[operation.method.as_str().to_lowercase()] = described;
    }
    let refusal = schemas.sent.subschema_for::<Refusal>();
    let mut types = schemas.sent.take_definitions(true);
    // What is both taken and told, as a fence, may be told whole but taken in part.
    types.extend(schemas.taken.take_definitions(true));
    json!({
        "openapi": "3.1.0",
        "info": { "title": "scenecast", "version": env!("CARGO_PKG_VERSION"), "description": ABOUT },
        "security": [{}, { "token": [] }, { "session": [] }],
        "paths": paths,
        "components": {
            "schemas": types,
            "responses": { "Refusal": { "description": "Not done, and why", "content": as_json(refusal.into()) } },
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
    let (status, content) = &operation.answer;
    let mut answers = json!({ "default": { "$ref": "#/components/responses/Refusal" } });
    answers[status.to_string()] = describe_answer(content, &mut schemas.sent);
    let mut described = json!({ "operationId": operation.id, "summary": operation.summary, "responses": answers });
    let parameters = parameters(operation);
    if !parameters.is_empty() {
        described["parameters"] = parameters.into();
    }
    if let Some(body) = operation.body {
        described["requestBody"] = json!({ "required": true, "content": as_json(made(body, &mut schemas.taken)) });
    } else if operation.id == "login" {
        let form = json!({ "type": "object", "required": ["token"], "properties": { "token": { "type": "string" } } });
        let content = json!({ "application/x-www-form-urlencoded": { "schema": form } });
        described["requestBody"] = json!({ "required": true, "content": content });
    }
    if operation.path == "/login" {
        described["security"] = json!([{}]);
    }
    described
}

fn made(schema: SchemaOf, generator: &mut SchemaGenerator) -> Value {
    schema(generator).into()
}

fn describe_answer(content: &Content, generator: &mut SchemaGenerator) -> Value {
    match content {
        Content::Json(schema) => json!({ "description": "As asked", "content": as_json(made(*schema, generator)) }),
        Content::File(kind) => json!({ "description": "As asked", "content": { *kind: {} } }),
        Content::Events => json!({
            "description": "A stream of events (WHATWG HTML, section 9.2), `data` being JSON",
            "content": { "text/event-stream": {
                "schema": { "type": "string" },
                "x-events": {
                    "state": generator.subschema_for::<State>(),
                    "map": generator.subschema_for::<MapEvent>(),
                },
            } },
        }),
        Content::Nothing => json!({ "description": "Done; `Location` says where to go on" }),
    }
}

fn parameters(operation: &Operation) -> Vec<Value> {
    let mut parameters = Vec::new();
    if operation.path.contains("{id}") {
        let schema = json!({ "type": "integer", "minimum": 1, "maximum": 14 });
        let what = "Address of the vehicle";
        parameters.push(json!({ "name": "id", "in": "path", "required": true, "description": what, "schema": schema }));
    }
    if operation.path.contains("{file}") {
        let schema = json!({ "type": "string", "pattern": "^[0-9]+\\.webp$" });
        let what = "Label and .webp";
        parameters
            .push(json!({ "name": "file", "in": "path", "required": true, "description": what, "schema": schema }));
    }
    if operation.id == "fit_settings" {
        let schema = json!({ "type": "number", "minimum": 1, "maximum": 10_000_000 });
        let what = "Bits a second that the stream of the map may take; left out: the map's least share of the vehicle's budget";
        parameters.push(json!({ "name": "bits_per_s", "in": "query", "description": what, "schema": schema }));
    }
    if operation.body.is_some() {
        let schema = json!({ "type": "string", "const": "1" });
        let what = "No other site's page can send it";
        parameters.push(
            json!({ "name": "X-Scenecast", "in": "header", "required": true, "description": what, "schema": schema }),
        );
    }
    parameters
}
