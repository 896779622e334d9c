//! Reads a fence, or weighted areas, from a GeoJSON file (RFC 7946). Features without a geometry are passed over.

use crate::json_file::read_json;
use scenecast_core::{LatLon, MAX_DISTANCE_M, PlaceError, TangentPlane, UserError, fence_of};
use scenecast_protocol::directive::Fence;
use serde_json::Value;
use std::path::Path;

/// Corners so close to each other are the same, metres.
const SAME_M: f64 = 0.001;

/// Fence, keep-outs and return point of a file, in metres east and north of the mission's origin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FenceShapes {
    pub fence: Option<Vec<[f64; 2]>>,
    pub keep_outs: Vec<Vec<[f64; 2]>>,
    pub return_point: Option<[f64; 2]>,
}

impl FenceShapes {
    /// The fence as an order has it. The error is one line that names the allowed values.
    pub fn to_fence(&self) -> Result<Fence, PlaceError> {
        fence_of(self.fence.as_deref(), &self.keep_outs, self.return_point)
    }
}

/// A weighted area of a file, in metres east and north of the mission's origin.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaShape {
    pub outline: Vec<[f64; 2]>,
    pub weight: f64,
}

/// The coordinates of a file.
#[derive(Debug, Clone, Copy)]
pub enum CoordinateFrame {
    /// Metres east and north of the mission's origin.
    Metres,
    /// Longitude and latitude, WGS 84, converted around that origin.
    Wgs84(TangentPlane),
}

/// The property `role` of a feature.
#[derive(Debug, Clone, Copy, PartialEq)]
enum FeatureRole {
    Fence,
    KeepOut,
    ReturnPoint,
}

impl FeatureRole {
    /// Its value in a file.
    fn name(self) -> &'static str {
        match self {
            Self::Fence => "fence",
            Self::KeepOut => "keep_out",
            Self::ReturnPoint => "return_point",
        }
    }
}

/// A file that is no fence, or has no weighted areas.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum GeoJsonError {
    #[error("features[{index}]: {error}")]
    Feature { index: usize, error: Box<GeoJsonError> },
    #[error("{member} {found}: expected {expected}")]
    NotAllowed { member: &'static str, found: String, expected: &'static str },
    #[error(
        "crs {0}: only longitude and latitude of WGS 84 are read, as RFC 7946 has it; ogr2ogr -t_srs EPSG:4326 NEW.geojson OLD.geojson converts it"
    )]
    Crs(String),
    #[error("the collection has no list of features")]
    NoFeatures,
    #[error("coordinates are missing")]
    NoCoordinates,
    #[error("the outline is not a list of corners")]
    NoCorners,
    #[error("{0} is not a place")]
    NoPlace(Value),
    #[error("{0} holes: draw each as a polygon with role = keep_out")]
    Holes(usize),
    #[error("[{x}, {y}] m is more than {} km from the mission's origin", MAX_DISTANCE_M / 1000.0)]
    FarMetres { x: f64, y: f64 },
    #[error("[{x}, {y}] is not a longitude and latitude; --metres reads metres east and north of the origin")]
    NoDegrees { x: f64, y: f64 },
    #[error(
        "[{x}, {y}] is {:.0} km from the mission's origin [{}, {}]; expected longitude, latitude at most {} km from it, or --metres for metres east and north",
        .far_m / 1000.0, .origin.lon_deg, .origin.lat_deg, MAX_DISTANCE_M / 1000.0
    )]
    FarDegrees { x: f64, y: f64, far_m: f64, origin: LatLon },
    #[error("it has no area; scenecast ctl areas clear removes all areas")]
    NoArea,
    #[error("it has a role and no weight, as the shapes of a fence, which scenecast ctl fence reads")]
    RoleWithoutWeight,
    #[error("the property weight is not a number")]
    NoWeight,
    #[error("it contains neither polygon nor point")]
    NoShape,
    #[error("it has role = {} and no geometry: draw it, or leave it out", .0.name())]
    NoGeometry(FeatureRole),
    #[error("it has a weight: scenecast ctl areas reads weighted areas, and a fence has none")]
    WeightInFence,
    #[error("a point without a role: give the return point the property role = return_point, and leave out others")]
    PointWithoutRole,
    #[error("a second return point")]
    SecondReturnPoint,
    #[error("the return point is a Point")]
    ReturnPolygon,
    #[error(
        "a second fence: an area to stay out of has the property role = keep_out; a fence that is cut at 180 degrees is to be drawn whole, with longitudes beyond 180"
    )]
    SecondFence,
}

