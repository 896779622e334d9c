//! The grid of settings to measure, and the best of them as a configuration file.

use scenecast_config::{Config, SceneLabels, cell_m};
use scenecast_core::UserError;
use scenecast_core::tuning_table::{Measurement, Row, Setting};
use scenecast_protocol::directive::CellBand;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use std::path::Path;

/// The values of each parameter.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Grid {
    /// Empty: those of the paper (ICRA 2019, section V.A), or none where labels are habitats.
    alpha: Vec<f64>,
    beta: Vec<f64>,
    gamma: Vec<f64>,
    /// Empty: 4, 6, 8, 11 and 16 where labels are habitats, else the configured number.
    max_labels: Vec<u32>,
    /// This list and those below: if empty, the configured value.
    cell_m: Vec<f64>,
    refine_words_per_s: Vec<f64>,
    frames_per_s: Vec<f64>,
    #[serde(deserialize_with = "bands")]
    cells: Vec<CellBand>,
}

/// Maximum number of settings of a grid.
const MAX_SETTINGS: usize = 100_000;

/// What is wrong in a file of settings to try; as text what follows the name of the file.
#[derive(Debug, PartialEq, thiserror::Error)]
enum GridFault {
    #[error(
        ":{line}: {} (it takes lists alpha, beta, gamma, max_labels, cell_m, refine_words_per_s, frames_per_s, cells)",
        error.message()
    )]
    Toml { line: usize, error: toml::de::Error },
    #[error(": {name} has {value}; it takes numbers from {low} to {high}")]
    Value { name: &'static str, value: f64, low: f64, high: f64 },
    #[error(": {0} settings; at most {MAX_SETTINGS} are allowed")]
    Many(usize),
}

impl Grid {
    /// The grid in a file; parameters that it does not name have their default values.
    pub fn load(path: Option<&Path>, config: &Config) -> Result<Self, UserError> {
        let mut grid = match path {
            None => Self::default(),
            Some(path) => {
                let text = scenecast_config::read_regular_text(path)?;
                Self::read(&text).map_err(|cause| UserError::Input(format!("{}{cause}", path.display())))?
            }
        };
        let no_effect = || {
            let cause = "alpha, beta, gamma and refine_words_per_s have no effect where scene.labels is habitats; set it to topics";
            UserError::Input(format!("{}: {cause}", path.unwrap_or(Path::new("the grid")).display()))
        };
        let is_of_habitats = config.scene.labels == SceneLabels::Habitats;
        let of_topics = [&mut grid.alpha, &mut grid.beta, &mut grid.gamma, &mut grid.refine_words_per_s];
        let paper = [&[1.0, 0.1, 0.01, 0.001][..], &[10.0, 1.0, 0.1], &[1e-3, 1e-4, 1e-5], &[]];
        for (values, paper) in of_topics.into_iter().zip(paper) {
            match (is_of_habitats, values.is_empty()) {
                (true, true) => values.push(0.0),
                (true, false) => return Err(no_effect()),
                (false, _) if values.is_empty() => values.extend(paper),
                (false, _) => {}
            }
        }
        if grid.max_labels.is_empty() {
            grid.max_labels = if is_of_habitats { vec![4, 6, 8, 11, 16] } else { vec![config.scene.max_labels] };
        }
        let every_frame = config.camera.rate_hz;
        let frames_per_s = if config.scene.frames_per_s > 0.0 { config.scene.frames_per_s } else { every_frame };
        let configured = [
            (&mut grid.cell_m, cell_m(config)),
            (&mut grid.refine_words_per_s, f64::from(config.scene.refine_words_per_s)),
            (&mut grid.frames_per_s, frames_per_s),
        ];
        for (values, value) in configured {
            if values.is_empty() {
                values.push(value);
            }
        }
        if grid.cells.is_empty() {
            grid.cells.push(config.map.cells.into());
        }
        Ok(grid)
    }

