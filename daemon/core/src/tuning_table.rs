//! Measured information and bit rate of settings of the scene model: the table of `scenecast tune`, and the most informative
//! setting that fits a budget.

use crate::UserError;
use scenecast_protocol::directive::CellBand;
use std::fmt;

/// The setting that fits a budget, the best setting, and the one with the lowest rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The budget of the stream, bit/s.
    pub bits_per_s: f64,
    /// The setting with the highest mutual information within the budget; `None` if no setting fits.
    pub chosen: Option<Row>,
    /// The setting with the highest mutual information.
    pub best: Row,
    /// The setting with the lowest rate.
    pub lowest_rate: Row,
}

/// The table has no setting for cells of this size.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the tuning table has settings for cells of {sizes} and none for those of {cell_m} m; make one with scenecast tune and name it in scene.tuning_table"
)]
pub struct NoRow {
    cell_m: f64,
    sizes: String,
}

impl TuningTable {
    /// The setting with the highest mutual information whose stream takes at most `bits_per_s`, among those for cells of `cell_m`
    /// metres. Of two equal ones, the one with the lower rate.
    pub fn fit(&self, cell_m: f64, bits_per_s: f64) -> Result<Fit, NoRow> {
        let rows = || self.rows().filter(|row| (row.setting.cell_m / cell_m - 1.0).abs() < 0.005);
        let (Some(best), Some(lowest_rate)) = (most(rows()), least(rows())) else {
            return Err(NoRow { cell_m, sizes: self.sizes() });
        };
        let chosen = most(rows().filter(|row| row.measurement.stream_bps <= bits_per_s));
        Ok(Fit { bits_per_s, chosen: chosen.copied(), best: *best, lowest_rate: *lowest_rate })
    }

    fn sizes(&self) -> String {
        let mut sizes: Vec<String> = self.rows().map(|row| format!("{} m", row.setting.cell_m)).collect();
        sizes.dedup();
        if sizes.is_empty() { "no size".to_owned() } else { sizes.join(", ") }
    }
}

/// The row with the highest mutual information. Of two equal ones, the one with the lower rate.
pub fn most<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<&'a Row> {
    let key = |row: &Row| (row.measurement.mutual_information_nats, -row.measurement.stream_bps);
    rows.max_by(|a, b| {
        let ((a, lean), (b, leaner)) = (key(a), key(b));
        a.total_cmp(&b).then(lean.total_cmp(&leaner))
    })
}

/// The row with the lowest rate.
pub fn least<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<&'a Row> {
    rows.min_by(|a, b| a.measurement.stream_bps.total_cmp(&b.measurement.stream_bps))
}

impl Fit {
    /// The loss in comparison with the best setting, or that no setting fits; one line for people.
    pub fn trade_off(&self) -> String {
        let (best, lowest_rate) = (&self.best.measurement, &self.lowest_rate.measurement);
        match &self.chosen {
            None => format!(
                "no setting fits {}: the lowest rate is {}, {} below the best",
                rate(self.bits_per_s),
                rate(lowest_rate.stream_bps),
                self.loss(&self.lowest_rate)
            ),
            Some(row) if row == &self.best => "no trade-off: these are the most informative settings".to_owned(),
            Some(row) => format!(
                "{}: {} below the best, which needs {}",
                differences(row, &self.best),
                self.loss(row),
                rate(best.stream_bps)
            ),
        }
    }

    /// The loss of mutual information in comparison with the best setting, nats.
    pub fn lost_nats(&self, row: &Row) -> f64 {
        (self.best.measurement.mutual_information_nats - row.measurement.mutual_information_nats).max(0.0)
    }

    fn loss(&self, row: &Row) -> String {
        let (lost, of) = (self.lost_nats(row), self.best.measurement.mutual_information_nats);
        format!("{lost:.2} nats ({:.0} %)", if of > 0.0 { 100.0 * lost / of } else { 0.0 })
    }
}

/// The differences from the best setting.
fn differences(row: &Row, best: &Row) -> String {
    let mut less = Vec::new();
    if row.setting.cells != best.setting.cells {
        less.push(if best.setting.cells as u8 <= row.setting.cells as u8 { "coarser cells" } else { "finer cells" });
    }
    let (labels, most) = (row.measurement.labels, best.measurement.labels);
    if labels != most {
        less.push(if labels < most { "fewer labels" } else { "more labels" });
    }
    if row.setting.frames_per_s < best.setting.frames_per_s {
        less.push("fewer camera frames");
    }
    if row.setting.refine_words_per_s < best.setting.refine_words_per_s {
        less.push("less refinement");
    }
    if less.is_empty() { "other priors".to_owned() } else { less.join(", ") }
}

