//! The fuzz target of the store without a fuzzer: every file of its corpus, and mutations of them.

use super::{batch, log};
use crate::fuzz_corpus_tests::{corpus, files, mutate};

#[path = "../../fuzz/src/store_target.rs"]
mod store_target;

#[test]
fn the_corpus_of_the_store_is_read_or_refused() {
    let files = corpus("store");
    assert!(files.len() >= 4, "{} files", files.len());
    files.iter().for_each(|data| store_target::store(data));
}

#[test]
fn changed_bytes_of_the_store_never_lead_to_other_events() {
    mutate(&corpus("store"), 1000, store_target::store);
}
