//! The emulated modems through their public interface: transcripts of known clients, floods of bytes, the fuzz corpus.

mod flood;
mod fuzz_corpus;
mod transcripts;
