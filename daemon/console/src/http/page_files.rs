//! The files of the page.

use super::response::{not_found, tagged};
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use crc::{CRC_32_ISCSI, Crc};

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