impl GeoJsonError {
    /// The error as that of a feature of a list.
    fn of_feature(self, index: usize) -> Self {
        Self::Feature { index, error: Box::new(self) }
    }

    /// The member `type` of `whole` is another one.
    fn other_type(whole: &Value, expected: &'static str) -> Self {
        Self::NotAllowed { member: "type", found: whole["type"].as_str().unwrap_or("is missing").to_owned(), expected }
    }
}

/// Reads fence, keep-outs and return point.
pub fn read_fence(file: &Path, frame: CoordinateFrame) -> Result<FenceShapes, UserError> {
    let shapes = shapes_of(&read_json(file)?, frame).map_err(|error| UserError::file(file, error))?;
    shapes.to_fence().map_err(|error| UserError::file(file, error))?;
    Ok(shapes)
}

/// Reads weighted areas: polygons with the property `weight`.
pub fn read_areas(file: &Path, frame: CoordinateFrame) -> Result<Vec<AreaShape>, UserError> {
    areas_of(&read_json(file)?, frame).map_err(|error| UserError::file(file, error))
}

fn areas_of(whole: &Value, frame: CoordinateFrame) -> Result<Vec<AreaShape>, GeoJsonError> {
    check_crs(whole, frame)?;
    let features = match whole["type"].as_str() {
        Some("FeatureCollection") => whole["features"].as_array().ok_or(GeoJsonError::NoFeatures)?,
        Some("Feature") => std::slice::from_ref(whole),
        _ => return Err(GeoJsonError::other_type(whole, "a FeatureCollection or a Feature")),
    };
    let areas = |(i, feature): (usize, &Value)| areas_of_feature(feature, frame).map_err(|error| error.of_feature(i));
    let features: Vec<_> = features.iter().enumerate().filter(|(_, feature)| !is_empty(&feature["geometry"])).collect();
    if features.is_empty() {
        return Err(GeoJsonError::NoArea);
    }
    let areas: Vec<Vec<AreaShape>> = features.into_iter().map(areas).collect::<Result<_, _>>()?;
    Ok(areas.concat())
}

fn areas_of_feature(feature: &Value, frame: CoordinateFrame) -> Result<Vec<AreaShape>, GeoJsonError> {
    let weight = property(feature, "weight");
    let weight = weight.and_then(Value::as_f64).ok_or(match (weight, property(feature, "role")) {
        (None, Some(role)) if !role.is_null() => GeoJsonError::RoleWithoutWeight,
        _ => GeoJsonError::NoWeight,
    });
    let polygons = polygons_of(&feature["geometry"], "a Polygon or a MultiPolygon")?;
    let area = |polygon: &Value| Ok(AreaShape { outline: outline(polygon, frame)?, weight: weight.clone()? });
    polygons.into_iter().map(area).collect()
}

/// A property of a feature. Shapefiles and some editors change the case of names.
fn property<'a>(feature: &'a Value, name: &str) -> Option<&'a Value> {
    let properties = feature["properties"].as_object()?;
    properties.iter().find(|(other, _)| other.eq_ignore_ascii_case(name)).map(|(_, value)| value)
}

/// The polygons of a geometry; another one is refused with what is `expected`.
fn polygons_of<'a>(geometry: &'a Value, expected: &'static str) -> Result<Vec<&'a Value>, GeoJsonError> {
    let coordinates = &geometry["coordinates"];
    match geometry["type"].as_str() {
        Some("Polygon") => Ok(vec![coordinates]),
        Some("MultiPolygon") => Ok(coordinates.as_array().ok_or(GeoJsonError::NoCoordinates)?.iter().collect()),
        other => {
            let found = other.unwrap_or("null").to_owned();
            Err(GeoJsonError::NotAllowed { member: "geometry", found, expected })
        }
    }
}

