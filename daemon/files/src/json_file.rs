//! Reads a file of JSON, and names other kinds that programs of maps write.

use scenecast_core::UserError;
use serde_json::Value;
use std::path::Path;

const MAX_BYTES: u64 = 1 << 20;

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// How the files of other kinds begin, and what they are.
const OTHERS: [(&[u8], &str); 9] = [
    (b"\xFF\xFE", "it is UTF-16; GeoJSON is UTF-8"),
    (b"\xFE\xFF", "it is UTF-16; GeoJSON is UTF-8"),
    (b"{\0", "it is UTF-16; GeoJSON is UTF-8"),
    (b"\0{", "it is UTF-16; GeoJSON is UTF-8"),
    (b"\x1F\x8B", "it is compressed by gzip: gunzip it first"),
    (
        b"PK\x03\x04",
        "it is a ZIP archive, as of a shapefile or KMZ: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it",
    ),
    (b"SQLite format 3\0", "it is a GeoPackage: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
    (b"\0\0\x27\x0A", "it is a shapefile: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
    (b"<", "it is XML, as KML and GPX: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
];

/// Reads a file of JSON.
pub(crate) fn read_json(file: &Path) -> Result<Value, UserError> {
    let text = scenecast_config::read_regular(file, MAX_BYTES)?;
    parse(&text).map_err(|line| UserError::file(file, line))
}

fn parse(text: &[u8]) -> Result<Value, String> {
    // Programs that add one may add two.
    let mut text = text;
    while let Some(rest) = text.strip_prefix(BYTE_ORDER_MARK) {
        text = rest;
    }
    if text.iter().all(u8::is_ascii_whitespace) {
        return Err("it is empty".to_owned());
    }
    match OTHERS.iter().find(|(head, _)| text.starts_with(head)) {
        Some((_, what)) => Err((*what).to_owned()),
        None => serde_json::from_slice(text).map_err(|e| format!("it is not JSON: {e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_other_kinds_are_named() {
        for (bytes, what) in [
            (&b""[..], "it is empty"),
            (b"\xEF\xBB\xBF\n", "it is empty"),
            (b"\xFF\xFE{\0", "UTF-16"),
            (b"{\0\"\0", "UTF-16"),
            (b"\x1F\x8B\x08", "gunzip"),
            (b"PK\x03\x04\x14", "shapefile"),
            (b"SQLite format 3\0", "GeoPackage"),
            (b"<?xml version", "KML"),
            (b"{\"a\":1,}", "not JSON"),
        ] {
            let line = parse(bytes).unwrap_err();
            assert!(line.contains(what), "{line}");
        }
        assert_eq!(parse(b"\xEF\xBB\xBF\xEF\xBB\xBF[1]"), Ok(serde_json::json!([1])));
    }
}
