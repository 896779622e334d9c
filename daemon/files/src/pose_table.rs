//! Rows of a table of poses, by the names of their columns.

use scenecast_sensors::{Stamp, Times, reachable};
use std::path::{Component, Path, PathBuf};

/// A fault in a table of poses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum PoseTableError {
    #[error("no column {0}")]
    NoColumn(&'static str),
    #[error("two columns {name}, the columns {first} and {second}")]
    TwoColumns { name: &'static str, first: usize, second: usize },
    #[error("the row has {found} fields; the first line names {expected} columns")]
    Fields { found: usize, expected: usize },
    #[error("{0} is missing")]
    Missing(&'static str),
    #[error("{name} is {text:?}; expected {expected}")]
    Text { name: &'static str, text: String, expected: &'static str },
    #[error("{name} is {value}; expected {expected}")]
    Range { name: &'static str, value: f64, expected: &'static str },
}

impl PoseTableError {
    pub(crate) fn text(name: &'static str, text: &str, expected: &'static str) -> Self {
        Self::Text { name, text: text.to_owned(), expected }
    }
}

/// Where the wanted columns are in a row.
pub(crate) struct Columns {
    wanted: [(&'static str, usize); 6],
    scale: Option<usize>,
    /// All columns of the table.
    count: usize,
}

impl Columns {
    /// Where the wanted columns are, and `scale` if there is one.
    ///
    /// # Errors
    /// A column that is missing, or is there twice.
    pub(crate) fn find(names: &csv::StringRecord, wanted: &[&'static str; 6]) -> Result<Self, PoseTableError> {
        let place = |name| {
            let mut places = names.iter().enumerate().filter(|(_, other)| *other == name).map(|(place, _)| place);
            match (places.next(), places.next()) {
                (Some(one), Some(other)) => Err(PoseTableError::TwoColumns { name, first: one + 1, second: other + 1 }),
                (one, _) => Ok(one),
            }
        };
        let mut found = wanted.map(|name| (name, 0));
        for (name, at) in &mut found {
            *at = place(name)?.ok_or(PoseTableError::NoColumn(name))?;
        }
        Ok(Self { wanted: found, scale: place("scale")?, count: names.len() })
    }
}

/// A row of poses whose place is compared with those before.
pub(crate) struct Placed<T> {
    /// File and line, for people.
    pub(crate) line: u64,
    pub(crate) t_s: f64,
    /// The place: metres east and north of the table's origin.
    pub(crate) at: [f64; 2],
    pub(crate) content: T,
}

/// Leaves out the rows whose places no vehicle can reach from those before, and says so. If they are half of all, the table is of another
/// kind, and all are taken.
pub(crate) fn reachable_rows<T>(path: &Path, rows: Vec<Placed<T>>, times: Times) -> (Vec<T>, Option<String>) {
    let place = |row: &usize| (Stamp::from_nanos((rows[*row].t_s * 1e9).round() as i64), rows[*row].at);
    let (_, left_out) = reachable(0..rows.len(), times, place);
    let (count, all) = (left_out.len(), rows.len());
    let Some(first) = left_out.first().map(|row| &rows[*row]) else {
        return (rows.into_iter().map(|row| row.content).collect(), None);
    };
    let [east, north] = first.at;
    let first = format!("{}:{}: [{east:.1}, {north:.1}] m", path.display(), first.line);
    if 2 * count >= all {
        let note = format!(
            "no vehicle can reach {count} of {all} places from the one before, the first: {first}; all are used: check times and units"
        );
        return (rows.into_iter().map(|row| row.content).collect(), Some(note));
    }
    let note = format!(
        "{count} of {all} poses are left out, because no vehicle can reach their place from the one before, the first: {first}"
    );
    let kept = rows
        .into_iter()
        .enumerate()
        .filter(|(row, _)| left_out.binary_search(row).is_err())
        .map(|(_, row)| row.content);
    (kept.collect(), Some(note))
}

#[derive(Clone, Copy)]
pub(crate) struct PoseRow<'a> {
    columns: &'a Columns,
    fields: &'a csv::StringRecord,
}

impl<'a> PoseRow<'a> {
    /// A row that has a field for each column: with another number, as of a comma too many, its numbers would be those of other columns.
    pub(crate) fn new(columns: &'a Columns, fields: &'a csv::StringRecord) -> Result<Self, PoseTableError> {
        let (found, expected) = (fields.len(), columns.count);
        if found == expected { Ok(Self { columns, fields }) } else { Err(PoseTableError::Fields { found, expected }) }
    }

    pub(crate) fn text(self, name: &'static str) -> Result<&'a str, PoseTableError> {
        let place = self.columns.wanted.iter().find(|(column, _)| *column == name).map(|(_, place)| *place);
        let text = place.and_then(|place| self.fields.get(place)).filter(|text| !text.is_empty());
        text.ok_or(PoseTableError::Missing(name))
    }

    /// A file of the folder or of a folder below it.
    pub(crate) fn file(self, dir: &Path) -> Result<PathBuf, PoseTableError> {
        let text = self.text("file")?;
        let is_inside =
            Path::new(text).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        let inside = is_inside.then(|| dir.join(text));
        inside.ok_or_else(|| PoseTableError::text("file", text, "a file below the folder"))
    }

    pub(crate) fn depth_m(self) -> Result<f64, PoseTableError> {
        self.number_in("depth_m", |depth_m| depth_m >= 0.0, "0 or more, downwards")
    }

    /// The scale of a table in metres, in which it may be missing.
    pub(crate) fn scale(self) -> Result<f64, PoseTableError> {
        let Some(text) = self.columns.scale.and_then(|place| self.fields.get(place)) else { return Ok(1.0) };
        let value = text.parse::<f64>().ok().filter(|value| (1e-3..=1e3).contains(value));
        value.ok_or_else(|| PoseTableError::text("scale", text, "0.001 to 1000"))
    }

    pub(crate) fn number(self, name: &'static str) -> Result<f64, PoseTableError> {
        let text = self.text(name)?;
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| PoseTableError::text(name, text, "a finite number"))
    }

    /// A number for which `is_allowed` holds.
    pub(crate) fn number_in(
        self,
        name: &'static str,
        is_allowed: impl Fn(f64) -> bool,
        expected: &'static str,
    ) -> Result<f64, PoseTableError> {
        let value = self.number(name)?;
        if is_allowed(value) { Ok(value) } else { Err(PoseTableError::Range { name, value, expected }) }
    }
}