fn rate(bits_per_s: f64) -> String {
    if bits_per_s < 1000.0 { format!("{bits_per_s:.0} bit/s") } else { format!("{:.1} kbit/s", bits_per_s / 1000.0) }
}

/// The first line. A change of the columns is another version.
const TITLE: &str = "# scenecast tuning table 3";
const HEAD: &str = "inputs,cell_m,alpha,beta,gamma,max_labels,refine_words_per_s,frames_per_s,cells,mutual_information_nats,\
normalised_mutual_information,null_mutual_information_nats,mosaic_mutual_information_nats,labels,map_bytes,stream_bps";
/// Most lines that are read.
const MAX_ROWS: usize = 100_000;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Edge of a cell of the model, metres.
    pub cell_m: f64,
    /// Preference for topics that are used elsewhere; 0 for this one and those below where labels are habitats.
    pub alpha: f64,
    /// Prior weight of each word in a topic.
    pub beta: f64,
    /// Weight of a new topic.
    pub gamma: f64,
    /// Most labels at one time.
    pub max_labels: u32,
    /// Words resampled a second of mission time; 0 where labels are habitats.
    pub refine_words_per_s: f64,
    /// Camera frames a second that the scene model sees.
    pub frames_per_s: f64,
    /// The published cells: fine or coarse.
    pub cells: CellBand,
}

impl Setting {
    /// Whether labels are habitats, which the priors of the topics do not change.
    pub fn is_of_habitats(&self) -> bool {
        self.alpha == 0.0
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cell_m, alpha, beta, gamma, max_labels, refine_words_per_s, frames_per_s, cells } = self;
        write!(f, "cell_m {cell_m}, ")?;
        if !self.is_of_habitats() {
            write!(f, "alpha {alpha}, beta {beta}, gamma {gamma}, {refine_words_per_s} words/s, ")?;
        }
        write!(f, "at most {max_labels} labels, {frames_per_s} frames/s, {} cells", cells.name())
    }
}

/// The figures of one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Of map labels and annotated classes, nats.
    pub mutual_information_nats: f64,
    /// Divided by the geometric mean of both entropies.
    pub normalised_mutual_information: f64,
    /// Mean of the map flipped and shifted, nats.
    pub null_mutual_information_nats: f64,
    /// Of map labels and the mosaic's colours, nats.
    pub mosaic_mutual_information_nats: f64,
    /// Different labels in the final map.
    pub labels: usize,
    /// Bytes of all chunks that code the final map against an empty one.
    pub map_bytes: usize,
    /// Bits of all chunks of the survey over its time.
    pub stream_bps: f64,
}

/// A setting with its figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    pub setting: Setting,
    pub measurement: Measurement,
}

/// A text that is no table: the line, counted from 1, and its fault.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{line}: {fault}")]
pub struct TableError {
    line: usize,
    fault: TableFault,
}

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum TableFault {
    #[error("not a table of this version of scenecast tune, which begins with \"{TITLE}\"")]
    Title,
    #[error("has other columns than {HEAD}")]
    Columns,
    #[error("more than {MAX_ROWS} lines")]
    TooManyRows,
    #[error("{found} fields; the table has {expected}")]
    Fields { found: usize, expected: usize },
    #[error("{column} {text:?}: it takes {low} to {high}")]
    Range { column: &'static str, text: String, low: f64, high: f64 },
    #[error("cells {0:?}: it takes fine or coarse")]
    Cells(String),
    #[error("alpha, beta and gamma: they take 0 each, or at least 1e-9, 1e-9 and 1e-12")]
    Priors,
}

/// Settings with their figures, none twice, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TuningTable {
    /// The conditions under which each row was measured.
    rows: Vec<(String, Row)>,
}

impl TuningTable {
    /// The table that ships: procedural sea floors, surveyed as configured by default.
    pub fn shipped() -> Self {
        // A test reads it; were it ever wrong, there would be nothing to fit.
        Self::read(include_str!("tuning_table/default.csv")).unwrap_or_default()
    }

