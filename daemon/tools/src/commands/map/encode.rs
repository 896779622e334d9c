//! `scenecast map encode`

use super::Coding;
use super::change::{encode, sizes};
use super::files::{read_map, same_size};
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_protocol::map_codec::LabelRaster;
use std::path::PathBuf;

/// Write the chunks that turn one map into another, and print their sizes as JSON.
///
/// Maps are indexed PNG files: pixel value = label, 0 = unexplored, at most 254. "bytes" counts all bytes of all
/// chunks with their heads. "png_full_bytes" and "png_delta_bytes" are the sizes of the best PNG files (zopfli; the delta
/// as a whole image or cut to its box).
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast map encode --base yesterday.png --target today.png --out change.scmc")]
pub struct Encode {
    /// Map after the change
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
        let sizes = sizes(&self.coding, &base, &target, &file, cells_changed);
        let text = serde_json::to_string(&sizes).map_err(|e| UserError::Failed(e.to_string()))?;
        write_whole(&self.out, &file.to_bytes())?;
        println!("{text}");
        Ok(())
    }
}
