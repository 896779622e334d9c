//! `scenecast map encode` and `scenecast map decode`; label maps in files, and the sizes of the chunks of one change.

use super::Coding;
use crate::{Zopfli, print_figures};
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_protocol::map_codec::{ChunkFile, ChunkFileError, LabelRaster};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Sizes of one change or of several.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Sizes {
    /// Bytes of all chunks, their heads included.
    pub(super) bytes: usize,
    /// Number of frames that the chunks fill in order; no chunk is split.
    pub(super) frames: usize,
    pub(super) cells_changed: usize,
    pub(super) codec: String,
    /// `None`: not compared with PNG files.
    #[serde(flatten)]
    pub(super) png: Option<PngSizes>,
}

/// Sizes of the PNG files that the chunks are compared with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PngSizes {
    /// Bytes of the whole map as the best PNG.
    pub(super) png_full_bytes: usize,
    /// Bytes of the change as the best PNG: delta image or dirty box.
    pub(super) png_delta_bytes: usize,
}

impl PngSizes {
    /// Compresses with zopfli, which takes most of the time of an encoding.
    pub fn measure(base: &LabelRaster, target: &LabelRaster) -> Self {
        Self {
            png_full_bytes: target.smallest_png(&mut Zopfli),
            png_delta_bytes: target.smallest_delta_png(base, &mut Zopfli),
        }
    }
}

impl Sizes {
    pub fn add(&mut self, other: &Self) {
        self.bytes += other.bytes;
        self.frames += other.frames;
        self.cells_changed += other.cells_changed;
        if let Some(png) = other.png {
            let sum = self.png.get_or_insert_default();
            sum.png_full_bytes += png.png_full_bytes;
            sum.png_delta_bytes += png.png_delta_bytes;
        }
    }
}

/// The chunks from `base` to `target`, and how many cells they change.
pub fn encode(coding: &Coding, base: &LabelRaster, target: &LabelRaster) -> Result<(ChunkFile, usize), UserError> {
    ChunkFile::encode(coding.codec, base, target, coding.frame_bytes.into()).map_err(refused)
}

/// A coding error is wrong input: the files were read without error before.
pub fn refused(error: ChunkFileError) -> UserError {
    UserError::input(error)
}

/// Sizes of an encoded change, beside those of PNG files.
pub fn sizes(coding: &Coding, file: &ChunkFile, cells_changed: usize, png: Option<PngSizes>) -> Sizes {
    Sizes {
        bytes: file.chunks.iter().map(Vec::len).sum(),
        frames: frames(file.chunks.iter().map(Vec::len), coding.frame_bytes.into()),
        cells_changed,
        codec: coding.codec.to_string(),
        png,
    }
}

fn frames(chunks: impl Iterator<Item = usize>, room: usize) -> usize {
    let (mut frames, mut left) = (0, 0);
    for chunk in chunks {
        if chunk > left {
            (frames, left) = (frames + 1, room);
        }
        left -= chunk.min(left);
    }
    frames
}

/// Largest file of a map, bytes.
pub const MAX_MAP_BYTES: u64 = 1 << 30;

/// Reads a map from an indexed PNG.
pub fn read_map(path: &Path) -> Result<LabelRaster, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_MAP_BYTES)?;
    LabelRaster::from_png(&bytes).map_err(|e| UserError::file(path, e))
}

/// Refuses a map of another size than that of `base`.
pub fn same_size(base: (&Path, &LabelRaster), map: (&Path, &LabelRaster)) -> Result<(), UserError> {
    if (base.1.width, base.1.height) == (map.1.width, map.1.height) {
        return Ok(());
    }
    let base = format!("its base {} has {} x {}", base.0.display(), base.1.width, base.1.height);
    Err(UserError::file(map.0, format!("{} x {} cells; {base}; both must be the same", map.1.width, map.1.height)))
}

