//! The fuzz target of the journal without a fuzzer: every file of its corpus, and mutations of them.

use crate::journal;
use std::path::Path;

#[path = "../fuzz/src/targets.rs"]
mod targets;

fn corpus() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/journal");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| std::fs::read(path).unwrap()).collect()
}

#[test]
fn every_file_of_the_corpus_is_read_or_refused() {
    let files = corpus();
    assert!(files.len() >= 4, "{} files", files.len());
    files.iter().for_each(|data| targets::journal(data));
}

#[test]
fn changed_bytes_of_the_corpus_never_lead_to_an_older_state() {
    let files = corpus();
    let mut random = 7u64;
    let mut below = |limit: usize| {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 33) as usize % limit.max(1)
    };
    for _ in 0..3000 {
        let mut data = files[below(files.len())].clone();
        for _ in 0..=below(4) {
            let at = below(data.len() + 1);
            match below(3) {
                0 => data.truncate(at),
                1 => data.insert(at, below(256) as u8),
                _ => data.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << below(8)),
            }
        }
        targets::journal(&data);
    }
}
