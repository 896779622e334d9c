//! Label maps as indexed PNG files.

use crate::palette::colour;
use scenecast_protocol::map::{Cell, LabelGrid, Rect};

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

/// The map within `bounds` as an indexed PNG, north up; pixel value = label.
pub fn encode_within(grid: &LabelGrid, bounds: Rect) -> Result<Vec<u8>, PictureError> {
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
pub fn read_indices(bytes: &[u8], most: u64) -> Result<Option<Indices>, String> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let Ok(mut reader) = decoder.read_info() else { return Ok(None) };
    let (width, height) = (reader.info().width, reader.info().height);
    if reader.info().color_type != png::ColorType::Indexed {
        return Ok(None);
    }
    if u64::from(width) * u64::from(height) > most {
        return Err(format!("{width} x {height} pixels are more than the {most} allowed"));
    }
    let depth = reader.info().bit_depth as usize;
    let mut raw = vec![0; reader.output_buffer_size().unwrap_or(0)];
    let info = reader.next_frame(&mut raw).map_err(|e| e.to_string())?;
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
pub fn decode(bytes: &[u8], x0: i32, y0: i32) -> Result<LabelGrid, String> {
    let image = read_indices(bytes, MAX_READ_CELLS)?.ok_or("not an indexed PNG")?;
    let mut grid = LabelGrid::default();
    for (row, line) in (0..image.height).rev().zip(image.pixels.chunks(image.width as usize)) {
        for (column, &label) in (0..image.width).zip(line) {
            grid.set(Cell::new(x0.wrapping_add_unsigned(column), y0.wrapping_add_unsigned(row)), label);
        }
    }
    Ok(grid)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
