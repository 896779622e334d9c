//! `scenecast map decode`

use super::files::{MAX_MAP_BYTES, read_map};
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_protocol::map_codec::ChunkFile;
use std::path::PathBuf;

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
