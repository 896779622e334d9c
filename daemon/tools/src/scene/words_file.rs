//! Words from a file: lines `t,x,y,z,w1,w2,...`, read one by one with bounded memory.

use super::extent::{LargeExtent, rectangle};
use super::{Sighting, WordSource};
use scene_model::project::Observation;
use scene_model::topics::coord_of;
use scenecast_core::UserError;
use scenecast_files::{NumberFault, finite_number};
use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Maximum number of words of one sighting, which are held in memory at once.
const MAX_WORDS: usize = 1 << 16;
/// Maximum number of different words, the scene model's own limit.
const MAX_VOCABULARY: u32 = 1 << 20;

/// A file of words, read twice: once to check all lines, then to learn from them.
///
/// A line is a place and the words there: seconds, metres, word ids. A first line that begins
/// with `t` names the columns.
pub(crate) struct WordsFile {
    lines: Lines,
    pub(crate) vocabulary: u32,
    /// Start of each line in order of time, if the file is not in that order.
    order: Option<std::vec::IntoIter<Mark>>,
    marks: (usize, usize),
    in_time: bool,
    /// Number of the first line, which may name the columns.
    begun: u64,
    ahead: Option<(f64, Vec<Observation>)>,
}

/// When and where a line is.
#[derive(Clone, Copy)]
struct Mark {
    t_s: f64,
    offset: u64,
    number: u64,
}

impl WordsFile {
    /// Checks a file. With `in_time` its lines are returned in order of time, otherwise in the order of the file.
    pub(crate) fn open(
        path: &Path,
        vocabulary: Option<u32>,
        cell_m: [f64; 3],
        in_time: bool,
    ) -> Result<Self, UserError> {
        let mut lines = Lines::open(path)?;
        let mut extent = Extent::new(cell_m);
        let (mut marks, mut largest, mut words, mut begun) = (Vec::new(), 0, 0u64, 0);
        let most = vocabulary.unwrap_or(MAX_VOCABULARY);
        let mut seen = Vec::new();
        while let Some(line) = lines.next()? {
            let TextLine { number, offset, .. } = line;
            if begun == 0 {
                begun = number;
            }
            let parsed = parse(line.text, number == begun, &mut seen).and_then(|t_s| {
                if let Some(word) = seen.iter().map(|o| o.word).find(|&word| word >= most) {
                    return Err(match vocabulary {
                        Some(size) => LineFault::NotInVocabulary { word, size },
                        None => LineFault::HighWordId { word, most: most - 1 },
                    });
                }
                seen.first().map_or(Ok(()), |o| extent.take(o))?;
                Ok(t_s)
            });
            let Some(t_s) = parsed.map_err(|error| lines.error(error))? else { continue };
            largest = seen.iter().map(|o| o.word).fold(largest, u32::max);
            words += seen.len() as u64;
            if in_time {
                marks.push(Mark { t_s, offset, number });
            }
        }
        if words == 0 {
            return Err(UserError::file(path, "there are no words; lines are t,x,y,z,w1,w2,..."));
        }
        let is_sorted = marks.is_sorted_by(|a, b| a.t_s <= b.t_s);
        marks.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        let marks_len = marks.len();
        Ok(Self {
            lines: Lines::open(path)?,
            vocabulary: vocabulary.unwrap_or(largest + 1),
            order: (!is_sorted).then(|| marks.into_iter()),
            marks: (0, marks_len),
            in_time,
            begun,
            ahead: None,
        })
    }

    /// The next line with its time; none at the end.
    fn next_line(&mut self) -> Result<Option<(f64, Vec<Observation>)>, UserError> {
        if let Some(ahead) = self.ahead.take() {
            return Ok(Some(ahead));
        }
        loop {
            if let Some(order) = &mut self.order {
                let Some(mark) = order.next() else { return Ok(None) };
                self.marks.0 += 1;
                self.lines.seek(mark.offset, mark.number)?;
            }
            let Some(line) = self.lines.next()? else { return Ok(None) };
            let mut seen = Vec::new();
            let first = line.number == self.begun;
            match parse(line.text, first, &mut seen).map_err(|error| self.lines.error(error))? {
                Some(t_s) => return Ok(Some((t_s, seen))),
                None => continue,
            }
        }
    }

    fn done(&self) -> f64 {
        match self.order {
            Some(_) => self.marks.0 as f64 / self.marks.1.max(1) as f64,
            None => self.lines.done(),
        }
    }
}

impl WordSource for WordsFile {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        let Some((t_s, mut observations)) = self.next_line()? else { return Ok(None) };
        while observations.len() < MAX_WORDS {
            let Some((later_s, more)) = self.next_line()? else { break };
            if self.in_time && later_s != t_s {
                self.ahead = Some((later_s, more));
                break;
            }
            observations.extend(more);
        }
        Ok(Some(Sighting { t_s, observations, image: Default::default(), done: self.done() }))
    }
}

