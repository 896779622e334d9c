//! `scenecast map encode` and `scenecast map decode`

use super::Coding;
use super::change::{MAX_MAP_BYTES, PngSizes, encode, read_map, same_size, sizes};
use crate::print_figures;
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_protocol::map_codec::{ChunkFile, LabelRaster};
use std::path::PathBuf;

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
