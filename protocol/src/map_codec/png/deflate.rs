//! Raw deflate streams, the smallest of several.

use super::DeflateEffort;
use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, TDEFLStatus, compress, create_comp_flags_from_zip_params,
};
use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
use miniz_oxide::inflate::core::{DecompressorOxide, decompress};

/// Level, and strategy in the numbering of zlib: 0 default, 1 filtered, 3 run lengths, 4 fixed codes.
const TRIALS: [(i32, i32); 5] = [(6, 3), (7, 0), (10, 0), (10, 3), (10, 4)];
/// The number of quick trials, which come first.
const QUICK: usize = 2;

pub(super) struct Deflater {
    compressors: Vec<CompressorOxide>,
}

impl Deflater {
    pub(super) fn new() -> Self {
        let with = |(level, strategy)| CompressorOxide::new(create_comp_flags_from_zip_params(level, 0, strategy));
        Self { compressors: TRIALS.into_iter().map(with).collect() }
    }

    /// The shortest raw deflate stream of `input` among the quick trials, or among all.
    pub(super) fn shortest(&mut self, input: &[u8], effort: DeflateEffort) -> Vec<u8> {
        let trials = if effort == DeflateEffort::Quick { QUICK } else { TRIALS.len() };
        let streams = self.compressors.iter_mut().take(trials).map(|compressor| run(compressor, input));
        streams.min_by_key(Vec::len).unwrap_or_default()
    }
}

fn run(compressor: &mut CompressorOxide, input: &[u8]) -> Vec<u8> {
    compressor.reset();
    // A stored block costs 5 bytes in 64 kB, so this always suffices.
    let mut out = vec![0; input.len() + input.len() / 1000 + 64];
    let (status, _, length) = compress(compressor, input, &mut out, TDEFLFlush::Finish);
    debug_assert_eq!(status, TDEFLStatus::Done);
    out.truncate(length);
    out
}

/// The `length` bytes that `stream` stands for; `None` if it does not end exactly with them.
pub(super) fn inflate(stream: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut out = vec![0; length];
    let mut state = DecompressorOxide::new();
    let (status, read, written) = decompress(&mut state, stream, &mut out, 0, TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF);
    (status == TINFLStatus::Done && read == stream.len() && written == length).then_some(out)
}
