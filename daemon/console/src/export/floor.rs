//! The images of the sea floor as one GeoTIFF in natural colours, in the projection of the mission.

use super::ExportError;
use super::geotiff::{GeoKeys, Raster, TILE, deflate, locate, mission_keys};
use super::tiff::Directory;
use scenecast_protocol::map::Cell;
use scenecast_surface::MapCells;
use scenecast_surface::state::Origin;

/// The most pixels of a file; more would be as many bytes as nobody sends round.
const MAX_PIXELS: f64 = (1 << 24) as f64;
/// The largest edge of an image, pixels.
const MAX_EDGE: u32 = 1024;

/// A square image of the sea floor.
pub(crate) struct FloorPicture {
    /// Its north-west corner in the world frame, metres east and north, and its edge, metres.
    pub(crate) corner_m: (f64, f64),
    pub(crate) edge_m: f64,
    pub(crate) webp: Vec<u8>,
}

/// One that was decoded.
struct Decoded {
    corner_m: (f64, f64),
    edge_m: f64,
    edge: u32,
    rgb: Vec<u8>,
}

impl Decoded {
    /// `None` if the bytes are no square image in colours.
    fn new(picture: &FloorPicture) -> Option<Self> {
        let features = webp::BitstreamFeatures::new(&picture.webp)?;
        let edge = features.width();
        let is_usable = edge == features.height() && (1..=MAX_EDGE).contains(&edge) && picture.edge_m > 0.0;
        let decoded = webp::Decoder::new(&picture.webp).decode().filter(|image| is_usable && !image.is_alpha())?;
        Some(Self { corner_m: picture.corner_m, edge_m: picture.edge_m, edge, rgb: decoded.to_vec() })
    }

    /// The colour at a place; `None` beyond its edges.
    fn colour(&self, (east_m, north_m): (f64, f64)) -> Option<[u8; 3]> {
        let pixel = |metres: f64| (metres / self.edge_m * f64::from(self.edge)).floor();
        let (column, row) = (pixel(east_m - self.corner_m.0), pixel(self.corner_m.1 - north_m));
        let is_inside = |at: f64| (0.0..f64::from(self.edge)).contains(&at);
        if !(is_inside(column) && is_inside(row)) {
            return None;
        }
        let at = 3 * (row as usize * self.edge as usize + column as usize);
        self.rgb.get(at..at + 3)?.try_into().ok()
    }

    fn meets(&self, (west, north): (f64, f64), (east, south): (f64, f64)) -> bool {
        let (left, top) = self.corner_m;
        left < east && left + self.edge_m > west && top > south && top - self.edge_m < north
    }
}

/// The images where the map has cells; elsewhere pixels are transparent. `None` without an image.
pub(crate) fn floor_tiff(
    pictures: &[FloorPicture],
    cells: &MapCells,
    origin: Option<Origin>,
) -> Result<Option<Vec<u8>>, ExportError> {
    let pictures: Vec<Decoded> = pictures.iter().filter_map(Decoded::new).collect();
    let Some(raster) = raster(&pictures) else { return Ok(None) };
    let (columns, rows) = (raster.width.div_ceil(TILE), raster.height.div_ceil(TILE));
    let (mut data, mut places) = (Vec::new(), Vec::new());
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let tile = deflate(&tile(&pictures, cells, &raster, (row, column)))?;
        places.push((data.len(), tile.len()));
        data.extend(tile);
    }
    let mut directory = Directory::of_colours([raster.width, raster.height]);
    locate(&mut directory, &raster, &origin.map_or_else(GeoKeys::default, mission_keys));
    directory.tiles(TILE, &places)?;
    Ok(Some([directory.bytes(), data].concat()))
}

