//! Reads a file of JSON, and names other kinds that programs of maps write.

use scenecast_core::UserError;
use serde_json::Value;
use std::path::Path;

const MAX_BYTES: u64 = 1 << 20;

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// How the files of other kinds begin, and what they are.
const OTHERS: [(&[u8], &str); 6] = [
    (b"\x1E", SEQUENCE),
    (b"\x1F\x8B", "it is compressed by gzip: gunzip it first"),
    (
        b"PK\x03\x04",
        "it is a ZIP archive, as of a shapefile or KMZ: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it",
    ),
    (b"SQLite format 3\0", "it is a GeoPackage: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
    (b"\0\0\x27\x0A", "it is a shapefile: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
    (b"<", "it is XML, as KML and GPX: ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD converts it"),
];

const SEQUENCE: &str =
    "it is GeoJSONSeq, with a feature on each line: ogr2ogr -f GeoJSON NEW.geojson GeoJSONSeq:OLD converts it";

/// What a file of JSON is that programs of maps write and that is no GeoJSON.
fn other_json(whole: &Value) -> Option<&'static str> {
    let of_esri = |part: &Value| part["rings"].is_array() || part["geometry"]["rings"].is_array();
    if whole["fileType"] == "Plan" {
        return Some(
            "it is a plan of QGroundControl: the page \"Draw fences in a GIS\" of the documentation has the command that converts its fence",
        );
    }
    (whole["geometryType"].is_string() || of_esri(whole) || of_esri(&whole["features"][0]))
        .then_some("it is Esri JSON: ogr2ogr -f GeoJSON -t_srs EPSG:4326 NEW.geojson ESRIJSON:OLD converts it")
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
    if let Some(fault) = scenecast_config::utf16_fault(text) {
        return Err(fault);
    }
    match OTHERS.iter().find(|(head, _)| text.starts_with(head)) {
        Some((_, what)) => Err((*what).to_owned()),
        None => match serde_json::from_slice(text) {
            Ok(whole) => other_json(&whole).map_or(Ok(whole), |what| Err(what.to_owned())),
            Err(_) if is_sequence(text) => Err(SEQUENCE.to_owned()),
            Err(error) => Err(format!("it is not JSON: {error}")),
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
            let line = parse(bytes).unwrap_err();
            assert!(line.contains(what), "{line}");
        }
        assert_eq!(parse(b"\xEF\xBB\xBF\xEF\xBB\xBF[1]"), Ok(serde_json::json!([1])));
    }
}
