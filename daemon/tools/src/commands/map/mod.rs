//! `scenecast map`

mod bench;
mod change;

use clap::{Args, Subcommand};
use scenecast_core::UserError;
use scenecast_protocol::map_codec::Codec;

/// Encode label maps as on the link, and measure the codecs.
#[derive(Debug, Subcommand)]
pub enum Map {
    /// Write the chunks that turn one map into another, and print their sizes.
    Encode(change::Encode),
    /// Decode such chunks into a map.
    Decode(change::Decode),
    /// Measure a folder of numbered maps, each encoded against the one before.
    Bench(bench::MapBench),
}

impl Map {
    pub fn run(self) -> Result<(), UserError> {
        match self {
            Self::Encode(encode) => encode.run(),
            Self::Decode(decode) => decode.run(),
            Self::Bench(bench) => bench.run(),
        }
    }
}

/// Options of the encoder for chunks.
#[derive(Debug, Args)]
struct Coding {
    /// Codec: auto (the smaller result for each chunk), png or context
    #[arg(long, default_value = "auto")]
    codec: Codec,
    /// Maximum bytes of a chunk, 24 to 65535; also the room in a frame
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u16).range(24..))]
    frame_bytes: u16,
}