    /// Reads the text of `file`.
    ///
    /// # Errors
    /// The file, the line and the fault; a table without a row.
    pub fn parse(file: &str, text: &str) -> Result<Self, UserError> {
        let table = Self::read(text).map_err(|error| UserError::Input(format!("{file}:{error}")))?;
        if table.rows.is_empty() {
            return Err(UserError::Input(format!("{file}: the table has no line; scenecast tune writes them")));
        }
        Ok(table)
    }

    /// Reads the text of a table.
    pub fn read(text: &str) -> Result<Self, TableError> {
        let refused = |line, fault| TableError { line, fault };
        let mut lines = text.lines().enumerate();
        if lines.next().is_none_or(|(_, title)| title.trim_end() != TITLE) {
            return Err(refused(1, TableFault::Title));
        }
        if lines.next().is_none_or(|(_, head)| head.trim_end() != HEAD) {
            return Err(refused(2, TableFault::Columns));
        }
        let mut table = Self::default();
        for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let (inputs, row) = parse(line).map_err(|fault| refused(index + 1, fault))?;
            table.insert(inputs, row);
            if table.rows.len() > MAX_ROWS {
                return Err(refused(index + 1, TableFault::TooManyRows));
            }
        }
        Ok(table)
    }

    pub fn text(&self) -> String {
        let lines = self.rows.iter().map(|(inputs, row)| line(inputs, row));
        format!("{TITLE}\n{HEAD}\n{}", lines.collect::<String>())
    }

    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().map(|(_, row)| row)
    }

    /// The first line of the text whose figures were measured with other inputs than these.
    pub fn line_of_others(&self, inputs: &str) -> Option<usize> {
        self.rows.iter().position(|(own, _)| own != inputs).map(|at| at + 3)
    }

    /// Whether it has a row of a setting.
    pub fn has(&self, setting: &Setting) -> bool {
        self.rows().any(|row| row.setting == *setting)
    }

    /// Takes a row in, unless there is one of this setting.
    pub fn insert(&mut self, inputs: String, row: Row) {
        let key = |row: &Row| {
            let Setting { cell_m, alpha, beta, gamma, max_labels, refine_words_per_s, frames_per_s, cells } =
                row.setting;
            [cell_m, alpha, beta, gamma, max_labels.into(), refine_words_per_s, frames_per_s, cells as u8 as f64]
        };
        let place = self.rows.partition_point(|(_, other)| key(other) < key(&row));
        if self.rows.get(place).is_none_or(|(_, other)| other.setting != row.setting) {
            self.rows.insert(place, (inputs, row));
        }
    }
}

fn line(inputs: &str, Row { setting, measurement: m }: &Row) -> String {
    let Setting { cell_m, alpha, beta, gamma, max_labels, refine_words_per_s, frames_per_s, cells } = setting;
    let cells = cells.name();
    let of_setting =
        format!("{cell_m},{alpha},{beta},{gamma},{max_labels},{refine_words_per_s},{frames_per_s},{cells}");
    let (mi, nmi) = (m.mutual_information_nats, m.normalised_mutual_information);
    let (null, mosaic) = (m.null_mutual_information_nats, m.mosaic_mutual_information_nats);
    let told = format!("{mi:.6},{nmi:.6},{null:.6},{mosaic:.6},{},{},{:.3}", m.labels, m.map_bytes, m.stream_bps);
    format!("{inputs},{of_setting},{told}\n")
}

