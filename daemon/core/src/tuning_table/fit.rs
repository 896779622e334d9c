//! The most informative setting whose stream fits a budget, and the trade-off.

use super::table::{Row, TuningTable};

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

#[cfg(test)]
pub(super) mod tests {
    use super::super::table::{Measurement, Setting};
    use super::*;
    use proptest::prelude::*;
    use scenecast_protocol::directive::CellBand;

    pub(in super::super) fn row(alpha: f64, mutual_information_nats: f64, stream_bps: f64) -> Row {
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
}
