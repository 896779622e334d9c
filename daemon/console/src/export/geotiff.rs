//! Tiled GeoTIFF with a palette, in the projection of the mission, in UTM or in WGS 84.
//!
//! Tags follow TIFF 6.0 and OGC GeoTIFF 1.1 (19-008r4). Tiles without an explored cell share the data of one empty tile, so
//! that the size of the file grows with the cells and not with their extent.

use super::ExportError;
use super::projection::TransverseMercator;
use super::tiff::Directory;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use scenecast_protocol::map::{Cell, REPLICA_TILE, Rect};
use scenecast_surface::state::Origin;
use scenecast_surface::{MapCaption, MapCells};
use std::collections::BTreeSet;
use std::io::Write;

/// Edge of a tile of the file in pixels.
pub(super) const TILE: u32 = 256;
/// The most tiles of a file; their table takes 8 bytes each.
pub(super) const MAX_TILES: u64 = 1 << 20;
/// Metres of one degree of latitude, for the size of a pixel in degrees.
const DEGREE_M: f64 = 111_320.0;

/// Nearer to a pole, a map of some kilometres may have all longitudes.
const WGS84_LAT_DEG: f64 = 89.0;

/// The coordinate reference system of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// Transverse Mercator about the origin of the mission: each pixel is a cell. Without an origin: metres alone.
    Mission,
    /// The UTM zone of the origin.
    Utm,
    Wgs84,
}

/// The pixels of a file: their size, the north-west corner of the first, and their number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Raster {
    pub(super) west: f64,
    pub(super) north: f64,
    pub(super) pixel: (f64, f64),
    pub(super) width: u32,
    pub(super) height: u32,
}

/// From the coordinates of a file to metres in the world frame, and back.
enum Places {
    Same,
    Projected(TransverseMercator, TransverseMercator),
    Degrees(TransverseMercator),
}

impl Places {
    fn to_file(&self, (x, y): (f64, f64)) -> (f64, f64) {
        match self {
            Self::Same => (x, y),
            Self::Projected(mission, utm) => {
                let (lon, lat) = mission.lon_lat(x, y);
                utm.metres(lon, lat)
            }
            Self::Degrees(mission) => mission.lon_lat(x, y),
        }
    }

    fn to_world(&self, (x, y): (f64, f64)) -> (f64, f64) {
        match self {
            Self::Same => (x, y),
            Self::Projected(mission, utm) => {
                let (lon, lat) = utm.lon_lat(x, y);
                mission.metres(lon, lat)
            }
            Self::Degrees(mission) => mission.metres(x, y),
        }
    }
}

/// The map as a GeoTIFF, pixel value = label, 0 = no data. In UTM and WGS 84, each pixel has the label of the cell at its centre.
/// The error is one line for people.
pub(super) fn geotiff(cells: &MapCells, origin: Option<Origin>, reference: Reference) -> Result<Vec<u8>, ExportError> {
    let (places, keys) = match (reference, origin) {
        (Reference::Mission, origin) => (Places::Same, origin.map(mission_keys).unwrap_or_default()),
        (_, None) => return Err(ExportError::NoOrigin),
        (Reference::Utm, Some(origin)) => {
            let zone = TransverseMercator::utm(origin);
            let (utm, epsg) = zone.ok_or(ExportError::OutsideUtm)?;
            (Places::Projected(TransverseMercator::about(origin), utm), utm_keys(epsg))
        }
        (Reference::Wgs84, Some(origin)) if origin.lat_deg.abs() > WGS84_LAT_DEG => {
            return Err(ExportError::AtPole);
        }
        (Reference::Wgs84, Some(origin)) => (Places::Degrees(TransverseMercator::about(origin)), wgs84_keys()),
    };
    let raster = raster(cells, origin, reference, &places)?;
    let tiles = touched_tiles(cells, &raster, &places);
    let pixels = |&tile: &(u32, u32)| tile_pixels(cells, &raster, &places, tile);
    let tiles = tiles.iter().map(|tile| (*tile, pixels(tile)));
    write(cells, &raster, &keys, tiles)
}