    fn read(text: &str) -> Result<Self, GridFault> {
        let mut grid: Self = toml::from_str(text).map_err(|error: toml::de::Error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            GridFault::Toml { line: before.map_or(1, |before| before.matches('\n').count() + 1), error }
        })?;
        let ranges = [
            ("alpha", &grid.alpha, 1e-9, 1e3),
            ("beta", &grid.beta, 1e-9, 1e3),
            ("gamma", &grid.gamma, 1e-12, 1e3),
            ("cell_m", &grid.cell_m, 1e-6, 1e3),
            ("refine_words_per_s", &grid.refine_words_per_s, 0.0, 1e8),
            ("frames_per_s", &grid.frames_per_s, 0.01, 30.0),
        ];
        for (name, values, low, high) in ranges {
            if let Some(&value) = values.iter().find(|value| !(low..=high).contains(*value)) {
                return Err(GridFault::Value { name, value, low, high });
            }
        }
        if let Some(&labels) = grid.max_labels.iter().find(|labels| !(2..=254).contains(*labels)) {
            return Err(GridFault::Value { name: "max_labels", value: labels.into(), low: 2.0, high: 254.0 });
        }
        let count = ranges.iter().map(|(_, values, ..)| values.len()).chain([grid.cells.len(), grid.max_labels.len()]);
        let count = count.map(|n| n.max(1)).fold(1usize, usize::saturating_mul);
        if count > MAX_SETTINGS {
            return Err(GridFault::Many(count));
        }
        grid.drop_repeats();
        Ok(grid)
    }

    fn drop_repeats(&mut self) {
        fn each_once<T: PartialEq + Clone>(values: &mut Vec<T>) {
            let all = std::mem::take(values);
            all.into_iter().for_each(|value| {
                if !values.contains(&value) {
                    values.push(value);
                }
            });
        }
        let numbers = [&mut self.alpha, &mut self.beta, &mut self.gamma, &mut self.cell_m];
        numbers.into_iter().chain([&mut self.refine_words_per_s, &mut self.frames_per_s]).for_each(each_once);
        each_once(&mut self.max_labels);
        each_once(&mut self.cells);
    }

    /// All settings without repeats, grouped by the size of cells.
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = Vec::new();
        for &cell_m in &self.cell_m {
            for &alpha in &self.alpha {
                for &beta in &self.beta {
                    for (&gamma, &max_labels) in
                        self.gamma.iter().flat_map(|g| self.max_labels.iter().map(move |l| (g, l)))
                    {
                        let priors = Setting { alpha, beta, gamma, max_labels, cell_m, ..self.first() };
                        self.at_each_pace(priors, &mut settings);
                    }
                }
            }
        }
        settings
    }

    /// The first value of each optional list; the priors are 0.
    fn first(&self) -> Setting {
        let of = |values: &[f64]| values.first().copied().unwrap_or_default();
        Setting {
            cell_m: of(&self.cell_m),
            alpha: 0.0,
            beta: 0.0,
            gamma: 0.0,
            max_labels: 0,
            refine_words_per_s: of(&self.refine_words_per_s),
            frames_per_s: of(&self.frames_per_s),
            cells: self.cells.first().copied().unwrap_or(CellBand::Fine),
        }
    }

    fn at_each_pace(&self, priors: Setting, settings: &mut Vec<Setting>) {
        for &refine_words_per_s in &self.refine_words_per_s {
            for &frames_per_s in &self.frames_per_s {
                settings.extend(self.cells.iter().map(|&cells| Setting {
                    refine_words_per_s,
                    frames_per_s,
                    cells,
                    ..priors
                }));
            }
        }
    }
}

/// Reads the bands of cells. Coarse to fine is refused: it ends with every cell sent, as fine does.
fn bands<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<CellBand>, D::Error> {
    let band = |name: String| {
        let band = CellBand::from_name(&name).filter(|&band| band != CellBand::CoarseToFine);
        band.ok_or_else(|| D::Error::custom(format!("cells has {name:?}; it takes fine and coarse")))
    };
    Vec::<String>::deserialize(deserializer)?.into_iter().map(band).collect()
}

/// A configuration file with the setting and the other parameters of the scene model that it was measured with.
pub fn toml(row: &Row, config: &Config, budget_bps: f64) -> String {
    let Measurement { mutual_information_nats, normalised_mutual_information, map_bytes, stream_bps, .. } =
        row.measurement;
    let setting = row.setting;
    format!(
        "# scenecast tune: mutual information {mutual_information_nats:.3} nats (normalised {normalised_mutual_information:.3}), \
         map of {map_bytes} bytes,\n# stream of {stream_bps:.0} bit/s of at most {budget_bps}\n\n\
         [scene]\ncell_m = {:?}\nmax_labels = {}\nframes_per_s = {:?}\n{}\n[map]\ncells = \"{}\"\n",
        setting.cell_m,
        setting.max_labels,
        setting.frames_per_s,
        labels(&setting, config),
        setting.cells.name()
    )
}