fn parse(line: &str) -> Result<(String, Row), TableFault> {
    let fields: Vec<&str> = line.trim_end().split(',').collect();
    let names: Vec<&'static str> = HEAD.split(',').collect();
    if fields.len() != names.len() {
        return Err(TableFault::Fields { found: fields.len(), expected: names.len() });
    }
    let number = |at: usize, low: f64, high: f64| {
        let value = fields[at].parse::<f64>().ok().filter(|value| (low..=high).contains(value));
        value.ok_or_else(|| TableFault::Range { column: names[at], text: fields[at].to_owned(), low, high })
    };
    let band = CellBand::from_name(fields[8]).filter(|&band| band != CellBand::CoarseToFine);
    let setting = Setting {
        cell_m: number(1, 1e-6, 1e3)?,
        alpha: number(2, 0.0, 1e3)?,
        beta: number(3, 0.0, 1e3)?,
        gamma: number(4, 0.0, 1e3)?,
        max_labels: number(5, 2.0, 254.0)? as u32,
        refine_words_per_s: number(6, 0.0, 1e8)?,
        frames_per_s: number(7, 0.01, 30.0)?,
        cells: band.ok_or_else(|| TableFault::Cells(fields[8].to_owned()))?,
    };
    let Setting { alpha, beta, gamma, .. } = setting;
    let is_of_topics = alpha >= 1e-9 && beta >= 1e-9 && gamma >= 1e-12;
    if !is_of_topics && [alpha, beta, gamma] != [0.0; 3] {
        return Err(TableFault::Priors);
    }
    let measurement = Measurement {
        mutual_information_nats: number(9, 0.0, 1e3)?,
        normalised_mutual_information: number(10, 0.0, 1.000_001)?,
        null_mutual_information_nats: number(11, 0.0, 1e3)?,
        mosaic_mutual_information_nats: number(12, 0.0, 1e3)?,
        labels: number(13, 0.0, 1e6)? as usize,
        map_bytes: number(14, 0.0, 1e12)? as usize,
        stream_bps: number(15, 0.0, 1e12)?,
    };
    Ok((fields[0].to_owned(), Row { setting, measurement }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use scenecast_protocol::directive::CellBand;

    fn row(alpha: f64, mutual_information_nats: f64, stream_bps: f64) -> Row {
        let setting = Setting {
            cell_m: 0.25,
            alpha,
            beta: 0.1,
            gamma: 1e-5,
            max_labels: 16,
            refine_words_per_s: 50_000.0,
            frames_per_s: 0.5,
            cells: CellBand::Fine,
        };
        let measurement = Measurement {
            mutual_information_nats,
            normalised_mutual_information: 0.125,
            null_mutual_information_nats: 0.0625,
            mosaic_mutual_information_nats: 1.5,
            labels: 9,
            map_bytes: 2100,
            stream_bps,
        };
        Row { setting, measurement }
    }

    fn table(rows: impl IntoIterator<Item = Row>) -> TuningTable {
        let mut table = TuningTable::default();
        rows.into_iter().for_each(|row| table.insert(String::new(), row));
        table
    }

    /// The best, a lean one with fewer labels, one that is worse in all, and one with coarse cells.
    fn known() -> TuningTable {
        let mut few = row(0.1, 0.28, 700.0);
        few.measurement.labels = 5;
        let mut coarse = row(0.01, 0.2, 90.0);
        (coarse.setting.cells, coarse.setting.frames_per_s) = (CellBand::Coarse, 0.1);
        table([row(1.0, 0.3, 14_000.0), few, row(0.001, 0.25, 800.0), coarse])
    }

    #[test]
    fn the_best_row_within_the_budget_is_chosen_with_its_loss() {
        let fit = |bits_per_s| known().fit(0.25, bits_per_s).unwrap();
        let alpha = |fit: &Fit| fit.chosen.map(|row| row.setting.alpha);
        assert_eq!(alpha(&fit(14_000.0)), Some(1.0));
        assert_eq!(fit(14_000.0).trade_off(), "no trade-off: these are the most informative settings");
        assert_eq!(alpha(&fit(13_999.0)), Some(0.1));
        assert_eq!(fit(5000.0).trade_off(), "fewer labels: 0.02 nats (7 %) below the best, which needs 14.0 kbit/s");
        let lean = fit(100.0);
        assert_eq!(alpha(&lean), Some(0.01));
        let said = "coarser cells, fewer camera frames: 0.10 nats (33 %) below the best, which needs 14.0 kbit/s";
        assert_eq!(lean.trade_off(), said);
    }

    #[test]
    fn where_no_setting_fits_the_lowest_rate_is_named() {
        let fit = known().fit(0.25, 50.0).unwrap();
        assert_eq!((fit.chosen, fit.lowest_rate.setting.alpha), (None, 0.01));
        assert_eq!(
            fit.trade_off(),
            "no setting fits 50 bit/s: the lowest rate is 90 bit/s, 0.10 nats (33 %) below the best"
        );
    }

    #[test]
    fn settings_for_other_cells_are_not_offered() {
        assert!(known().fit(0.2505, 1e4).is_ok());
        let why = known().fit(0.1, 1e4).unwrap_err().to_string();
        assert!(
            why.starts_with("the tuning table has settings for cells of 0.25 m and none for those of 0.1 m"),
            "{why}"
        );
        assert!(table([]).fit(0.25, 1e4).is_err());
    }

    #[test]
    fn of_equal_settings_the_smaller_stream_is_chosen() {
        let fit = table([row(1.0, 0.3, 900.0), row(0.1, 0.3, 700.0), row(0.01, 0.3, 800.0)]).fit(0.25, 1e4).unwrap();
        assert_eq!(fit.chosen.map(|row| row.setting.alpha), Some(0.1));
    }

    proptest! {
        #[test]
        fn no_setting_that_fits_has_more_information(
            rows in proptest::collection::vec((0.0f64..1.0, 1.0f64..1e4), 1..20), bits_per_s in 0.0f64..1.2e4,
        ) {
            let rows = rows.iter().enumerate().map(|(i, &(mi, stream))| row(1.0 + i as f64, mi, stream));
            let table = table(rows);
            let fit = table.fit(0.25, bits_per_s).unwrap();
            let told = fit.chosen.map_or(-1.0, |row| row.measurement.mutual_information_nats);
            prop_assert!(fit.chosen.is_none_or(|row| row.measurement.stream_bps <= bits_per_s));
            for row in table.rows().filter(|row| row.measurement.stream_bps <= bits_per_s) {
                prop_assert!(row.measurement.mutual_information_nats <= told);
            }
            prop_assert!(!fit.trade_off().is_empty());
        }
    }

    fn filled() -> TuningTable {
        let mut table = TuningTable::default();
        for alpha in [1.0, 0.001, 1e-9] {
            table.insert("0123".to_owned(), row(alpha, 0.25, 812.5));
        }
        table
    }

    #[test]
    fn a_table_comes_back_from_its_text() {
        let table = filled();
        assert_eq!(TuningTable::read(&table.text()), Ok(table.clone()));
        assert_eq!(table.rows().map(|row| row.setting.alpha).collect::<Vec<_>>(), [1e-9, 0.001, 1.0]);
        assert!(table.has(&row(0.001, 0.0, 0.0).setting));
        assert_eq!((table.line_of_others("0123"), table.line_of_others("4567")), (None, Some(3)));
        assert_eq!(TuningTable::read(&table.text().replace('\n', "\r\n")), Ok(table));
    }

    #[test]
    fn a_malformed_row_is_refused_with_its_line_and_the_rule() {
        let text = filled().text();
        let refused = |from: &str, to: &str| TuningTable::read(&text.replacen(from, to, 1)).unwrap_err();
        assert_eq!(refused("table 3", "table 4").line, 1);
        assert_eq!(refused("cells,", "").line, 2);
        assert_eq!(refused("0.25,1,", "0.25,one,").to_string(), "5: alpha \"one\": it takes 0 to 1000");
        assert_eq!(refused("0.25,1,", "0.25,NaN,").line, 5);
        assert_eq!(refused("0.25,1,", "0.25,0,").line, 5, "priors of topics without alpha");
        assert_eq!(refused("0.25,1,", "0.25,1e-10,").line, 5);
        assert_eq!(refused(",fine", ",huge").to_string(), "3: cells \"huge\": it takes fine or coarse");
        assert_eq!(refused(",fine", "").to_string(), "3: 15 fields; the table has 16");
        assert_eq!(TuningTable::read("").unwrap_err().line, 1);
    }

    #[test]
    fn the_table_that_ships_can_be_sent_as_it_stands() {
        use scenecast_protocol::directive::ShortDecimal;
        let table = TuningTable::shipped();
        assert!(table.rows().count() >= 16);
        for Row { setting: s, .. } in table.rows() {
            assert_eq!(ShortDecimal::new(s.frames_per_s).map(ShortDecimal::value), Some(s.frames_per_s), "{s}");
            assert!(s.is_of_habitats() && (2..=32).contains(&s.max_labels), "{s}");
        }
        let [fine, coarse] =
            [CellBand::Fine, CellBand::Coarse].map(|band| table.rows().filter(|row| row.setting.cells == band).count());
        assert!(fine > 0 && coarse > 0);
    }
}
