//! The fuzz targets without a fuzzer: every file of the corpora.

#[path = "../../fuzz/src/lib.rs"]
mod targets;

use std::fs;
use std::path::Path;

#[test]
#[allow(clippy::disallowed_methods, reason = "the corpus is files")]
fn every_file_of_the_corpora_is_taken_or_refused() {
    for (name, target) in targets::ALL {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
        let files: Vec<_> = fs::read_dir(folder).expect("corpus").map(|entry| entry.expect("entry").path()).collect();
        assert!(files.len() >= 4, "{name} has {} files", files.len());
        files.iter().for_each(|path| target(&fs::read(path).expect("corpus file")));
    }
}
