//! Replies over HTTP, and the files of the page.

use crate::bodies::{ArchiveList, ErrorBody};
use crate::export::map_body;
use axum::Json;
use axum::body::{Body, to_bytes};
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use crc::{CRC_32_ISCSI, Crc};
use flate2::Compression;
use flate2::write::GzEncoder;
use scenecast_surface::Reply;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt::{Display, Formatter};
use std::io::Write;
use std::marker::PhantomData;

/// The response to a handled request.
pub(super) fn respond(reply: Reply) -> Response {
    match reply {
        Reply::Map(cells) => match map_body(&cells, None) {
            Ok(body) => Json(body).into_response(),
            Err(reason) => error(StatusCode::UNPROCESSABLE_ENTITY, &reason),
        },
        Reply::File(content_type, bytes) => ([(header::CONTENT_TYPE, content_type)], bytes).into_response(),
        Reply::Fit(fit) => Json(*fit).into_response(),
        Reply::DryRun(run) => Json(*run).into_response(),
        Reply::Accepted(accepted) => (StatusCode::ACCEPTED, Json(accepted)).into_response(),
        Reply::Done => StatusCode::NO_CONTENT.into_response(),
        // The handler of the log makes its lines.
        Reply::Log(_) => not_found(),
        Reply::FormerLabels(history) => Json(history).into_response(),
        Reply::Floor(list) => Json(list).into_response(),
        Reply::Archives(maps) => Json(ArchiveList { maps }).into_response(),
        Reply::Command(command) => Json(command).into_response(),
        Reply::Replay(replay) => Json(*replay).into_response(),
        Reply::ReplayEvents(events) => Json(events).into_response(),
        Reply::Forbidden(reason) => error(StatusCode::FORBIDDEN, &reason),
        Reply::NotInCommand(reason) => error(StatusCode::CONFLICT, &reason),
        Reply::NotFound => not_found(),
        Reply::Refused(reason) => error(StatusCode::UNPROCESSABLE_ENTITY, &reason),
    }
}

/// An error with one line for people.
pub(super) fn error(status: StatusCode, line: impl Display) -> Response {
    (status, Json(ErrorBody { error: line.to_string() })).into_response()
}

pub(super) fn not_found() -> Response {
    error(StatusCode::NOT_FOUND, "there is no such page, vehicle, label or image")
}

/// The body of an order: a JSON object. Serde would also accept a list of the members in their order.
pub(super) struct JsonOrder<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for JsonOrder<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Members(PhantomData))
    }
}

struct Members<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
    type Value = JsonOrder<T>;

    fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<JsonOrder<T>, A::Error> {
        T::deserialize(MapAccessDeserializer::new(members)).map(JsonOrder)
    }
}

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for JsonOrder<T> {
    type Rejection = Response;

    async fn from_request(request: Request, state: &S) -> Result<Self, Response> {
        let body = Json::<Self>::from_request(request, state).await;
        body.map(|Json(order)| order).map_err(|e| error(e.status(), e.body_text()))
    }
}

/// Shorter responses are sent as they are.
const MIN_BYTES: usize = 512;
const MAX_BYTES: usize = 1 << 28;

/// Bytes in gzip (RFC 1952); `None` if there is no memory for them.
pub fn gzip(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).ok()?;
    encoder.finish().ok()
}

/// Whether the client accepts gzip.
pub(super) fn accepts_gzip(headers: &HeaderMap) -> bool {
    let offered = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|v| v.to_str().ok());
    offered.flat_map(|list| list.split(',')).any(|one| {
        let (name, weight) = one.split_once(';').unwrap_or((one, ""));
        name.trim().eq_ignore_ascii_case("gzip") && !matches!(weight.trim(), "q=0" | "q=0.0" | "q=0.00" | "q=0.000")
    })
}