/// Whether a feature has no place: its geometry is null or has no coordinates.
fn is_empty(geometry: &Value) -> bool {
    fn has_no_place(coordinates: &Value) -> bool {
        coordinates.as_array().is_some_and(|parts| parts.iter().all(has_no_place))
    }
    geometry.is_null() || has_no_place(&geometry["coordinates"])
}

/// Refuses degrees of another datum: the same numbers lie a hundred metres off. The member `crs` is of GeoJSON before RFC 7946; it may be
/// that of the file, of a feature or of a geometry.
fn check_crs(whole: &Value, frame: CoordinateFrame) -> Result<(), GeoJsonError> {
    if matches!(frame, CoordinateFrame::Metres) {
        return Ok(());
    }
    let features = whole["features"].as_array().map_or(&[][..], Vec::as_slice);
    let all = std::iter::once(whole).chain(features).flat_map(|part| [&part["crs"], &part["geometry"]["crs"]]);
    all.filter(|crs| !crs.is_null()).try_for_each(check_wgs84)
}

fn check_wgs84(crs: &Value) -> Result<(), GeoJsonError> {
    let name = crs["properties"]["name"].as_str().map_or_else(|| crs.to_string(), str::to_owned);
    let code = name.rsplit([':', '/']).next().unwrap_or_default();
    let is_wgs84 = matches!(code, "CRS84" | "CRS84h" | "WGS84")
        || matches!(code, "4326" | "4979") && name.to_ascii_uppercase().contains("EPSG");
    if is_wgs84 { Ok(()) } else { Err(GeoJsonError::Crs(name)) }
}

fn shapes_of(whole: &Value, frame: CoordinateFrame) -> Result<FenceShapes, GeoJsonError> {
    check_crs(whole, frame)?;
    let mut order = FenceShapes::default();
    match whole["type"].as_str() {
        Some("FeatureCollection") => {
            let features = whole["features"].as_array().ok_or(GeoJsonError::NoFeatures)?;
            let is_drawn = |feature: &&Value| !is_empty(&feature["geometry"]);
            let drawn: Vec<_> = features.iter().filter(is_drawn).map(role).collect();
            // Of the fence and of the return point there is one, so an empty one beside it is none; an area to stay out of may be
            // the second one.
            let is_spare = |feature: &Value| match role(feature) {
                Ok(Some(FeatureRole::KeepOut) | None) | Err(_) => false,
                Ok(role) => is_empty(&feature["geometry"]) && drawn.contains(&Ok(role)),
            };
            for (i, feature) in features.iter().enumerate().filter(|(_, feature)| !is_spare(feature)) {
                add(&mut order, feature, frame).map_err(|error| error.of_feature(i))?;
            }
        }
        Some("Feature") => add(&mut order, whole, frame)?,
        Some("Polygon" | "MultiPolygon") => add(&mut order, &serde_json::json!({ "geometry": whole }), frame)?,
        Some("Point") => {
            let feature = serde_json::json!({ "properties": { "role": "return_point" }, "geometry": whole });
            add(&mut order, &feature, frame)?;
        }
        _ => {
            let expected = "a FeatureCollection, a Feature, or a geometry: Polygon, MultiPolygon, Point";
            return Err(GeoJsonError::other_type(whole, expected));
        }
    }
    if order == FenceShapes::default() { Err(GeoJsonError::NoShape) } else { Ok(order) }
}

