//! The crate through its public interface: two ends over a channel that loses frames, the document of the wire, the fuzz corpora.

mod convergence;
mod examples;
mod forgery;
mod fuzz_corpus;
mod in_force;
mod layers;
mod pair;
mod path;
mod promises;
mod replay;
mod rotation;
mod vectors;

/// `all` cases in `.ci/full`, a third of them in `.ci/run`.
fn cases(all: u64) -> u64 {
    if std::env::var_os("SCENECAST_FULL").is_some() { all } else { all.div_ceil(3) }
}
