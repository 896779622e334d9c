//! World files, which georeference an image for geographic information systems.

use crate::geodesy::TangentPlane;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::map::Rect;
use scenecast_protocol::wire::Placement;

/// The six lines of an ESRI world file for a picture of `bounds`, north up, a pixel a cell; degrees of WGS-84 (EPSG:4326).
///
/// Source: ESRI, "World files for raster datasets": pixel width, two rotations, pixel height,
/// middle of the north-west pixel.
pub fn world_file(plane: &TangentPlane, placement: Option<Placement>, bounds: Rect, cell_m: f64) -> String {
    let world = |column: f64, row: f64| {
        let x_m = (f64::from(bounds.x) + column) * cell_m;
        let y_m = (f64::from(bounds.y) + f64::from(bounds.height) - row) * cell_m;
        let (east, north) = Placement::map_to_world(placement, MapPoint { x_m, y_m }).xy();
        plane.to_place(east, north)
    };
    let (width, height) = (f64::from(bounds.width), f64::from(bounds.height));
    let (corner, right, down) = (world(0.5, 0.5), world(0.5 + width, 0.5), world(0.5, 0.5 + height));
    // The picture may lie across 180 degrees.
    let east_of = |lon_deg: f64| (lon_deg - corner.lon_deg + 540.0).rem_euclid(360.0) - 180.0;
    let lines = [
        east_of(right.lon_deg) / width,
        (right.lat_deg - corner.lat_deg) / width,
        east_of(down.lon_deg) / height,
        (down.lat_deg - corner.lat_deg) / height,
        corner.lon_deg,
        corner.lat_deg,
    ];
    lines.iter().map(|v| format!("{v:.12}\n")).collect()
}

/// The `.aux.xml` file in which GDAL and QGIS look for the coordinate system of such a picture: degrees of WGS 84.
pub const WGS84_AUX_XML: &str = "<PAMDataset>\n  <SRS dataAxisToSRSAxisMapping=\"2,1\">GEOGCS[&quot;WGS 84&quot;,\
    DATUM[&quot;WGS_1984&quot;,SPHEROID[&quot;WGS 84&quot;,6378137,298.257223563,AUTHORITY[&quot;EPSG&quot;,&quot;7030&quot;]],\
    AUTHORITY[&quot;EPSG&quot;,&quot;6326&quot;]],PRIMEM[&quot;Greenwich&quot;,0],UNIT[&quot;degree&quot;,0.0174532925199433],\
    AXIS[&quot;Latitude&quot;,NORTH],AXIS[&quot;Longitude&quot;,EAST],AUTHORITY[&quot;EPSG&quot;,&quot;4326&quot;]]</SRS>\n</PAMDataset>\n";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesy::LatLon;
    use scenecast_protocol::coordinates::WorldPoint;

    #[test]
    fn a_picture_across_180_degrees_has_pixels_as_wide_as_elsewhere() {
        let width = |lon_deg: f64| {
            let plane = TangentPlane::new(LatLon::new(-16.85, lon_deg).unwrap());
            let text = world_file(&plane, None, Rect { x: 0, y: 0, width: 400, height: 60 }, 0.5);
            text.lines().next().unwrap().parse::<f64>().unwrap()
        };
        assert!(
            (width(179.9995) - width(10.0)).abs() < 1e-9 && (width(10.0) - 4.7e-6).abs() < 1e-7,
            "{}",
            width(179.9995)
        );
    }

    #[test]
    fn a_pixel_of_the_picture_lies_where_its_cell_does() {
        let plane = TangentPlane::new(LatLon::new(29.5, 34.92).unwrap());
        let bounds = Rect { x: -10, y: 20, width: 100, height: 60 };
        let placement = Placement { version: 1, origin: WorldPoint::new(3.0, -2.0) };
        let text = world_file(&plane, Some(placement), bounds, 0.5);
        let v: Vec<f64> = text.lines().map(|l| l.parse().unwrap()).collect();
        // Column 40, row 10 from the north is cell (30, 69).
        let (column, row) = (40.0, 10.0);
        let place = LatLon::new(v[1] * column + v[3] * row + v[5], v[0] * column + v[2] * row + v[4]).unwrap();
        let (x, y) = plane.to_plane(place);
        assert!((x - (30.5 * 0.5 + 3.0)).abs() < 0.01 && (y - (69.5 * 0.5 - 2.0)).abs() < 0.01, "{x} {y}");
    }
}
