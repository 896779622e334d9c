//! The fuzz target of the journal without a fuzzer: every file of its corpus, and mutations of them.

use crate::journal;
use std::path::Path;

#[path = "../fuzz/src/files.rs"]
pub(crate) mod files;
#[path = "../fuzz/src/journal_target.rs"]
mod journal_target;

/// The files of the corpus of a target.
pub(crate) fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Gives `check` mutations of the files, the same in each run.
pub(crate) fn mutate(files: &[Vec<u8>], mutations: usize, check: impl Fn(&[u8])) {
    let mut random = 7u64;
    let mut below = |limit: usize| {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 33) as usize % limit.max(1)
    };
    for _ in 0..mutations {
        let mut data = files[below(files.len())].clone();
        for _ in 0..=below(4) {
            let at = below(data.len() + 1);
            match below(3) {
                0 => data.truncate(at),
                1 => data.insert(at, below(256) as u8),
                _ => data.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << below(8)),
            }
        }
        check(&data);
    }
}

#[test]
fn every_file_of_the_corpus_is_read_or_refused() {
    let files = corpus("journal");
    assert!(files.len() >= 4, "{} files", files.len());
    files.iter().for_each(|data| journal_target::journal(data));
}

#[test]
fn changed_bytes_of_the_corpus_never_lead_to_an_older_state() {
    mutate(&corpus("journal"), 3000, journal_target::journal);
}