fn raster(
    cells: &MapCells,
    origin: Option<Origin>,
    reference: Reference,
    places: &Places,
) -> Result<Raster, ExportError> {
    let Rect { x, y, width, height } = cells.bounds.unwrap_or(Rect { x: 0, y: 0, width: 1, height: 1 });
    let (x, y) = (i64::from(x), i64::from(y));
    let size = cells.cell_m;
    let pixel = match (reference, origin) {
        (Reference::Wgs84, Some(o)) => (size / (DEGREE_M * o.lat_deg.to_radians().cos()), size / DEGREE_M),
        _ => (size, size),
    };
    if u64::from(width.div_ceil(TILE)) * u64::from(height.div_ceil(TILE)) > MAX_TILES {
        return Err(ExportError::ManyTiles { width, height });
    }
    let (x_end, y_end) = (x + i64::from(width), y + i64::from(height));
    if matches!(places, Places::Same) {
        let (west, north) = cells.corner_m(x, y_end);
        return Ok(Raster { west, north, pixel, width, height });
    }
    // The sides are nearly straight: corners and middles bound them to a pixel.
    let steps = |from: i64, to: i64| (0..=8).map(move |k| from + (to - from) * k / 8);
    let sides = steps(x, x_end).flat_map(|x| [(x, y), (x, y_end)]);
    let sides = sides.chain(steps(y, y_end).flat_map(|y| [(x, y), (x_end, y)]));
    let places: Vec<(f64, f64)> = sides.map(|(x, y)| places.to_file(cells.corner_m(x, y))).collect();
    let range = |of: fn(&(f64, f64)) -> f64| {
        let values = places.iter().map(of);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((west, east), (south, north)) = (range(|p| p.0), range(|p| p.1));
    let (columns, rows) = (((east - west) / pixel.0).ceil() + 2.0, ((north - south) / pixel.1).ceil() + 2.0);
    if !(columns * rows).is_finite() || columns * rows > MAX_TILES as f64 * f64::from(TILE * TILE) {
        return Err(ExportError::ManyTiles { width, height });
    }
    let (west, north) = (west - pixel.0, north + pixel.1);
    let west = match reference {
        Reference::Wgs84 if west < -180.0 || west + columns * pixel.0 > 180.0 => {
            // All of it beyond 180 degrees is on the other side; a file across it is none that others read.
            let turned = west - 360.0 * west.signum();
            if turned.abs() > 180.0 || (turned + columns * pixel.0).abs() > 180.0 {
                return Err(ExportError::AcrossDateLine);
            }
            turned
        }
        _ => west,
    };
    Ok(Raster { west, north, pixel, width: columns as u32, height: rows as u32 })
}

/// The tiles of the file, as row and column, that may have an explored cell.
fn touched_tiles(cells: &MapCells, raster: &Raster, places: &Places) -> BTreeSet<(u32, u32)> {
    let mut touched = BTreeSet::new();
    let last = (raster.height.saturating_sub(1) / TILE, raster.width.saturating_sub(1) / TILE);
    for &(row, column) in cells.tiles.keys() {
        let edge = i64::from(REPLICA_TILE);
        let (x, y) = (i64::from(column) * edge, i64::from(row) * edge);
        let corners = [(x, y), (x + edge, y), (x, y + edge), (x + edge, y + edge)];
        let at = corners.map(|(x, y)| {
            let (x, y) = places.to_file(cells.corner_m(x, y));
            ((raster.north - y) / raster.pixel.1, (x - raster.west) / raster.pixel.0)
        });
        let span = |of: fn(&(f64, f64)) -> f64, last: u32| {
            let (low, high) = at.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
            let tile = |pixel: f64| ((pixel / f64::from(TILE)).floor().max(0.0) as u32).min(last);
            tile(low - 1.0)..=tile(high + 1.0)
        };
        for tile_row in span(|p| p.0, last.0) {
            touched.extend(span(|p| p.1, last.1).map(|tile_column| (tile_row, tile_column)));
        }
    }
    touched
}

/// The labels of a tile, row by row from the north-west.
fn tile_pixels(cells: &MapCells, raster: &Raster, places: &Places, (row, column): (u32, u32)) -> Vec<u8> {
    let mut pixels = vec![0; (TILE * TILE) as usize];
    let edge = f64::from(TILE);
    let (west, north) = (
        raster.west + f64::from(column) * edge * raster.pixel.0,
        raster.north - f64::from(row) * edge * raster.pixel.1,
    );
    let (east, south) = (west + edge * raster.pixel.0, north - edge * raster.pixel.1);
    // Over one tile the coordinates are bilinear to less than a millimetre.
    let [nw, ne, sw, se] = [(west, north), (east, north), (west, south), (east, south)].map(|p| places.to_world(p));
    let between = |a: f64, b: f64, t: f64| a + (b - a) * t;
    for (line, out) in pixels.chunks_mut(TILE as usize).enumerate() {
        let down = (line as f64 + 0.5) / edge;
        let left = (between(nw.0, sw.0, down), between(nw.1, sw.1, down));
        let right = (between(ne.0, se.0, down), between(ne.1, se.1, down));
        for (at, pixel) in out.iter_mut().enumerate() {
            let across = (at as f64 + 0.5) / edge;
            let cell = |from: f64, to: f64, moved: f64| ((between(from, to, across) - moved) / cells.cell_m).floor();
            let (x, y) = (cell(left.0, right.0, cells.moved_m.0), cell(left.1, right.1, cells.moved_m.1));
            if let Some(label) = label(cells, x, y) {
                *pixel = label;
            }
        }
    }
    pixels
}

/// The label at a column and row; `None` beyond the bounds of the map.
fn label(cells: &MapCells, x: f64, y: f64) -> Option<u8> {
    let inside = |v: f64| (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&v);
    (inside(x) && inside(y)).then(|| cells.label(Cell::new(x as i32, y as i32)))
}

/// The geographic keys of a file: numbers, and the doubles that some of them refer to.
#[derive(Default)]
pub(super) struct GeoKeys {
    shorts: Vec<(u16, u16)>,
    doubles: Vec<(u16, f64)>,
    /// The name of the projection, in ASCII; empty for one with a number.
    citation: String,
}

const IMAGE_DESCRIPTION: u16 = 270;
const PIXEL_SCALE: u16 = 33_550;
const TIE_POINT: u16 = 33_922;
const GEO_KEYS: u16 = 34_735;
const GEO_DOUBLES: u16 = 34_736;
const GEO_TEXTS: u16 = 34_737;
const GDAL_METADATA: u16 = 42_112;
const GDAL_NODATA: u16 = 42_113;

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEODETIC_CRS: u16 = 2048;
const ANGULAR_UNITS: u16 = 2054;
const PROJECTED_CRS: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const PROJECTION: u16 = 3074;
const PROJECTION_METHOD: u16 = 3075;
const LINEAR_UNITS: u16 = 3076;
const ORIGIN_LON: u16 = 3080;
const ORIGIN_LAT: u16 = 3081;
const FALSE_EASTING: u16 = 3082;
const FALSE_NORTHING: u16 = 3083;
const ORIGIN_SCALE: u16 = 3092;
const USER_DEFINED: u16 = 32_767;
const WGS_84: u16 = 4326;
const METRE: u16 = 9001;
const DEGREE: u16 = 9102;

fn utm_keys(epsg: u16) -> GeoKeys {
    let shorts = vec![(MODEL_TYPE, 1), (RASTER_TYPE, 1), (PROJECTED_CRS, epsg), (LINEAR_UNITS, METRE)];
    GeoKeys { shorts, ..GeoKeys::default() }
}

fn wgs84_keys() -> GeoKeys {
    let shorts = vec![(MODEL_TYPE, 2), (RASTER_TYPE, 1), (GEODETIC_CRS, WGS_84), (ANGULAR_UNITS, DEGREE)];
    GeoKeys { shorts, ..GeoKeys::default() }
}

pub(super) fn mission_keys(origin: Origin) -> GeoKeys {
    let method =
        [(PROJECTED_CRS, USER_DEFINED), (PROJECTION, USER_DEFINED), (PROJECTION_METHOD, 1), (LINEAR_UNITS, METRE)];
    let place =
        [(ORIGIN_LON, origin.lon_deg), (ORIGIN_LAT, origin.lat_deg), (FALSE_EASTING, 0.0), (FALSE_NORTHING, 0.0)];
    let mut shorts = vec![(MODEL_TYPE, 1), (RASTER_TYPE, 1), (GEODETIC_CRS, WGS_84), (ANGULAR_UNITS, DEGREE)];
    shorts.extend(method);
    let mut doubles = place.to_vec();
    doubles.push((ORIGIN_SCALE, 1.0));
    let citation = format!("metres east and north of {} {}|", origin.lat_deg, origin.lon_deg);
    GeoKeys { shorts, doubles, citation }
}

impl GeoKeys {
    /// The directory of keys, each with its tag (0 = the value itself), count and value or index.
    fn directory(&self) -> Vec<u16> {
        let shorts = self.shorts.iter().map(|&(key, value)| [key, 0, 1, value]);
        let doubles = self.doubles.iter().zip(0u16..).map(|(&(key, _), at)| [key, GEO_DOUBLES, 1, at]);
        let citation = Some([PROJECTED_CITATION, GEO_TEXTS, self.citation.len() as u16, 0]);
        let citation = citation.filter(|_| !self.citation.is_empty());
        let mut keys: Vec<[u16; 4]> = shorts.chain(doubles).chain(citation).collect();
        keys.sort_unstable();
        [[1, 1, 0, keys.len() as u16]].into_iter().chain(keys).flatten().collect()
    }
}

fn write(
    cells: &MapCells,
    raster: &Raster,
    keys: &GeoKeys,
    tiles: impl Iterator<Item = ((u32, u32), Vec<u8>)>,
) -> Result<Vec<u8>, ExportError> {
    let columns = raster.width.div_ceil(TILE);
    let count = (columns * raster.height.div_ceil(TILE)) as usize;
    // Tiles without an explored cell share the first one.
    let mut data = deflate(&[0; (TILE * TILE) as usize])?;
    let mut places = vec![(0, data.len()); count];
    for ((row, column), pixels) in tiles {
        if pixels.iter().all(|&label| label == 0) {
            continue;
        }
        let tile = deflate(&pixels)?;
        if let Some(place) = places.get_mut((row * columns + column) as usize) {
            *place = (data.len(), tile.len());
            data.extend(tile);
        }
    }
    let mut directory = directory(cells, raster, keys);
    directory.tiles(TILE, &places)?;
    Ok([directory.bytes(), data].concat())
}

/// What the file says of itself.
fn directory(cells: &MapCells, raster: &Raster, keys: &GeoKeys) -> Directory {
    let mut directory = Directory::of_labels([raster.width, raster.height], |label| cells.book.class_colour(label));
    if let Some(caption) = &cells.caption {
        // The field has ASCII.
        let title = caption.title().replace(|c: char| !c.is_ascii(), "?");
        directory.text(IMAGE_DESCRIPTION, &format!("{title}, pixel value = label"));
    }
    locate(&mut directory, raster, keys);
    directory.text(GDAL_METADATA, &metadata(cells));
    directory.text(GDAL_NODATA, "0");
    directory
}

/// Where the pixels are.
pub(super) fn locate(directory: &mut Directory, raster: &Raster, keys: &GeoKeys) {
    directory.doubles(PIXEL_SCALE, &[raster.pixel.0, raster.pixel.1, 0.0]);
    directory.doubles(TIE_POINT, &[0.0, 0.0, 0.0, raster.west, raster.north, 0.0]);
    if !keys.shorts.is_empty() {
        directory.shorts(GEO_KEYS, &keys.directory());
    }
    if !keys.doubles.is_empty() {
        directory.doubles(GEO_DOUBLES, &keys.doubles.iter().map(|(_, value)| *value).collect::<Vec<f64>>());
    }
    if !keys.citation.is_empty() {
        directory.text(GEO_TEXTS, &keys.citation);
    }
}

/// Vehicle, time and the name of each label, which GDAL shows as the metadata of the file.
fn metadata(cells: &MapCells) -> String {
    // GDAL escapes these texts twice.
    let item = |key: &str, value: &str| format!("<Item name=\"{key}\">{}</Item>", escaped(&escaped(value)));
    let facts = cells.caption.iter().flat_map(MapCaption::facts).map(|(key, value)| item(key, &value));
    let class = |label: u8| item(&format!("label_{label}"), &cells.book.class_title(label));
    let classes = cells.counts().into_keys().map(class);
    format!("<GDALMetadata>{}</GDALMetadata>", facts.chain(classes).collect::<String>())
}

pub(super) fn deflate(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

/// A text as XML has it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LabelGrid};

    #[test]
    fn degrees_and_utm_are_refused_where_they_have_no_rectangle() {
        let labels: LabelGrid = (0..9).map(|i| (Cell::new(i % 3, i / 3), 1)).collect();
        let cells = MapCells::of_labels(&labels, 0.25);
        for (lat_deg, degrees, utm) in
            [(0.0, true, true), (83.0, true, true), (88.9, true, false), (89.5, false, false), (-90.0, false, false)]
        {
            let origin = Some(Origin { lat_deg, lon_deg: 12.0 });
            let refused = |reference| geotiff(&cells, origin, reference).err();
            assert!(refused(Reference::Mission).is_none());
            let [of_degrees, of_utm] = [Reference::Wgs84, Reference::Utm].map(refused);
            assert_eq!((of_degrees.is_none(), of_utm.is_none()), (degrees, utm), "{lat_deg}");
            assert!([of_degrees, of_utm].iter().flatten().all(|refusal| refusal.to_string().contains("take map.")));
        }
    }
}
