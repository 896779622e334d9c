//! Crops of the shared real maps; skipped, loudly, where they are absent.

use scenecast_protocol::map_codec::procedural::Plane;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Where the shared material lies, seen from this package.
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");

/// An indexed or grey map of the shared data, one cell in `step` each way, pixel value + `shift` = label.
pub(crate) fn map(name: &str, step: usize, shift: u8) -> Option<Plane> {
    let path = Path::new(DATA).join(name);
    let Ok(file) = File::open(&path) else {
        println!("SKIPPED: {} is absent", path.display());
        return None;
    };
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().expect("PNG head");
    let mut data = vec![0; reader.output_buffer_size().expect("size")];
    let info = reader.next_frame(&mut data).expect("PNG data");
    let bits = info.bit_depth as usize;
    let pixel = |column: usize, row: usize| {
        let byte = data[row * info.line_size + column * bits / 8];
        byte << (column * bits % 8) >> (8 - bits)
    };
    let (width, height) = (info.width as usize / step, info.height as usize / step);
    let labels = (0..width * height).map(|i| pixel(i % width * step, i / width * step) + shift).collect();
    Some(Plane { width, height, labels })
}

/// Square crops of `side` cells, side by side, that hold at least `least` kinds of label.
pub(crate) fn crops(map: &Plane, side: usize, least: usize) -> Vec<Plane> {
    let corners = (0..map.height / side).flat_map(|row| (0..map.width / side).map(move |column| (column, row)));
    let crop = |(column, row): (usize, usize)| crop(map, column * side, row * side, side);
    corners.map(crop).filter(|crop| kinds(crop) >= least).collect()
}

/// The square of `side` cells with its first cell in `column` of `row`.
pub(crate) fn crop(map: &Plane, column: usize, row: usize, side: usize) -> Plane {
    let labels = (0..side * side).map(|i| map.get(column + i % side, row + i / side)).collect();
    Plane { width: side, height: side, labels }
}

fn kinds(plane: &Plane) -> usize {
    let mut labels = plane.labels.clone();
    labels.sort_unstable();
    labels.dedup();
    labels.len()
}