pub(super) async fn compress(request: Request, next: Next) -> Response {
    let wanted = accepts_gzip(request.headers());
    let mut response = next.run(request).await;
    if !is_text(response.headers()) {
        return response;
    }
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    if !wanted || response.headers().contains_key(header::CONTENT_ENCODING) {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    let Ok(bytes) = to_bytes(body, MAX_BYTES).await else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    let Some(packed) = (bytes.len() >= MIN_BYTES).then(|| gzip(&bytes)).flatten() else {
        return Response::from_parts(parts, Body::from(bytes));
    };
    parts.headers.remove(header::CONTENT_LENGTH);
    parts.headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    Response::from_parts(parts, Body::from(packed))
}

fn is_text(headers: &HeaderMap) -> bool {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
    let text = kind.starts_with("text/") || kind.contains("json") || kind.contains("xml") || kind.contains("ply");
    text && !kind.starts_with("text/event-stream")
}

/// A response that the client may keep while `tag` is the same; status 304 if it has the response.
pub(super) fn tagged(headers: &HeaderMap, tag: &str, response: impl FnOnce() -> Response) -> Response {
    // The same content in another encoding has the same tag, so it is a weak one (RFC 9110, section 8.8.1).
    let tag = format!("W/\"{tag}\"");
    let held = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    let is_held = held.flat_map(|list| list.split(',')).any(|one| one.trim() == tag);
    let mut response = if is_held { StatusCode::NOT_MODIFIED.into_response() } else { response() };
    if response.status().is_success() || is_held {
        let headers = response.headers_mut();
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
        if let Ok(tag) = HeaderValue::from_str(&tag) {
            headers.insert(header::ETAG, tag);
        }
    }
    response
}

static FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));

/// Content type and bytes of a file of the page; the empty path means index.html.
pub(super) fn find_page_file(path: &str) -> Option<(&'static str, &'static [u8])> {
    let path = if path.is_empty() { "index.html" } else { path };
    let &(name, bytes) = FILES.iter().find(|(name, _)| *name == path)?;
    let content_type = match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("webp") => "image/webp",
        Some("png") => "image/png",
        _ => "application/octet-stream",
    };
    Some((content_type, bytes))
}

/// The files of the page with their bytes, the form for the token among them.
pub fn page_files() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    FILES.iter().copied()
}

/// Serves a file of the page.
pub(super) async fn page(uri: Uri, headers: HeaderMap) -> Response {
    const SUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
    let Some((content_type, bytes)) = find_page_file(uri.path().trim_start_matches('/')) else { return not_found() };
    let tag = format!("{:08x}", SUM.checksum(bytes));
    tagged(&headers, &tag, || ([(header::CONTENT_TYPE, content_type)], bytes).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::SettingsOrder;

    #[test]
    fn an_order_is_an_object_and_not_a_list() {
        let read = |json: &str| serde_json::from_str::<JsonOrder<SettingsOrder>>(json).map(|JsonOrder(o)| o.planner);
        assert_eq!(read(r#"{"planner": "greedy"}"#).unwrap().as_deref(), Some("greedy"));
        assert!(read("[null, null]").unwrap_err().to_string().contains("an object"));
        assert!(read(r#"{"plan": 1}"#).unwrap_err().to_string().contains("unknown field"));
    }

    #[test]
    fn gzip_is_sent_only_to_clients_that_accept_it() {
        let accepts = |value: &'static str| {
            accepts_gzip(&HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(value))]))
        };
        assert!(accepts("gzip, deflate, br") && accepts("br;q=1, GZIP;q=0.5"));
        assert!(!accepts("identity") && !accepts("gzip;q=0, br") && !accepts("x-gzip-like"));
        assert!(!accepts_gzip(&HeaderMap::new()));
    }

    #[test]
    fn a_client_with_the_same_tag_receives_status_304() {
        let held =
            |value: &'static str| HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_static(value))]);
        let status = |headers| tagged(&headers, "a1", || "text".into_response()).status();
        assert_eq!(status(HeaderMap::new()), StatusCode::OK);
        assert_eq!(status(held("W/\"a0\"")), StatusCode::OK);
        assert_eq!(status(held("W/\"a0\", W/\"a1\"")), StatusCode::NOT_MODIFIED);
    }

    #[test]
    fn the_page_and_the_daemon_have_the_same_palette() {
        let (_, script) = find_page_file("js/palette-table.js").unwrap();
        let hex: String = std::str::from_utf8(script).unwrap().split('"').skip(1).step_by(2).collect();
        let page: Vec<u32> = hex
            .as_bytes()
            .chunks(6)
            .map(|c| u32::from_str_radix(std::str::from_utf8(c).unwrap(), 16).unwrap())
            .collect();
        assert_eq!(page, scenecast_core::palette::PALETTE);
    }
}
