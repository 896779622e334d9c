//! A fence from a GeoJSON file (RFC 7946), as a GIS writes it.

use scenecast_core::UserError;
use scenecast_core::{LatLon, TangentPlane};
use scenecast_surface::FenceOrder;
use serde_json::Value;
use std::path::Path;

/// Longest file that is read.
const MOST_BYTES: u64 = 1 << 20;

/// What the coordinates of a file are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Frame {
    /// Metres east and north of the mission's origin.
    Metres,
    /// Longitude and latitude, WGS 84, about that origin.
    Wgs84(TangentPlane),
}

/// What an outline or point of a file is meant to be: the property `role` of its feature.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    Fence,
    KeepOut,
    ReturnPoint,
}

/// Reads fence, keep-outs and return point.
pub(super) fn read_fence(file: &Path, frame: Frame) -> Result<FenceOrder, UserError> {
    let problem = |what: String| UserError::file(file, what);
    let size = std::fs::metadata(file).map_err(|e| problem(e.to_string()))?.len();
    if size > MOST_BYTES {
        return Err(problem(format!("it has {size} bytes: at most {MOST_BYTES} are read")));
    }
    let text = std::fs::read(file).map_err(|e| problem(e.to_string()))?;
    let whole: Value = serde_json::from_slice(&text).map_err(|e| problem(format!("it is no JSON: {e}")))?;
    let order = fence_of(&whole, frame).map_err(problem)?;
    order.read().map_err(problem)?;
    Ok(order)
}

fn fence_of(whole: &Value, frame: Frame) -> Result<FenceOrder, String> {
    let mut order = FenceOrder::default();
    match whole["type"].as_str() {
        Some("FeatureCollection") => {
            let features = whole["features"].as_array().ok_or("the collection has no list of features")?;
            for (i, feature) in features.iter().enumerate() {
                take(&mut order, feature, frame).map_err(|why| format!("features[{i}]: {why}"))?;
            }
        }
        Some("Feature") => take(&mut order, whole, frame)?,
        Some("Polygon" | "MultiPolygon" | "Point") => {
            take(&mut order, &serde_json::json!({ "geometry": whole }), frame)?;
        }
        other => return Err(format!("type {}: it takes a FeatureCollection", other.unwrap_or("is missing"))),
    }
    if order == FenceOrder::default() {
        return Err("there is neither polygon nor point in it".to_owned());
    }
    Ok(order)
}

/// Takes a feature into the order.
fn take(order: &mut FenceOrder, feature: &Value, frame: Frame) -> Result<(), String> {
    let (geometry, role) = (&feature["geometry"], role(feature)?);
    let coordinates = &geometry["coordinates"];
    let rings: Vec<&Value> = match geometry["type"].as_str() {
        Some("Point") if matches!(role, None | Some(Role::ReturnPoint)) => {
            let at = place(coordinates, frame)?;
            return match order.return_point.replace(at) {
                None => Ok(()),
                Some(_) => Err("a second return point".to_owned()),
            };
        }
        Some("Polygon") => vec![coordinates],
        Some("MultiPolygon") => coordinates.as_array().ok_or("coordinates are missing")?.iter().collect(),
        other => {
            let other = other.unwrap_or("null");
            return Err(format!("geometry {other}: it takes a Polygon, or a Point for the return point"));
        }
    };
    for polygon in rings {
        let outline = outline(polygon, frame)?;
        match role {
            Some(Role::KeepOut) => order.keep_outs.push(outline),
            Some(Role::ReturnPoint) => return Err("the return point is a Point".to_owned()),
            Some(Role::Fence) | None if order.fence.is_none() => order.fence = Some(outline),
            Some(Role::Fence) | None => {
                return Err("a second fence: give what to stay outside of the property role = keep_out".to_owned());
            }
        }
    }
    Ok(())
}

fn role(feature: &Value) -> Result<Option<Role>, String> {
    match &feature["properties"]["role"] {
        Value::Null => Ok(None),
        Value::String(s) if s == "fence" => Ok(Some(Role::Fence)),
        Value::String(s) if s == "keep_out" => Ok(Some(Role::KeepOut)),
        Value::String(s) if s == "return_point" => Ok(Some(Role::ReturnPoint)),
        other => Err(format!("role {other}: it takes fence, keep_out or return_point")),
    }
}

/// The corners of a polygon without the last, which is the first again.
fn outline(polygon: &Value, frame: Frame) -> Result<Vec<[f64; 2]>, String> {
    let rings = polygon.as_array().ok_or("coordinates are missing")?;
    let [ring] = &rings[..] else {
        return Err(format!("{} holes: draw each as a polygon with role = keep_out", rings.len().saturating_sub(1)));
    };
    let corners = ring.as_array().ok_or("the outline is no list of corners")?;
    let mut corners: Vec<&Value> = corners.iter().collect();
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    corners.into_iter().map(|corner| place(corner, frame)).collect()
}

