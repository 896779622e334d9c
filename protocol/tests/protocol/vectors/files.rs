//! The files of vectors: JSON with an element a line, and captures.

use crate::examples::vectors::{Hex, Named, folder};
use serde::Serialize;
use serde_json::ser::Formatter;
use std::io::{self, Write};
use std::path::Path;

/// Whether the files are to be written again instead of compared.
pub(crate) fn is_update() -> bool {
    std::env::var_os("SCENECAST_UPDATE_DOCS").is_some()
}

/// Compares a file of vectors with its content, or writes it.
pub(crate) fn assert_file(name: &str, content: &impl Serialize) {
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Lines::default());
    content.serialize(&mut serializer).expect("JSON");
    bytes.push(b'\n');
    assert_bytes(&folder().join(name), &bytes);
}

#[allow(clippy::disallowed_methods, reason = "vectors are files")]
fn assert_bytes(path: &Path, bytes: &[u8]) {
    if is_update() {
        std::fs::write(path, bytes).expect("the file of vectors");
    }
    let written = std::fs::read(path).unwrap_or_default();
    let command = "SCENECAST_UPDATE_DOCS=1 cargo test -p scenecast-protocol --test protocol vectors";
    assert!(written == bytes, "{} is out of date: {command}", path.display());
}

/// Compares a capture (pcap, link type User 0) with its frames, one a second, or writes it.
pub(crate) fn assert_capture<'a>(name: &str, frames: impl Iterator<Item = &'a [u8]>) {
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let mut bytes = words(&[0xA1B2_C3D4, 0x0004_0002, 0, 0, 65_535, 147]);
    for (second, frame) in (0..).zip(frames) {
        bytes.extend(words(&[second, 0, frame.len() as u32, frame.len() as u32]));
        bytes.extend_from_slice(frame);
    }
    assert_bytes(&folder().join(name), &bytes);
}

pub(crate) fn named(rows: Vec<(&str, Vec<u8>)>) -> Vec<Named> {
    rows.into_iter().map(|(name, bytes)| Named { name: name.to_owned(), bytes: Hex(bytes) }).collect()
}

/// An element a line in the two outer levels, everything below on its line.
#[derive(Default)]
struct Lines {
    depth: usize,
}

impl Lines {
    const LEVELS: usize = 2;

    fn next<W: ?Sized + Write>(&self, to: &mut W, is_first: bool) -> io::Result<()> {
        let comma = if is_first { "" } else { "," };
        match self.depth <= Self::LEVELS {
            true => write!(to, "{comma}\n{:1$}", "", 2 * self.depth),
            false => write!(to, "{}", if is_first { "" } else { ", " }),
        }
    }

    fn end<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.depth -= 1;
        if self.depth < Self::LEVELS { write!(to, "\n{:1$}", "", 2 * self.depth) } else { Ok(()) }
    }
}

impl Formatter for Lines {
    fn begin_array<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.depth += 1;
        to.write_all(b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.end(to)?;
        to.write_all(b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, to: &mut W, is_first: bool) -> io::Result<()> {
        self.next(to, is_first)
    }

    fn begin_object<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.depth += 1;
        to.write_all(b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.end(to)?;
        to.write_all(b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, to: &mut W, is_first: bool) -> io::Result<()> {
        self.next(to, is_first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, to: &mut W) -> io::Result<()> {
        to.write_all(b": ")
    }
}