/// Adds a feature to the order.
fn add(order: &mut FenceShapes, feature: &Value, frame: CoordinateFrame) -> Result<(), GeoJsonError> {
    let geometry = &feature["geometry"];
    if is_empty(geometry) {
        return match role(feature) {
            Ok(Some(role)) => Err(GeoJsonError::NoGeometry(role)),
            Ok(None) | Err(_) => Ok(()),
        };
    }
    let role = role(feature)?;
    if role.is_none() && property(feature, "weight").is_some_and(Value::is_number) {
        return Err(GeoJsonError::WeightInFence);
    }
    if geometry["type"] == "Point" && role.is_none() {
        return Err(GeoJsonError::PointWithoutRole);
    }
    if geometry["type"] == "Point" && role == Some(FeatureRole::ReturnPoint) {
        let at = place(&geometry["coordinates"], frame)?;
        return match order.return_point.replace(at) {
            None => Ok(()),
            Some(_) => Err(GeoJsonError::SecondReturnPoint),
        };
    }
    for polygon in polygons_of(geometry, "a Polygon, or a Point for the return point")? {
        let outline = outline(polygon, frame)?;
        match role {
            Some(FeatureRole::KeepOut) => order.keep_outs.push(outline),
            Some(FeatureRole::ReturnPoint) => return Err(GeoJsonError::ReturnPolygon),
            Some(FeatureRole::Fence) | None if order.fence.is_none() => order.fence = Some(outline),
            Some(FeatureRole::Fence) | None => return Err(GeoJsonError::SecondFence),
        }
    }
    Ok(())
}

fn role(feature: &Value) -> Result<Option<FeatureRole>, GeoJsonError> {
    let role = match property(feature, "role") {
        None | Some(Value::Null) => return Ok(None),
        Some(role) => role,
    };
    match role.as_str().map(str::to_ascii_lowercase).as_deref() {
        Some("") => Ok(None),
        Some("fence") => Ok(Some(FeatureRole::Fence)),
        Some("keep_out") => Ok(Some(FeatureRole::KeepOut)),
        Some("return_point") => Ok(Some(FeatureRole::ReturnPoint)),
        _ => {
            let expected = "fence, keep_out or return_point";
            Err(GeoJsonError::NotAllowed { member: "role", found: role.to_string(), expected })
        }
    }
}

/// The corners of a polygon, without the last corner, which repeats the first.
fn outline(polygon: &Value, frame: CoordinateFrame) -> Result<Vec<[f64; 2]>, GeoJsonError> {
    let rings = polygon.as_array().ok_or(GeoJsonError::NoCoordinates)?;
    let [ring] = &rings[..] else { return Err(GeoJsonError::Holes(rings.len().saturating_sub(1))) };
    let corners = ring.as_array().ok_or(GeoJsonError::NoCorners)?;
    let mut corners: Vec<[f64; 2]> = corners.iter().map(|corner| place(corner, frame)).collect::<Result<_, _>>()?;
    // Programs that project the corners may close the outline with a small error.
    if let [[x, y], .., [last_x, last_y]] = corners[..]
        && (last_x - x).hypot(last_y - y) < SAME_M
    {
        corners.pop();
    }
    Ok(corners)
}

