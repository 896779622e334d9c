//! Answers in fewer bytes: gzip where the client takes it, and nothing where it has the same already.

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;

/// Fewer bytes than this are not worth it.
const LEAST: usize = 512;
/// More than any answer has.
const MOST: usize = 1 << 28;

/// Bytes in gzip (RFC 1952); `None` if there is no memory for them.
pub(super) fn gzip(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).ok()?;
    encoder.finish().ok()
}

/// Whether the client takes gzip.
pub(super) fn takes_gzip(headers: &HeaderMap) -> bool {
    let offered = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|v| v.to_str().ok());
    offered.flat_map(|list| list.split(',')).any(|one| {
        let (name, weight) = one.split_once(';').unwrap_or((one, ""));
        name.trim().eq_ignore_ascii_case("gzip") && !matches!(weight.trim(), "q=0" | "q=0.0" | "q=0.00" | "q=0.000")
    })
}

/// Compresses whole answers of text.
pub(super) async fn compress(request: Request, next: Next) -> Response {
    let wanted = takes_gzip(request.headers());
    let mut response = next.run(request).await;
    if !is_text(response.headers()) {
        return response;
    }
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    if !wanted || response.headers().contains_key(header::CONTENT_ENCODING) {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    let Ok(bytes) = to_bytes(body, MOST).await else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    let Some(packed) = (bytes.len() >= LEAST).then(|| gzip(&bytes)).flatten() else {
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

/// An answer that the client may keep as long as `tag` is the same; only the tag if the client has it.
pub(super) fn tagged(headers: &HeaderMap, tag: &str, answer: impl FnOnce() -> Response) -> Response {
    // The same content in another encoding has the same tag, so it is a weak one (RFC 9110, section 8.8.1).
    let tag = format!("W/\"{tag}\"");
    let held = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    let is_held = held.flat_map(|list| list.split(',')).any(|one| one.trim() == tag);
    let mut response = if is_held { StatusCode::NOT_MODIFIED.into_response() } else { answer() };
    if response.status().is_success() || is_held {
        let headers = response.headers_mut();
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
        if let Ok(tag) = HeaderValue::from_str(&tag) {
            headers.insert(header::ETAG, tag);
        }
    }
    response
}

/// Text in gzip if the client takes it, of which both forms are at hand.
pub(super) fn either(headers: &HeaderMap, kind: &'static str, plain: &Bytes, packed: &Bytes) -> Response {
    let kind = (header::CONTENT_TYPE, kind);
    if takes_gzip(headers) {
        return ([kind, (header::CONTENT_ENCODING, "gzip")], packed.clone()).into_response();
    }
    ([kind], plain.clone()).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_goes_only_to_those_who_take_it() {
        let takes = |value: &'static str| {
            takes_gzip(&HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(value))]))
        };
        assert!(takes("gzip, deflate, br") && takes("br;q=1, GZIP;q=0.5"));
        assert!(!takes("identity") && !takes("gzip;q=0, br") && !takes("x-gzip-like"));
        assert!(!takes_gzip(&HeaderMap::new()));
    }

    #[test]
    fn what_is_held_is_not_sent_again() {
        let held =
            |value: &'static str| HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_static(value))]);
        let status = |headers| tagged(&headers, "a1", || "text".into_response()).status();
        assert_eq!(status(HeaderMap::new()), StatusCode::OK);
        assert_eq!(status(held("W/\"a0\"")), StatusCode::OK);
        assert_eq!(status(held("W/\"a0\", W/\"a1\"")), StatusCode::NOT_MODIFIED);
    }
}