/// The PNG files of a folder, sorted by the last number in their names.
pub fn numbered(dir: &Path) -> Result<Vec<PathBuf>, UserError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))? {
        let path = entry.map_err(|e| UserError::file(dir, e))?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            files.push((number(&path)?, path));
        }
    }
    files.sort();
    if let Some(twice) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(UserError::file(&twice[1].1, format!("number {} is there twice", twice[0].0)));
    }
    if files.is_empty() {
        return Err(UserError::file(dir, "no PNG file; numbered ones are needed, as in 1.png, 2.png"));
    }
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

/// The last number in a file's name.
fn number(path: &Path) -> Result<u64, UserError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let last = stem.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty());
    let number = last.and_then(|digits| digits.parse().ok());
    number.ok_or_else(|| UserError::file(path, "its name has no number below 2^64 for its position in the series"))
}

/// Write the chunks that turn one map into another, and print their sizes: in a pipe or a file as one line of JSON.
///
/// Maps are indexed PNG files: pixel value = label, 0 = unexplored, at most 254. "bytes" counts all bytes of all chunks
/// with their heads. "png_full_bytes" and "png_delta_bytes" are the sizes of the best PNG files (zopfli; the delta as a
/// whole image or cut to its box).
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast map encode --base yesterday.png --target today.png --out change.scmc")]
pub struct Encode {
    /// Map after the change, an indexed PNG
    #[arg(long, value_name = "T.png")]
    target: PathBuf,
    /// Map that the receiver has [default: an empty map]
    #[arg(long, value_name = "B.png")]
    base: Option<PathBuf>,
    #[command(flatten)]
    coding: Coding,
    /// File of chunks to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Do not compare with PNG files, which takes most of the time
    #[arg(long)]
    no_png: bool,
    /// Print JSON at a terminal too
    #[arg(long)]
    json: bool,
}

impl Encode {
    pub fn run(self) -> Result<(), UserError> {
        let target = read_map(&self.target)?;
        let base = match &self.base {
            Some(path) => {
                let base = read_map(path)?;
                same_size((path, &base), (&self.target, &target))?;
                base
            }
            None => LabelRaster::uniform(target.width, target.height, 0),
        };
        let (file, cells_changed) = encode(&self.coding, &base, &target)?;
        let png = (!self.no_png).then(|| PngSizes::measure(&base, &target));
        let sizes = sizes(&self.coding, &file, cells_changed, png);
        write_whole(&self.out, &file.to_bytes())?;
        print_figures(&sizes, self.json)
    }
}

/// Decode chunks into a map: an indexed PNG, pixel value = label, 0 = unexplored.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast map decode --base yesterday.png --in change.scmc --out today.png")]
pub struct Decode {
    /// Map against which the chunks were encoded [default: an empty map]
    #[arg(long, value_name = "B.png")]
    base: Option<PathBuf>,
    /// File of chunks that map encode has written
    #[arg(long = "in", value_name = "FILE")]
    input: PathBuf,
    /// Map to write, an indexed PNG
    #[arg(long, value_name = "T2.png")]
    out: PathBuf,
}

impl Decode {
    pub fn run(self) -> Result<(), UserError> {
        let refused = |e| UserError::file(&self.input, e);
        let bytes = scenecast_config::read_regular(&self.input, MAX_MAP_BYTES)?;
        let file = ChunkFile::from_bytes(&bytes).map_err(refused)?;
        let base = self.base.as_deref().map(read_map).transpose()?;
        let map = file.apply(base.as_ref()).map_err(refused)?;
        write_whole(&self.out, &map.to_png())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_share_a_frame_while_they_fit() {
        assert_eq!(frames([60, 40, 1, 99, 100].into_iter(), 100), 3);
        assert_eq!(frames([].into_iter(), 100), 0);
    }

    #[test]
    fn the_last_number_of_a_name_is_its_position() {
        let of = |name: &str| number(Path::new(name)).ok();
        assert_eq!(of("dir9/step-007.png"), Some(7));
        assert_eq!(of("reef2_12b.png"), Some(12));
        assert_eq!((of("map.png"), of("99999999999999999999.png")), (None, None));
    }
}