/// What the labels are, and the parameters that they depend on.
fn labels(setting: &Setting, config: &Config) -> String {
    if setting.is_of_habitats() {
        return "labels = \"habitats\"\n".to_owned();
    }
    let Setting { alpha, beta, gamma, refine_words_per_s, .. } = setting;
    let scene = &config.scene;
    format!(
        "labels = \"topics\"\nalpha = {alpha:?}\nbeta = {beta:?}\ngamma = {gamma:?}\nbirth = \"{}\"\n\
         refine_words_per_s = {}\nmax_words_per_cell = {}\n",
        scene.birth, *refine_words_per_s as u32, scene.max_words_per_cell
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_config::{MapCells, SceneLabels};
    use scenecast_core::tuning_table::TuningTable;
    use scenecast_protocol::directive::CellBand;

    #[test]
    fn the_default_grid_of_habitats_has_numbers_of_labels_alone() {
        let settings = Grid::load(None, &Config::default()).unwrap().settings();
        assert_eq!(settings.iter().map(|s| s.max_labels).collect::<Vec<_>>(), [4, 6, 8, 11, 16]);
        assert!(settings.iter().all(|s| s.is_of_habitats() && s.frames_per_s == 0.5));
    }

    fn topics() -> Config {
        scenecast_config::load(None, &["scene.labels=topics".to_owned()]).unwrap()
    }

    #[test]
    fn the_default_grid_of_topics_is_that_of_the_paper() {
        let settings = Grid::load(None, &topics()).unwrap().settings();
        assert_eq!(settings.len(), 36);
        let first = settings[0];
        assert_eq!((first.cell_m, first.alpha, first.beta, first.gamma), (0.25, 1.0, 10.0, 1e-3));
        assert_eq!((first.refine_words_per_s, first.frames_per_s, first.cells), (2.5e5, 0.5, CellBand::Fine));
        assert_eq!(settings[35], Setting { alpha: 0.001, beta: 0.1, gamma: 1e-5, ..first });
    }

    #[test]
    fn a_file_overrides_the_lists_that_it_names_without_repeats() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-grid.toml", std::process::id()));
        let text = "alpha = [1, 0.5, 1]\ncell_m = [0.1, 0.2]\nframes_per_s = [0.5, 0.1]\ncells = ['fine', 'coarse']\n";
        std::fs::write(&path, text).unwrap();
        let settings = Grid::load(Some(&path), &topics()).unwrap().settings();
        assert_eq!(settings.len(), 2 * 2 * 3 * 3 * 2 * 2);
        assert!(settings.is_sorted_by_key(|s| s.cell_m));
        let refused = Grid::load(Some(&path), &Config::default()).unwrap_err().to_string();
        assert!(refused.contains("have no effect where scene.labels is habitats"), "{refused}");
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_line_and_range() {
        assert!(Grid::read("alpha = [1]\nbta = [1]").unwrap_err().to_string().starts_with(":2: unknown field `bta`"));
        assert!(Grid::read("beta = [0]").unwrap_err().to_string().contains("beta has 0; it takes numbers from"));
        assert!(Grid::read("cells = ['huge']").unwrap_err().to_string().contains("it takes fine and coarse"));
        assert!(
            Grid::read("frames_per_s = [31]").unwrap_err().to_string().contains("it takes numbers from 0.01 to 30")
        );
        assert!(Grid::read("max_labels = [1]").unwrap_err().to_string().contains("it takes numbers from 2 to 254"));
        assert!(Grid::read("alpha = [nan]").is_err() && Grid::read("alpha = 3").is_err());
    }

    #[test]
    fn the_best_setting_can_be_loaded_as_a_configuration() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-best.toml", std::process::id()));
        let shipped = TuningTable::shipped();
        let row = shipped.rows().find(|row| row.setting.cells == CellBand::Coarse).unwrap();
        std::fs::write(&path, toml(row, &Config::default(), 1e4)).unwrap();
        let config = scenecast_config::load(Some(&path), &[]).unwrap();
        let (found, setting) = (&config.scene, row.setting);
        assert_eq!((found.max_labels, found.cell_m), (setting.max_labels, setting.cell_m));
        let topics = Row { setting: Setting { alpha: 0.5, beta: 0.1, gamma: 1e-4, ..setting }, ..*row };
        std::fs::write(&path, toml(&topics, &Config::default(), 1e4)).unwrap();
        let of_topics = scenecast_config::load(Some(&path), &[]).unwrap().scene;
        assert_eq!((of_topics.alpha, of_topics.gamma, of_topics.labels), (0.5, 1e-4, SceneLabels::Topics));
        assert_eq!((found.frames_per_s, config.map.cells), (setting.frames_per_s, MapCells::Coarse));
    }
}