fn place(at: &Value, frame: Frame) -> Result<[f64; 2], String> {
    let (x, y) = at[0].as_f64().zip(at[1].as_f64()).ok_or(format!("{at} is no place"))?;
    match frame {
        Frame::Metres => Ok([x, y]),
        Frame::Wgs84(plane) => {
            let place = LatLon::new(y, x).ok_or(format!(
                "[{x}, {y}] is no longitude and latitude; --metres takes metres east and north of the origin"
            ))?;
            let (x, y) = plane.to_plane(place);
            Ok([x, y])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: &str, frame: Frame) -> Result<FenceOrder, String> {
        fence_of(&serde_json::from_str(json).unwrap(), frame)
    }

    const SQUARE: &str = r#"{"type": "Polygon", "coordinates": [[[0, 0], [90, 0], [90, 60], [0, 60], [0, 0]]]}"#;

    #[test]
    fn features_become_fence_keep_outs_and_return_point() {
        let keep_out = r#"{"type": "MultiPolygon", "coordinates": [[[[1, 1], [2, 1], [2, 2], [1, 1]]]]}"#;
        let json = format!(
            r#"{{"type": "FeatureCollection", "features": [
                {{"type": "Feature", "properties": {{"role": "keep_out"}}, "geometry": {keep_out}}},
                {{"type": "Feature", "properties": {{"id": 3}}, "geometry": {SQUARE}}},
                {{"type": "Feature", "properties": null, "geometry": {{"type": "Point", "coordinates": [5, 6, -3]}}}}]}}"#
        );
        let order = read(&json, Frame::Metres).unwrap();
        assert_eq!(order.fence, Some(vec![[0.0, 0.0], [90.0, 0.0], [90.0, 60.0], [0.0, 60.0]]));
        assert_eq!(order.keep_outs, [vec![[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]]);
        assert_eq!(order.return_point, Some([5.0, 6.0]));
        assert_eq!(read(SQUARE, Frame::Metres).unwrap().fence, order.fence);
    }

    #[test]
    fn degrees_become_metres_about_the_origin() {
        let plane = TangentPlane::new(LatLon::new(29.5, 34.9).unwrap());
        let corner = |x, y| plane.to_place(x, y);
        let [a, b, c] = [corner(0.0, 0.0), corner(1000.0, 0.0), corner(1000.0, 500.0)];
        let at = |p: LatLon| format!("[{}, {}]", p.lon_deg, p.lat_deg);
        let json = format!(r#"{{"type": "Polygon", "coordinates": [[{}, {}, {}, {}]]}}"#, at(a), at(b), at(c), at(a));
        let fence = read(&json, Frame::Wgs84(plane)).unwrap().fence.unwrap();
        for (is, ought) in fence.iter().zip([[0.0, 0.0], [1000.0, 0.0], [1000.0, 500.0]]) {
            assert!((is[0] - ought[0]).hypot(is[1] - ought[1]) < 0.001, "{is:?} instead of {ought:?}");
        }
        assert!(read(SQUARE.replace("60", "600").as_str(), Frame::Wgs84(plane)).unwrap_err().contains("--metres"));
    }

    #[test]
    fn what_is_no_fence_is_refused_with_its_place_and_what_it_takes() {
        let refused = |json: &str| read(json, Frame::Metres).unwrap_err();
        let in_list = |feature: &str| refused(&format!(r#"{{"type": "FeatureCollection", "features": [{feature}]}}"#));
        assert!(refused("[]").contains("FeatureCollection"));
        assert!(refused(r#"{"type": "FeatureCollection", "features": []}"#).contains("neither polygon nor point"));
        let hole = r#"{"type": "Polygon", "coordinates": [[[0,0],[9,0],[9,9],[0,0]], [[1,1],[2,1],[2,2],[1,1]]]}"#;
        assert!(refused(hole).contains("keep_out"));
        let line = r#"{"geometry": {"type": "LineString", "coordinates": [[0,0],[9,0]]}}"#;
        assert_eq!(
            in_list(line),
            "features[0]: geometry LineString: it takes a Polygon, or a Point for the return point"
        );
        let role = format!(r#"{{"properties": {{"role": "wall"}}, "geometry": {SQUARE}}}"#);
        assert!(in_list(&role).contains("keep_out or return_point"));
        let plain = format!(r#"{{"geometry": {SQUARE}}}"#);
        assert!(in_list(&format!("{plain}, {plain}")).contains("features[1]: a second fence"));
        assert!(in_list(r#"{"geometry": {"type": "Polygon", "coordinates": [[["a", 0]]]}}"#).contains("is no place"));
    }
}
