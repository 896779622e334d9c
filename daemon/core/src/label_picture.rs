//! Label maps as indexed PNG files, and world files, which georeference an image.

use crate::geodesy::TangentPlane;
use crate::palette::colour;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::map::{Cell, LabelGrid, Rect};
use scenecast_protocol::wire::Placement;

/// Most cells of a map that is sent as a rectangle: a few frames can claim two cells at the ends of the world.
pub const MAX_CELLS: u64 = 1 << 23;

/// Why a map is not drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    #[error("the map spans {0} x {1} cells: at most {MAX_CELLS} are drawn")]
    TooLarge(u32, u32),
    #[error(transparent)]
    Png(#[from] png::EncodingError),
}

/// Why a picture is not read as a map.
#[derive(Debug, thiserror::Error)]
pub enum ReadPictureError {
    #[error("{width} x {height} pixels are more than the {most} allowed")]
    TooLarge { width: u32, height: u32, most: u64 },
    #[error("not an indexed PNG")]
    NotIndexed,
    #[error(transparent)]
    Png(#[from] png::DecodingError),
}

/// The map within `bounds` as an indexed PNG, north up; pixel value = label.
pub fn encode_within(grid: &LabelGrid, bounds: Rect) -> Result<Vec<u8>, PictureError> {
    encode_coloured(grid, bounds, colour)
}

/// The same in other colours.
pub fn encode_coloured(
    grid: &LabelGrid,
    bounds: Rect,
    colour: impl Fn(u8) -> [u8; 3],
) -> Result<Vec<u8>, PictureError> {
    if bounds.area() > MAX_CELLS {
        return Err(PictureError::TooLarge(bounds.width, bounds.height));
    }
    let highest = grid.iter().map(|(_, l)| l).max().unwrap_or(0);
    let depth = match highest {
        0..=1 => png::BitDepth::One,
        2..=3 => png::BitDepth::Two,
        4..=15 => png::BitDepth::Four,
        _ => png::BitDepth::Eight,
    };
    let per_byte = 8 / depth as usize;
    let mut pixels = Vec::new();
    for row in (0..bounds.height).rev() {
        let labels: Vec<u8> = (0..bounds.width)
            .map(|column| {
                grid.get(Cell::new(bounds.x.wrapping_add_unsigned(column), bounds.y.wrapping_add_unsigned(row)))
            })
            .collect();
        for group in labels.chunks(per_byte) {
            let packed = group.iter().enumerate().fold(0u8, |acc, (i, &l)| acc | l << (8 - (i + 1) * depth as usize));
            pixels.push(packed);
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, bounds.width, bounds.height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(depth);
    encoder.set_palette((0..=highest).flat_map(colour).collect::<Vec<u8>>());
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The whole map as an indexed PNG; one black pixel if no cell is explored.
pub fn encode(grid: &LabelGrid) -> Result<Vec<u8>, PictureError> {
    encode_within(grid, grid.bounds().unwrap_or(Rect { x: 0, y: 0, width: 1, height: 1 }))
}

/// The raw indices of an image, row by row from the top.
pub struct Indices {
    pub pixels: Vec<u8>,
    pub width: u32,
    pub height: u32,
}

/// Most cells of a map that is read.
const MAX_READ_CELLS: u64 = 1 << 22;

/// Reads the indices of an indexed PNG of at most `most` pixels; `None` if it is another kind of file.
pub fn read_indices(bytes: &[u8], most: u64) -> Result<Option<Indices>, ReadPictureError> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let Ok(mut reader) = decoder.read_info() else { return Ok(None) };
    let (width, height) = (reader.info().width, reader.info().height);
    if reader.info().color_type != png::ColorType::Indexed {
        return Ok(None);
    }
    if u64::from(width) * u64::from(height) > most {
        return Err(ReadPictureError::TooLarge { width, height, most });
    }
    let depth = reader.info().bit_depth as usize;
    let mut raw = vec![0; reader.output_buffer_size().unwrap_or(0)];
    let info = reader.next_frame(&mut raw)?;
    let index = |line: &[u8], column: usize| {
        let bit = column * depth;
        let byte = line.get(bit / 8).copied().unwrap_or(0);
        byte >> (8 - depth - bit % 8) & (0xFFu16 >> (8 - depth)) as u8
    };
    let lines = raw.chunks(info.line_size).take(height as usize);
    let pixels = lines.flat_map(|line| (0..width as usize).map(move |column| index(line, column))).collect();
    Ok(Some(Indices { pixels, width, height }))
}

/// Reads an indexed PNG as a map whose south-west cell is `(x0, y0)`.
pub fn decode(bytes: &[u8], x0: i32, y0: i32) -> Result<LabelGrid, ReadPictureError> {
    let image = read_indices(bytes, MAX_READ_CELLS)?.ok_or(ReadPictureError::NotIndexed)?;
    let mut grid = LabelGrid::default();
    for (row, line) in (0..image.height).rev().zip(image.pixels.chunks(image.width as usize)) {
        for (column, &label) in (0..image.width).zip(line) {
            grid.set(Cell::new(x0.wrapping_add_unsigned(column), y0.wrapping_add_unsigned(row)), label);
        }
    }
    Ok(grid)
}

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
    fn a_map_comes_back_from_its_png_at_every_bit_depth() {
        for labels in [1u8, 3, 9, 200] {
            let grid: LabelGrid = (0..15 * 9)
                .map(|i| (Cell::new(i % 15 - 4, i / 15 - 2), (i * 7 % i32::from(labels)) as u8 + 1))
                .collect();
            let bounds = grid.bounds().unwrap();
            let png = encode(&grid).unwrap();
            assert_eq!(decode(&png, bounds.x, bounds.y).unwrap(), grid, "{labels} labels");
        }
    }

    #[test]
    fn a_picture_that_claims_too_much_is_refused() {
        let grid: LabelGrid = [(Cell::new(0, 0), 1)].into_iter().collect();
        let huge = Rect { x: 0, y: 0, width: 1 << 12, height: (1 << 10) + 1 };
        assert!(decode(&encode_within(&grid, huge).unwrap(), 0, 0).is_err());
        let small = encode_within(&grid, Rect { x: 0, y: 0, width: 3, height: 2 }).unwrap();
        assert!(decode(&small, i32::MAX, i32::MAX).is_ok(), "a place at the end of the world is no panic");
    }

    #[test]
    fn two_cells_at_the_ends_of_the_world_are_no_picture() {
        let far: LabelGrid =
            [(Cell::new(-2_000_000_000, 0), 1), (Cell::new(2_000_000_000, 9), 2)].into_iter().collect();
        assert_eq!(
            encode(&far).unwrap_err().to_string(),
            "the map spans 4000000001 x 10 cells: at most 8388608 are drawn"
        );
        let beside = Rect { x: 0, y: 0, width: 1 << 12, height: (1 << 11) + 1 };
        assert!(matches!(encode_within(&far, beside), Err(PictureError::TooLarge(..))));
    }

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
