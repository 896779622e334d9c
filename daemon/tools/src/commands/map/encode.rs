//! `scenecast map encode`

use super::Coding;
use super::change::{PngSizes, encode, sizes};
use super::files::{read_map, same_size};
use crate::print_figures;
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_protocol::map_codec::LabelRaster;
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
