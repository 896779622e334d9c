//! Text files, read line by line with bounded memory.

use scenecast_core::UserError;
use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Maximum length of a line, bytes.
const MAX_BYTES: usize = 1 << 20;

/// The lines of a file that are neither empty nor a comment behind `#`.
pub(super) struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    buffer: Vec<u8>,
    length: u64,
    offset: u64,
    number: u64,
}

pub(super) struct TextLine<'a> {
    pub(super) text: &'a str,
    pub(super) number: u64,
    pub(super) offset: u64,
}

impl Lines {
    pub(super) fn open(path: &Path) -> Result<Self, UserError> {
        let file = File::open(path).map_err(|e| UserError::file(path, e))?;
        let about = file.metadata().map_err(|e| UserError::file(path, e))?;
        if !about.is_file() {
            return Err(UserError::file(path, "a file is needed that can be read twice, no folder and no pipe"));
        }
        let reader = BufReader::with_capacity(1 << 16, file);
        let length = about.len();
        Ok(Self { path: path.to_owned(), reader, buffer: Vec::new(), length, offset: 0, number: 0 })
    }

    /// Share of the file that was read, 0..=1.
    pub(super) fn done(&self) -> f64 {
        self.offset as f64 / self.length.max(1) as f64
    }

    /// An error in the line that was read last.
    pub(super) fn error(&self, cause: impl Display) -> UserError {
        UserError::Input(format!("{}:{}: {cause}", self.path.display(), self.number))
    }

    /// Moves to the start of a line.
    pub(super) fn seek(&mut self, offset: u64, number: u64) -> Result<(), UserError> {
        if offset != self.offset {
            let moved = match i64::try_from(i128::from(offset) - i128::from(self.offset)) {
                Ok(by) => self.reader.seek_relative(by),
                Err(_) => self.reader.seek(SeekFrom::Start(offset)).map(drop),
            };
            moved.map_err(|e| UserError::file(&self.path, e))?;
        }
        (self.offset, self.number) = (offset, number - 1);
        Ok(())
    }

    /// The next line; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<TextLine<'_>>, UserError> {
        loop {
            self.buffer.clear();
            let offset = self.offset;
            let read = (&mut self.reader).take(MAX_BYTES as u64 + 1).read_until(b'\n', &mut self.buffer);
            let read = read.map_err(|e| UserError::file(&self.path, e))?;
            if read == 0 {
                return Ok(None);
            }
            self.number += 1;
            self.offset += read as u64;
            if read > MAX_BYTES {
                return Err(self.error(format!("the line is longer than {MAX_BYTES} bytes")));
            }
            let has_content = |text: &str| !text.is_empty() && !text.starts_with('#');
            match std::str::from_utf8(&self.buffer) {
                Err(_) => return Err(self.error("not text in UTF-8")),
                Ok(text) if !has_content(text.trim_start_matches('\u{feff}').trim()) => {}
                Ok(_) => {
                    let text = std::str::from_utf8(&self.buffer).unwrap_or_default();
                    let text = text.trim_start_matches('\u{feff}').trim();
                    return Ok(Some(TextLine { text, number: self.number, offset }));
                }
            }
        }
    }
}

/// Reads a finite number; errors name the field.
pub(super) fn number(field: Option<&str>, name: &str) -> Result<f64, String> {
    let text = field.map(str::trim).ok_or_else(|| format!("{name} is missing"))?;
    let value: Option<f64> = text.parse().ok();
    match value {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(format!("{name} = {text}: it takes a finite number")),
        None => Err(format!("{name} = {text:?} is no number")),
    }
}