/// What is wrong in a line of words or of poses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum LineFault {
    #[error(transparent)]
    Number(#[from] NumberFault),
    #[error("class is missing")]
    NoClass,
    #[error("more than x,y,z,class")]
    Long,
    #[error("word id {0:?} is no whole number from 0")]
    WordId(String),
    #[error("word id {word}: --vocabulary-size is {size}")]
    NotInVocabulary { word: u32, size: u32 },
    #[error("word id {word}: ids go up to {most}")]
    HighWordId { word: u32, most: u32 },
    #[error("the position is more than 2^30 cells from the origin")]
    Far,
    #[error(transparent)]
    Extent(#[from] LargeExtent),
}

/// Reads a line; `None` if it names the columns.
fn parse(text: &str, first: bool, seen: &mut Vec<Observation>) -> Result<Option<f64>, LineFault> {
    seen.clear();
    let mut fields = text.split(',');
    if first && text.starts_with('t') {
        return Ok(None);
    }
    let t_s = finite_number(fields.next(), "t")?;
    let (x, y) = (finite_number(fields.next(), "x")?, finite_number(fields.next(), "y")?);
    let z = finite_number(fields.next(), "z")?;
    for field in fields {
        let word = field.trim().parse().map_err(|_| LineFault::WordId(field.trim().to_owned()))?;
        seen.push(Observation { word, x, y, z });
    }
    Ok(Some(t_s))
}

/// Bounds of the cells that hold the words.
struct Extent {
    cell_m: [f64; 3],
    limits: Option<[i64; 4]>,
}

impl Extent {
    fn new(cell_m: [f64; 3]) -> Self {
        Self { cell_m, limits: None }
    }

    fn take(&mut self, seen: &Observation) -> Result<(), LineFault> {
        let coord = coord_of([seen.x, seen.y, seen.z], self.cell_m);
        let [x, y, _] = coord.ok_or(LineFault::Far)?.map(i64::from);
        let [west, south, east, north] = self.limits.unwrap_or([x, y, x, y]);
        let limits = [west.min(x), south.min(y), east.max(x), north.max(y)];
        rectangle(limits[0], limits[1], limits[2], limits[3])?;
        self.limits = Some(limits);
        Ok(())
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, text: &str, vocabulary: Option<u32>, in_time: bool) -> Result<WordsFile, UserError> {
        let path = std::env::temp_dir().join(format!("scenecast-{}-{name}.csv", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let opened = WordsFile::open(&path, vocabulary, [1.0; 3], in_time);
        std::fs::remove_file(&path).unwrap();
        opened
    }

    fn sightings(file: &mut WordsFile) -> Vec<(f64, Vec<u32>)> {
        let mut all = Vec::new();
        while let Some(s) = file.next().unwrap() {
            all.push((s.t_s, s.observations.iter().map(|o| o.word).collect()));
        }
        all
    }

    #[test]
    fn words_are_returned_in_order_of_time() {
        let text = "# words\nt,x,y,z,w1\n# later\n2,0,0,0,5,6\n\n1,0,0,0,7\r\n2,1,0,-3,8\n1,5,5,5\n";
        let mut file = open("order", text, None, true).unwrap();
        assert_eq!(sightings(&mut file), [(1.0, vec![7]), (2.0, vec![5, 6, 8])]);
        assert_eq!((file.vocabulary, file.done()), (9, 1.0));
        let mut file = open("batch", text, Some(10), false).unwrap();
        assert_eq!(sightings(&mut file), [(2.0, vec![5, 6, 7, 8])]);
        assert_eq!(file.vocabulary, 10);
    }

    #[test]
    fn a_wrong_line_is_refused_with_its_number_and_cause() {
        let refusal = |text: &str| open("wrong", text, Some(9), true).err().unwrap().to_string();
        for (line, expected) in [
            ("1,nan,0,0,1", ":2: x = nan: it takes a finite number"),
            ("1,0,inf,0,1", ":2: y = inf"),
            ("1,0,0", ":2: z is missing"),
            ("1,0,0,0,9", ":2: word id 9: --vocabulary-size is 9"),
            ("1,0,0,0,-1", ":2: word id \"-1\" is no whole number"),
            ("1,0,0,0,", ":2: word id \"\" is no whole number"),
            ("1,1e300,0,0,1", ":2: the position is more than"),
            ("1,100000,100000,0,1", ":2: the map would reach over 100001 x 100001 cells"),
            ("t,0,0,0,1", ":2: t = \"t\" is no number"),
        ] {
            let error = refusal(&format!("0,0,0,0,1\n{line}\n"));
            assert!(error.contains(expected), "{error}");
        }
        for empty in ["", "\n\n", "t,x,y,z\n", "1,0,0,0\n"] {
            assert!(refusal(empty).contains("there are no words"), "{empty:?}");
        }
    }
}
