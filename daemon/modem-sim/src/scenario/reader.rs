//! Reading of a scenario's tables: every value with its place, range and unit, and no key unread.

use scenecast_core::UserError;
use std::cell::RefCell;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a scenario comes from, and its text.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// An error at a byte of the text, as `FILE:LINE: cause`.
    pub fn problem(&self, at: usize, what: impl Display) -> UserError {
        let line = self.text.get(..at).map_or(1, |before| before.matches('\n').count() + 1);
        UserError::Input(format!("{}:{line}: {what}", self.path.display()))
    }
}

/// One table, whose keys are asked for one by one.
pub struct Reader<'a> {
    source: Source<'a>,
    name: String,
    at: usize,
    table: &'a DeTable<'a>,
    known: RefCell<Vec<&'static str>>,
}

type Found<T> = Result<Option<T>, UserError>;

impl<'a> Reader<'a> {
    /// A table called `name` (empty for the whole file) that begins at a byte of the text.
    pub fn new(source: Source<'a>, name: String, at: usize, table: &'a DeTable<'a>) -> Self {
        Self { source, name, at, table, known: RefCell::new(Vec::new()) }
    }

    pub fn path(&self) -> &'a Path {
        self.source.path
    }

    /// Where the table begins, a byte of the text.
    pub fn start(&self) -> usize {
        self.at
    }

    /// The key as people write it.
    fn full(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    fn value(&self, key: &'static str) -> Option<(&'a Spanned<DeValue<'a>>, usize)> {
        self.known.borrow_mut().push(key);
        let found = self.table.iter().find(|(name, _)| name.get_ref() == key);
        found.map(|(name, value)| (value, name.span().start))
    }

    /// Refuses the value of a key.
    pub fn wrong(&self, key: &'static str, takes: impl Display) -> UserError {
        let at = self.value(key).map_or(self.at, |(_, at)| at);
        let given = self.value(key).map(|(value, _)| value.span());
        let given = given.and_then(|span| self.source.text.get(span)).unwrap_or("nothing");
        self.source.problem(at, format!("{} = {given} is not allowed: it takes {takes}", self.full(key)))
    }

    /// Refuses the table for want of a key.
    pub fn missing(&self, key: &'static str, takes: impl Display) -> UserError {
        self.source.problem(self.at, format!("{} is missing: it takes {takes}", self.full(key)))
    }

    /// A number within a range.
    pub fn number(&self, key: &'static str, range: RangeInclusive<f64>, unit: &str) -> Found<f64> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        let number = plain_number(value).filter(|number| range.contains(number));
        let takes = format!("a number from {} to {} {unit}", range.start(), range.end());
        number.map(Some).ok_or_else(|| self.wrong(key, takes.trim_end()))
    }

    /// A whole number within a range.
    pub fn whole(&self, key: &'static str, range: RangeInclusive<u64>, unit: &str) -> Found<u64> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        let number = match value.get_ref() {
            DeValue::Integer(i) => u64::from_str_radix(i.as_str(), i.radix()).ok(),
            _ => None,
        };
        let takes = format!("a whole number from {} to {} {unit}", range.start(), range.end());
        number.filter(|n| range.contains(n)).map(Some).ok_or_else(|| self.wrong(key, takes.trim_end()))
    }

    /// A text of at least one letter.
    pub fn text(&self, key: &'static str) -> Found<String> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) if !text.is_empty() => Ok(Some(text.to_string())),
            _ => Err(self.wrong(key, "text in quotes")),
        }
    }

    pub fn choice<T: Clone>(&self, key: &'static str, words: &[(&str, T)]) -> Found<T> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        let given = match value.get_ref() {
            DeValue::String(text) => words.iter().find(|(word, _)| word == text),
            _ => None,
        };
        let all: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        given.map(|(_, t)| Some(t.clone())).ok_or_else(|| self.wrong(key, format!("one of {}", all.join(", "))))
    }

    pub fn flag(&self, key: &'static str) -> Found<bool> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(flag) => Ok(Some(*flag)),
            _ => Err(self.wrong(key, "true or false")),
        }
    }

    /// `N` numbers within a range.
    pub fn numbers<const N: usize>(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> Found<[f64; N]> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        let takes = format!("{N} numbers from {} to {} {unit}", range.start(), range.end());
        row(value, &range).map(Some).ok_or_else(|| self.wrong(key, takes.trim_end()))
    }

    /// Rows of `N` numbers within a range.
    pub fn rows<const N: usize>(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        takes: &str,
    ) -> Found<Vec<[f64; N]>> {
        let Some((value, _)) = self.value(key) else { return Ok(None) };
        let rows = match value.get_ref() {
            DeValue::Array(rows) => rows.iter().map(|value| row(value, &range)).collect::<Option<Vec<_>>>(),
            _ => None,
        };
        rows.filter(|rows| !rows.is_empty()).map(Some).ok_or_else(|| self.wrong(key, takes))
    }

    /// A table in this one.
    pub fn table(&self, key: &'static str) -> Found<Reader<'a>> {
        let Some((value, at)) = self.value(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Table(table) => Ok(Some(Reader::new(self.source, self.full(key), at, table))),
            _ => Err(self.wrong(key, format!("a table, as in [{}]", self.full(key)))),
        }
    }

    /// All tables of that name.
    pub fn tables(&self, key: &'static str) -> Result<Vec<Reader<'a>>, UserError> {
        let Some((value, _)) = self.value(key) else { return Ok(Vec::new()) };
        let tables = match value.get_ref() {
            DeValue::Array(tables) => tables.iter().map(|value| self.entry(key, value)).collect::<Option<Vec<_>>>(),
            _ => None,
        };
        tables.ok_or_else(|| self.wrong(key, format!("tables, as in [[{}]]", self.full(key))))
    }

    fn entry(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Option<Reader<'a>> {
        match value.get_ref() {
            DeValue::Table(table) => Some(Reader::new(self.source, self.full(key), value.span().start, table)),
            _ => None,
        }
    }

    /// Refuses keys that nobody asked for.
    pub fn finish(self) -> Result<(), UserError> {
        let known = self.known.borrow();
        match self.table.iter().find(|(name, _)| !known.iter().any(|key| name.get_ref() == key)) {
            None => Ok(()),
            Some((name, _)) => {
                let mut known = known.clone();
                known.sort_unstable();
                known.dedup();
                let what =
                    format!("there is no key {} here; allowed are {}", self.full(name.get_ref()), known.join(", "));
                Err(self.source.problem(name.span().start, what))
            }
        }
    }
}

fn plain_number(value: &Spanned<DeValue<'_>>) -> Option<f64> {
    match value.get_ref() {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        DeValue::Float(f) => f.as_str().parse().ok(),
        _ => None,
    }
}

fn row<const N: usize>(value: &Spanned<DeValue<'_>>, range: &RangeInclusive<f64>) -> Option<[f64; N]> {
    let DeValue::Array(values) = value.get_ref() else { return None };
    let numbers: Option<Vec<f64>> =
        values.iter().map(|value| plain_number(value).filter(|number| range.contains(number))).collect();
    numbers?.try_into().ok()
}