/// Pixels as fine as those of the finest image, or as coarse as it takes to be few enough.
fn raster(pictures: &[Decoded]) -> Option<Raster> {
    let low = |of: fn(&Decoded) -> f64| pictures.iter().map(of).reduce(f64::min);
    let high = |of: fn(&Decoded) -> f64| pictures.iter().map(of).reduce(f64::max);
    let (west, east) = (low(|p| p.corner_m.0)?, high(|p| p.corner_m.0 + p.edge_m)?);
    let (south, north) = (low(|p| p.corner_m.1 - p.edge_m)?, high(|p| p.corner_m.1)?);
    let finest_m = low(|p| p.edge_m / f64::from(p.edge))?;
    let pixel_m = finest_m.max(((east - west) * (north - south) / MAX_PIXELS).sqrt());
    let count = |metres: f64| (metres / pixel_m - 1e-6).ceil().max(1.0) as u32;
    let (width, height) = (count(east - west), count(north - south));
    (east - west).is_finite().then_some(Raster { west, north, pixel: (pixel_m, pixel_m), width, height })
}

/// Red, green, blue and opacity of each pixel of a tile, row by row from the north-west.
fn tile(pictures: &[Decoded], cells: &MapCells, raster: &Raster, (row, column): (u32, u32)) -> Vec<u8> {
    let (pixel_m, edge_m) = (raster.pixel.0, f64::from(TILE) * raster.pixel.0);
    let (west, north) = (raster.west + f64::from(column) * edge_m, raster.north - f64::from(row) * edge_m);
    let near: Vec<&Decoded> =
        pictures.iter().filter(|picture| picture.meets((west, north), (west + edge_m, north - edge_m))).collect();
    let index = |metres: f64| (metres / cells.cell_m).floor().clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32;
    let mut pixels = vec![0; 4 * (TILE * TILE) as usize];
    for (at, pixel) in (0..TILE * TILE).zip(pixels.chunks_exact_mut(4)) {
        let metres = |pixels: u32| (f64::from(pixels) + 0.5) * pixel_m;
        let (east_m, north_m) = (west + metres(at % TILE), north - metres(at / TILE));
        let cell = Cell::new(index(east_m - cells.moved_m.0), index(north_m - cells.moved_m.1));
        let colour = near.iter().find_map(|picture| picture.colour((east_m, north_m)));
        if let Some([red, green, blue]) = colour.filter(|_| cells.label(cell) != 0) {
            pixel.copy_from_slice(&[red, green, blue, u8::MAX]);
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::LabelGrid;

    fn picture(west: f64, north: f64, colour: [u8; 3]) -> FloorPicture {
        let rgb = colour.repeat(16 * 16);
        let webp = webp::Encoder::from_rgb(&rgb, 16, 16).encode_lossless().to_vec();
        FloorPicture { corner_m: (west, north), edge_m: 2.0, webp }
    }

    #[test]
    fn each_image_lies_at_its_place_where_the_map_has_cells() {
        // The map has the eastern half of the second image only.
        let labels: LabelGrid = (0..12).flat_map(|x| (0..8).map(move |y| (Cell::new(x, y), 1))).collect();
        let cells = MapCells { moved_m: (10.0, 0.0), ..MapCells::of_labels(&labels, 0.25) };
        let pictures = [picture(12.0, 2.0, [200, 0, 0]), picture(10.0, 2.0, [0, 0, 200])];
        let decoded: Vec<Decoded> = pictures.iter().filter_map(Decoded::new).collect();
        let raster = raster(&decoded).unwrap();
        assert_eq!((raster.west, raster.north, raster.width, raster.height), (10.0, 2.0, 32, 16));
        let pixels = tile(&decoded, &cells, &raster, (0, 0));
        let at = |x: usize, y: usize| &pixels[4 * (y * TILE as usize + x)..][..4];
        assert_eq!((at(0, 0), at(15, 15)), (&[0, 0, 200, 255][..], &[0, 0, 200, 255][..]));
        assert_eq!((at(16, 8), at(24, 8)), (&[200, 0, 0, 255][..], &[0; 4][..]), "no cell beyond 13 m");
        assert!(floor_tiff(&pictures, &cells, None).unwrap().unwrap().starts_with(b"II*\0"));
        assert!(floor_tiff(&[], &cells, None).unwrap().is_none());
        let broken = FloorPicture { webp: vec![1, 2, 3], ..picture(0.0, 0.0, [1; 3]) };
        assert!(floor_tiff(&[broken], &cells, None).unwrap().is_none());
    }
}
