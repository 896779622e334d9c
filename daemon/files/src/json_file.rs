//! Reads a file of JSON, and names other kinds that programs of maps write.

use scenecast_core::UserError;
use serde_json::Value;
use std::path::Path;

const MAX_BYTES: u64 = 1 << 20;

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Why the text of a file is not taken as GeoJSON.
#[derive(Debug, thiserror::Error)]
enum JsonError {
    #[error("it is empty")]
    Empty,
    /// It is in UTF-16, as [`scenecast_config::utf16_fault`] describes.
    #[error("{0}")]
    Utf16(String),
    #[error(transparent)]
    Other(#[from] OtherKind),
    #[error("it is not JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Another kind of file, with the command that converts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
enum OtherKind {
    #[error("it is GeoJSONSeq, with a feature on each line: ogr2ogr -f GeoJSON NEW.geojson GeoJSONSeq:OLD converts it")]
    Sequence,
    #[error("it is compressed by gzip: gunzip it first")]
    Gzip,
    #[error("it is {0}: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it")]
    Geodata(&'static str),
    #[error(
        "it is a plan of QGroundControl: the page \"Draw fences in a GIS\" of the documentation has the command that converts its fence"
    )]
    Plan,
    #[error("it is Esri JSON: ogr2ogr -f GeoJSON -t_srs EPSG:4326 NEW.geojson ESRIJSON:OLD converts it")]
    Esri,
}

/// How the files of other kinds begin, and what they are.
const OTHERS: [(&[u8], OtherKind); 6] = [
    (b"\x1E", OtherKind::Sequence),
    (b"\x1F\x8B", OtherKind::Gzip),
    (b"PK\x03\x04", OtherKind::Geodata("a ZIP archive, as of a shapefile or KMZ")),
    (b"SQLite format 3\0", OtherKind::Geodata("a GeoPackage")),
    (b"\0\0\x27\x0A", OtherKind::Geodata("a shapefile")),
    (b"<", OtherKind::Geodata("XML, as KML and GPX")),
];

/// What a file of JSON is that programs of maps write and that is no GeoJSON.
fn other_json(whole: &Value) -> Option<OtherKind> {
    let of_esri = |part: &Value| part["rings"].is_array() || part["geometry"]["rings"].is_array();
    if whole["fileType"] == "Plan" {
        return Some(OtherKind::Plan);
    }
    let is_esri = whole["geometryType"].is_string() || of_esri(whole) || of_esri(&whole["features"][0]);
    is_esri.then_some(OtherKind::Esri)
}

/// Whether a text has several objects of JSON one after the other.
fn is_sequence(text: &[u8]) -> bool {
    let mut objects = serde_json::Deserializer::from_slice(text).into_iter::<Value>();
    let mut is_object = || matches!(objects.next(), Some(Ok(Value::Object(_))));
    is_object() && is_object()
}

/// Reads a file of JSON.
pub(crate) fn read_json(file: &Path) -> Result<Value, UserError> {
    let text = scenecast_config::read_regular(file, MAX_BYTES)?;
    parse(&text).map_err(|error| UserError::file(file, error))
}

fn parse(text: &[u8]) -> Result<Value, JsonError> {
    // Programs that add one may add two.
    let mut text = text;
    while let Some(rest) = text.strip_prefix(BYTE_ORDER_MARK) {
        text = rest;
    }
    if text.iter().all(u8::is_ascii_whitespace) {
        return Err(JsonError::Empty);
    }
    if let Some(fault) = scenecast_config::utf16_fault(text) {
        return Err(JsonError::Utf16(fault));
    }
    match OTHERS.iter().find(|(head, _)| text.starts_with(head)) {
        Some((_, other)) => Err((*other).into()),
        None => match serde_json::from_slice(text) {
            Ok(whole) => other_json(&whole).map_or(Ok(whole), |other| Err(other.into())),
            Err(_) if is_sequence(text) => Err(OtherKind::Sequence.into()),
            Err(error) => Err(error.into()),
        },
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
            (b"\xFF\xFE{\0", "iconv -f UTF-16 -t UTF-8"),
            (b"{\0\"\0", "iconv -f UTF-16LE -t UTF-8"),
            (b"[\0{\0", "iconv -f UTF-16LE -t UTF-8"),
            (b"\0[\0{", "iconv -f UTF-16BE -t UTF-8"),
            (b"\x1F\x8B\x08", "gunzip"),
            (b"PK\x03\x04\x14", "shapefile"),
            (b"SQLite format 3\0", "GeoPackage"),
            (b"<?xml version", "KML"),
            (b"{\"a\":1,}", "not JSON"),
            (b"{\"a\":1} x", "not JSON"),
            (b"{\"type\":\"Feature\"}\n{\"type\":\"Feature\"}\n", "GeoJSONSeq"),
            (b"\x1E{\"type\":\"Feature\"}\n", "GeoJSONSeq"),
            (b"{\"geometryType\":\"esriGeometryPolygon\",\"features\":[]}", "ESRIJSON:OLD"),
            (b"{\"features\":[{\"geometry\":{\"rings\":[[[1,2]]]}}]}", "ESRIJSON:OLD"),
            (b"{\"fileType\":\"Plan\",\"geoFence\":{}}", "QGroundControl"),
        ] {
            let line = parse(bytes).unwrap_err().to_string();
            assert!(line.contains(what), "{line}");
        }
        assert_eq!(parse(b"\xEF\xBB\xBF\xEF\xBB\xBF[1]").unwrap(), serde_json::json!([1]));
    }
}
