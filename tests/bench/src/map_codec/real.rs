//! Crops of the shared real maps; skipped with a message where they are absent.

use scenecast_protocol::map_codec::LabelRaster;
use std::io::Cursor;
use std::path::Path;

/// The folder of the shared material.
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");

/// A map of the shared data, one cell in `step` in each direction; pixel value + `shift` is the label.
pub(super) fn map(name: &str, step: usize, shift: u8) -> Option<LabelRaster> {
    let path = Path::new(DATA).join(name);
    let Ok(file) = std::fs::read(&path) else {
        println!("SKIPPED: {} is absent", path.display());
        return None;
    };
    let pixels = grey(&file);
    let (width, height) = (pixels.width / step, pixels.height / step);
    let labels = (0..width * height).map(|i| pixels.get(i % width * step, i / width * step) + shift).collect();
    Some(LabelRaster { width, height, labels })
}

/// The shared maps hold the labels as grey levels of eight bits.
fn grey(file: &[u8]) -> LabelRaster {
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().expect("PNG head");
    let mut labels = vec![0; reader.output_buffer_size().expect("size")];
    let info = reader.next_frame(&mut labels).expect("PNG data");
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Eight));
    LabelRaster { width: info.width as usize, height: info.height as usize, labels }
}

/// Square crops of `side` cells, side by side, that hold at least `least` different labels.
pub(super) fn crops(map: &LabelRaster, side: usize, least: usize) -> Vec<LabelRaster> {
    let corners = (0..map.height / side).flat_map(|row| (0..map.width / side).map(move |column| (column, row)));
    let crop = |(column, row): (usize, usize)| crop(map, column * side, row * side, side);
    corners.map(crop).filter(|crop| kinds(crop) >= least).collect()
}

/// The square of `side` cells with its first cell in `column` of `row`.
pub(super) fn crop(map: &LabelRaster, column: usize, row: usize, side: usize) -> LabelRaster {
    let labels = (0..side * side).map(|i| map.get(column + i % side, row + i / side)).collect();
    LabelRaster { width: side, height: side, labels }
}

fn kinds(raster: &LabelRaster) -> usize {
    let mut labels = raster.labels.clone();
    labels.sort_unstable();
    labels.dedup();
    labels.len()
}