fn place(at: &Value, frame: CoordinateFrame) -> Result<[f64; 2], GeoJsonError> {
    let (x, y) = at[0].as_f64().zip(at[1].as_f64()).ok_or_else(|| GeoJsonError::NoPlace(at.clone()))?;
    match frame {
        CoordinateFrame::Metres if x.hypot(y) <= MAX_DISTANCE_M => Ok([x, y]),
        CoordinateFrame::Metres => Err(GeoJsonError::FarMetres { x, y }),
        CoordinateFrame::Wgs84(plane) => {
            // A shape across 180 degrees may have longitudes beyond.
            let turned = if (180.0..=360.0).contains(&x.abs()) { x - 360.0 * x.signum() } else { x };
            let place = LatLon::new(y, turned).ok_or(GeoJsonError::NoDegrees { x, y })?;
            let far_m = plane.distance_m(place);
            if far_m > MAX_DISTANCE_M {
                return Err(GeoJsonError::FarDegrees { x, y, far_m, origin: plane.origin() });
            }
            let (x, y) = plane.to_plane(place);
            Ok([x, y])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: &str, frame: CoordinateFrame) -> Result<FenceShapes, String> {
        shapes_of(&serde_json::from_str(json).unwrap(), frame).map_err(|error| error.to_string())
    }

    fn areas_in(json: &str, frame: CoordinateFrame) -> Result<Vec<AreaShape>, String> {
        areas_of(&serde_json::from_str(json).unwrap(), frame).map_err(|error| error.to_string())
    }

    const SQUARE: &str = r#"{"type": "Polygon", "coordinates": [[[0, 0], [90, 0], [90, 60], [0, 60], [0, 0]]]}"#;

    #[test]
    fn features_become_fence_keep_outs_and_return_point() {
        let keep_out = r#"{"type": "MultiPolygon", "coordinates": [[[[1, 1], [2, 1], [2, 2], [1, 1]]]]}"#;
        let json = format!(
            r#"{{"type": "FeatureCollection", "features": [
                {{"type": "Feature", "properties": {{"role": "keep_out"}}, "geometry": {keep_out}}},
                {{"type": "Feature", "properties": {{"id": 3}}, "geometry": {SQUARE}}},
                {{"type": "Feature", "properties": {{"role": "return_point"}}, "geometry": {{"type": "Point", "coordinates": [5, 6, -3]}}}}]}}"#
        );
        let order = read(&json, CoordinateFrame::Metres).unwrap();
        assert_eq!(order.fence, Some(vec![[0.0, 0.0], [90.0, 0.0], [90.0, 60.0], [0.0, 60.0]]));
        assert_eq!(order.keep_outs, [vec![[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]]);
        assert_eq!(order.return_point, Some([5.0, 6.0]));
        assert_eq!(read(SQUARE, CoordinateFrame::Metres).unwrap().fence, order.fence);
    }

    #[test]
    fn polygons_with_a_weight_become_areas() {
        let areas = |json: &str| areas_in(json, CoordinateFrame::Metres);
        let feature = format!(r#"{{"type": "Feature", "properties": {{"weight": -0.5}}, "geometry": {SQUARE}}}"#);
        let outline = vec![[0.0, 0.0], [90.0, 0.0], [90.0, 60.0], [0.0, 60.0]];
        let order = vec![AreaShape { outline, weight: -0.5 }];
        assert_eq!(areas(&feature), Ok(order.clone()));
        assert_eq!(areas(&feature.replace("weight", "Weight")), Ok(order.clone()));
        let as_fence = read(&feature, CoordinateFrame::Metres).unwrap_err();
        assert!(as_fence.contains("scenecast ctl areas"), "{as_fence}");
        let fence = feature.replace(r#""weight": -0.5"#, r#""role": "fence""#);
        assert!(areas(&fence).unwrap_err().contains("scenecast ctl fence"));
        let list = format!(r#"{{"type": "FeatureCollection", "features": [{feature}]}}"#);
        assert_eq!(areas(&list), Ok(order));
        let refused =
            |feature: &str| areas(&format!(r#"{{"type": "FeatureCollection", "features": [{feature}]}}"#)).unwrap_err();
        assert_eq!(refused(&feature.replace("-0.5", "null")), "features[0]: the property weight is not a number");
        let point = r#"{"properties": {"weight": 1}, "geometry": {"type": "Point", "coordinates": [1, 2]}}"#;
        assert_eq!(refused(point), "features[0]: geometry Point: expected a Polygon or a MultiPolygon");
        let both = list.replace("\"Polygon\"", "\"MultiPolygon\"").replace("[[[", "[[[[").replace("]]]", "]]]]");
        assert_eq!(areas(&both).unwrap().len(), 1);
    }

    #[test]
    fn degrees_become_metres_about_the_origin() {
        let plane = TangentPlane::new(LatLon::new(29.5, 34.9).unwrap());
        let corner = |x, y| plane.to_place(x, y);
        let [a, b, c] = [corner(0.0, 0.0), corner(1000.0, 0.0), corner(1000.0, 500.0)];
        let at = |p: LatLon| format!("[{}, {}]", p.lon_deg, p.lat_deg);
        let json = format!(r#"{{"type": "Polygon", "coordinates": [[{}, {}, {}, {}]]}}"#, at(a), at(b), at(c), at(a));
        let fence = read(&json, CoordinateFrame::Wgs84(plane)).unwrap().fence.unwrap();
        for (is, ought) in fence.iter().zip([[0.0, 0.0], [1000.0, 0.0], [1000.0, 500.0]]) {
            assert!((is[0] - ought[0]).hypot(is[1] - ought[1]) < 0.001, "{is:?} instead of {ought:?}");
        }
        assert!(
            read(SQUARE.replace("60", "600").as_str(), CoordinateFrame::Wgs84(plane)).unwrap_err().contains("--metres")
        );
    }

    #[test]
    fn only_degrees_of_wgs_84_are_read() {
        let frame = CoordinateFrame::Wgs84(TangentPlane::new(LatLon::new(0.0, 0.0).unwrap()));
        let near = SQUARE.replace("90", "0.2").replace("60", "0.1");
        let with_crs = |crs: &str| read(&near.replacen('{', &format!("{{\"crs\": {crs}, "), 1), frame);
        let named = |name: &str| with_crs(&format!(r#"{{"type": "name", "properties": {{"name": "{name}"}}}}"#));
        for name in [
            "urn:ogc:def:crs:OGC:1.3:CRS84",
            "EPSG:4326",
            "urn:ogc:def:crs:EPSG::4326",
            "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
            "urn:ogc:def:crs:OGC::CRS84h",
            "urn:ogc:def:crs:EPSG::4979",
        ] {
            assert!(named(name).is_ok(), "{name}");
        }
        assert!(with_crs("null").is_ok());
        let crs = r#"{"crs": {"properties": {"name": "EPSG:25832"}}, "#;
        let of_geometry = near.replacen('{', crs, 1);
        for feature in [
            format!(r#"{{"type": "Feature", "geometry": {of_geometry}}}"#),
            format!(r#"{crs} "type": "Feature", "geometry": {near}}}"#),
        ] {
            let file = format!(r#"{{"type": "FeatureCollection", "features": [{feature}]}}"#);
            assert!(read(&file, frame).unwrap_err().contains("crs EPSG:25832"));
        }
        for name in ["urn:ogc:def:crs:EPSG::4230", "EPSG:32632", "EPSG:14326", "ESRI:4326"] {
            let error = named(name).unwrap_err();
            assert!(error.contains(name) && error.contains("ogr2ogr -t_srs EPSG:4326"), "{error}");
        }
        assert!(with_crs(r#"{"type": "link", "properties": {"href": "x.prj"}}"#).unwrap_err().contains("x.prj"));
        let areas = near.replacen('{', r#"{"crs": {"properties": {"name": "EPSG:4230"}}, "#, 1);
        assert!(areas_in(&areas, frame).unwrap_err().contains("EPSG:4230"));
    }

    #[test]
    fn a_fence_is_read_despite_peculiarities_of_editors() {
        let plain = format!(r#"{{"geometry": {SQUARE}}}"#);
        let null = r#"{"type": "Feature", "properties": {}, "geometry": null}"#;
        let empty = r#"{"geometry": {"type": "Polygon", "coordinates": []}}"#;
        let without = r#"{"properties": {"role": "camp"}, "geometry": {"type": "Polygon", "coordinates": [[]]}}"#;
        let blank = plain.replacen('{', r#"{"properties": {"role": ""}, "#, 1);
        let json = format!(r#"{{"type": "FeatureCollection", "features": [{null}, {blank}, {empty}, {without}]}}"#);
        let fence = read(&json, CoordinateFrame::Metres).unwrap().fence;
        assert_eq!(fence.unwrap().len(), 4);
        let nearly = SQUARE.replace("[0, 60], [0, 0]", "[0, 60], [1e-9, 0]");
        assert_eq!(read(&nearly, CoordinateFrame::Metres).unwrap().fence.unwrap().len(), 4);
        let file = std::env::temp_dir().join(format!("scenecast-{}-bom.geojson", std::process::id()));
        std::fs::write(&file, format!("\u{FEFF}{SQUARE}")).unwrap();
        assert!(read_fence(&file, CoordinateFrame::Metres).is_ok());
        std::fs::write(&file, b"\xFF\xFE{\0").unwrap();
        assert!(read_fence(&file, CoordinateFrame::Metres).unwrap_err().to_string().contains("UTF-16"));
        std::fs::remove_file(file).unwrap();
    }

    #[test]
    fn the_case_of_a_role_does_not_matter() {
        let keep_out = format!(r#"{{"type": "Feature", "properties": {{"ROLE": "Keep_Out"}}, "geometry": {SQUARE}}}"#);
        let order = read(&keep_out, CoordinateFrame::Metres).unwrap();
        assert!(order.fence.is_none() && order.keep_outs.len() == 1);
    }

    #[test]
    fn a_fence_may_cross_the_meridian_of_180_degrees() {
        let frame = CoordinateFrame::Wgs84(TangentPlane::new(LatLon::new(-16.85, 179.9995).unwrap()));
        let fence = |east: f64| {
            let json = format!(
                r#"{{"type": "Polygon", "coordinates": [[[179.999, -16.86], [{east}, -16.86], [{east}, -16.85], [179.999, -16.86]]]}}"#
            );
            read(&json, frame).unwrap().fence.unwrap()
        };
        let (signed, beyond) = (fence(-179.999), fence(180.001));
        for (a, b) in signed.iter().zip(&beyond) {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6 && a[0].abs() < 200.0, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_fence_far_from_the_origin_is_refused_with_its_distance() {
        let plane = TangentPlane::new(LatLon::new(29.5, 34.9).unwrap());
        let refused = |lon: f64, lat: f64| {
            let json = format!(r#"{{"type": "Point", "coordinates": [{lon}, {lat}]}}"#);
            read(&json, CoordinateFrame::Wgs84(plane)).unwrap_err()
        };
        assert!(refused(34.9, 31.0).contains("166 km from the mission's origin"), "{}", refused(34.9, 31.0));
        assert!(refused(-145.1, -29.5).contains("127"), "the antipode: {}", refused(-145.1, -29.5));
        // Latitude and longitude in the wrong order.
        assert!(refused(29.5, 34.9).contains("expected longitude, latitude"));
        let metres = read(r#"{"type": "Point", "coordinates": [100001, 0]}"#, CoordinateFrame::Metres);
        assert!(metres.unwrap_err().contains("more than 100 km"));
    }

    #[test]
    fn a_faulty_file_is_refused_with_the_place_of_the_fault() {
        let refused = |json: &str| read(json, CoordinateFrame::Metres).unwrap_err();
        let in_list = |feature: &str| refused(&format!(r#"{{"type": "FeatureCollection", "features": [{feature}]}}"#));
        assert!(refused("[]").contains("FeatureCollection"));
        assert!(refused(r#"{"type": "FeatureCollection", "features": []}"#).contains("neither polygon nor point"));
        let hole = r#"{"type": "Polygon", "coordinates": [[[0,0],[9,0],[9,9],[0,0]], [[1,1],[2,1],[2,2],[1,1]]]}"#;
        assert!(refused(hole).contains("keep_out"));
        let line = r#"{"geometry": {"type": "LineString", "coordinates": [[0,0],[9,0]]}}"#;
        assert_eq!(
            in_list(line),
            "features[0]: geometry LineString: expected a Polygon, or a Point for the return point"
        );
        let role = format!(r#"{{"properties": {{"role": "wall"}}, "geometry": {SQUARE}}}"#);
        assert!(in_list(&role).contains("keep_out or return_point"));
        let wreck = r#"{"properties": {"name": "wreck"}, "geometry": {"type": "Point", "coordinates": [1, 2]}}"#;
        assert!(in_list(wreck).contains("give the return point the property role = return_point"));
        let nowhere = r#"{"properties": {"role": "keep_out"}, "geometry": null}"#;
        assert_eq!(in_list(nowhere), "features[0]: it has role = keep_out and no geometry: draw it, or leave it out");
        let drawn = format!(r#"{{"properties": {{"role": "fence"}}, "geometry": {SQUARE}}}"#);
        let empty = r#"{"properties": {"role": "fence"}, "geometry": null}"#;
        assert!(in_list(empty).contains("role = fence and no geometry"));
        let both = format!(r#"{{"type": "FeatureCollection", "features": [{empty}, {drawn}]}}"#);
        assert!(read(&both, CoordinateFrame::Metres).is_ok());
        let plain = format!(r#"{{"geometry": {SQUARE}}}"#);
        assert!(in_list(&format!("{plain}, {plain}")).contains("features[1]: a second fence"));
        assert!(
            in_list(r#"{"geometry": {"type": "Polygon", "coordinates": [[["a", 0]]]}}"#).contains("is not a place")
        );
    }
}
