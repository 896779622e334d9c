//! `tuning.csv`: one line a setting, whole at any time.

use super::grid::Setting;
use super::measure::Measurement;
use crate::picture::write_whole;
use crate::problem::Problem;
use std::path::{Path, PathBuf};

const HEAD: &str = "inputs,cell_m,alpha,beta,gamma,mutual_information_nats,normalised_mutual_information,\
null_mutual_information_nats,mosaic_mutual_information_nats,labels,map_bytes,stream_bps";

/// A setting with its figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) setting: Setting,
    pub(super) measurement: Measurement,
}

/// The rows so far, by setting.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    /// Fingerprint of everything but the setting that the figures depend on.
    inputs: String,
    rows: Vec<Row>,
}

impl Table {
    /// The table of an earlier run with the same inputs, or an empty one.
    pub(super) fn open(path: &Path, inputs: String) -> Result<Self, Problem> {
        let mut table = Self { path: path.to_owned(), inputs, rows: Vec::new() };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(table),
            Err(e) => return Err(Problem::file(path, e)),
        };
        table.read(&text).map_err(|(line, what)| Problem::Input(format!("{}:{line}: {what}", path.display())))?;
        Ok(table)
    }

    fn read(&mut self, text: &str) -> Result<(), (usize, String)> {
        let mut lines = text.lines().enumerate();
        if lines.next().is_none_or(|(_, head)| head != HEAD) {
            return Err((1, "not a table that scenecast tune has written; give another --out".to_owned()));
        }
        for (index, line) in lines {
            let fields: Vec<&str> = line.split(',').collect();
            if fields[0] != self.inputs {
                let what = "was measured with another mosaic, annotations or options than this run's";
                return Err((index + 1, format!("{what}; give those again, or another --out")));
            }
            let row = parse(&fields).ok_or_else(|| (index + 1, "no line of this table; delete it".to_owned()))?;
            self.insert(row);
        }
        Ok(())
    }

    pub(super) fn has(&self, setting: &Setting) -> bool {
        self.rows.iter().any(|row| row.setting == *setting)
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Takes a measurement in and writes the table.
    pub(super) fn add(&mut self, setting: Setting, measurement: Measurement) -> Result<(), Problem> {
        self.insert(Row { setting, measurement });
        write_whole(&self.path, self.text().as_bytes())
    }

    fn insert(&mut self, row: Row) {
        let key = |row: &Row| [row.setting.cell_m, row.setting.alpha, row.setting.beta, row.setting.gamma];
        let place = self.rows.partition_point(|other| key(other) < key(&row));
        if self.rows.get(place).is_none_or(|other| other.setting != row.setting) {
            self.rows.insert(place, row);
        }
    }

    fn text(&self) -> String {
        let mut text = format!("{HEAD}\n");
        for Row { setting, measurement } in &self.rows {
            let Setting { cell_m, alpha, beta, gamma } = setting;
            let Measurement {
                mutual_information_nats: mi,
                normalised_mutual_information: nmi,
                null_mutual_information_nats: null,
                mosaic_mutual_information_nats: mosaic,
                labels,
                map_bytes,
                stream_bps,
            } = measurement;
            let inputs = &self.inputs;
            text.push_str(&format!("{inputs},{cell_m},{alpha},{beta},{gamma},{mi:.6},{nmi:.6},{null:.6},{mosaic:.6}"));
            text.push_str(&format!(",{labels},{map_bytes},{stream_bps:.3}\n"));
        }
        text
    }
}

fn parse(fields: &[&str]) -> Option<Row> {
    let [_, cell_m, alpha, beta, gamma, mi, nmi, null, mosaic, labels, map_bytes, stream_bps] = *fields else {
        return None;
    };
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    Some(Row {
        setting: Setting { cell_m: number(cell_m)?, alpha: number(alpha)?, beta: number(beta)?, gamma: number(gamma)? },
        measurement: Measurement {
            mutual_information_nats: number(mi)?,
            normalised_mutual_information: number(nmi)?,
            null_mutual_information_nats: number(null)?,
            mosaic_mutual_information_nats: number(mosaic)?,
            labels: labels.parse().ok()?,
            map_bytes: map_bytes.parse().ok()?,
            stream_bps: number(stream_bps)?,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(inputs: &str) -> Table {
        Table { path: PathBuf::new(), inputs: inputs.to_owned(), rows: Vec::new() }
    }

    fn filled() -> Table {
        let mut table = table("0123");
        for alpha in [1.0, 0.001, 1e-9] {
            let measurement = Measurement {
                mutual_information_nats: 0.25,
                normalised_mutual_information: 0.125,
                null_mutual_information_nats: 0.0625,
                mosaic_mutual_information_nats: 1.5,
                labels: 16,
                map_bytes: 2100,
                stream_bps: 812.5,
            };
            let setting = Setting { cell_m: 0.25, alpha, beta: 0.1, gamma: 1e-5 };
            table.insert(Row { setting, measurement });
        }
        table
    }

    #[test]
    fn a_table_comes_back_from_its_text() {
        let (before, mut after) = (filled(), table("0123"));
        after.read(&before.text()).unwrap();
        assert_eq!(after.rows, before.rows);
        assert!(after.has(&before.rows[1].setting));
        assert_eq!(after.text(), before.text());
    }

    #[test]
    fn lines_of_other_inputs_and_strange_files_are_refused_with_their_line() {
        let text = filled().text();
        let refused = |inputs: &str, text: &str| table(inputs).read(text).unwrap_err();
        assert_eq!(refused("4567", &text).0, 2);
        assert_eq!(refused("0123", "x,y\n").0, 1);
        assert_eq!(refused("0123", &text.replacen("0.25,1,", "0.25,one,", 1)).0, 4);
        assert_eq!(refused("0123", "").0, 1);
    }
}
