//! The settings that are tried.

use crate::problem::Problem;
use serde::Deserialize;
use std::fmt;
use std::path::Path;

/// One setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Setting {
    /// Edge of a cell, metres.
    pub(super) cell_m: f64,
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) gamma: f64,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cell_m, alpha, beta, gamma } = self;
        write!(f, "cell_m {cell_m}, alpha {alpha}, beta {beta}, gamma {gamma}")
    }
}

/// The values of each parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Grid {
    alpha: Vec<f64>,
    beta: Vec<f64>,
    gamma: Vec<f64>,
    /// Empty: that of the configuration.
    cell_m: Vec<f64>,
}

impl Default for Grid {
    /// The grid of the paper (ICRA 2019, section V.A).
    fn default() -> Self {
        Self {
            alpha: vec![1.0, 0.1, 0.01, 0.001],
            beta: vec![10.0, 1.0, 0.1],
            gamma: vec![1e-3, 1e-4, 1e-5],
            cell_m: Vec::new(),
        }
    }
}

/// Most settings of a grid.
const MOST: usize = 100_000;

impl Grid {
    /// The grid in a file, or the paper's; with `cell_m` unless it has its own.
    pub(super) fn load(path: Option<&Path>, cell_m: f64) -> Result<Self, Problem> {
        let mut grid = match path {
            None => Self::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|e| Problem::file(path, e))?;
                Self::read(&text).map_err(|what| Problem::Input(format!("{}{what}", path.display())))?
            }
        };
        if grid.cell_m.is_empty() {
            grid.cell_m.push(cell_m);
        }
        Ok(grid)
    }

    fn read(text: &str) -> Result<Self, String> {
        let grid: Self = toml::from_str(text).map_err(|e: toml::de::Error| {
            let line =
                e.span().and_then(|span| text.get(..span.start)).map_or(1, |before| before.matches('\n').count() + 1);
            format!(":{line}: {} (it takes lists alpha, beta, gamma, cell_m)", e.message())
        })?;
        let ranges =
            [("alpha", &grid.alpha, 1e-9, 1e3), ("beta", &grid.beta, 1e-9, 1e3), ("gamma", &grid.gamma, 1e-12, 1e3)];
        for (name, values, low, high) in ranges.into_iter().chain([("cell_m", &grid.cell_m, 1e-6, 1e3)]) {
            if values.is_empty() && name != "cell_m" {
                return Err(format!(": {name} is empty; it takes one number at least"));
            }
            if let Some(value) = values.iter().find(|value| !(low..=high).contains(*value)) {
                return Err(format!(": {name} has {value}; it takes numbers from {low} to {high}"));
            }
        }
        let count = [&grid.alpha, &grid.beta, &grid.gamma, &grid.cell_m].map(|v| v.len().max(1));
        let count = count.into_iter().fold(1usize, usize::saturating_mul);
        if count > MOST { Err(format!(": {count} settings; at most {MOST} are allowed")) } else { Ok(grid) }
    }

    /// All settings, those with the same cells one after another, none twice.
    pub(super) fn settings(&self) -> Vec<Setting> {
        let unlike = |values: &[f64]| {
            let mut unlike: Vec<f64> = Vec::new();
            values.iter().for_each(|v| {
                if !unlike.contains(v) {
                    unlike.push(*v)
                }
            });
            unlike
        };
        let (alphas, betas, gammas) = (unlike(&self.alpha), unlike(&self.beta), unlike(&self.gamma));
        let mut settings = Vec::new();
        for cell_m in unlike(&self.cell_m) {
            for &alpha in &alphas {
                for &beta in &betas {
                    settings.extend(gammas.iter().map(|&gamma| Setting { cell_m, alpha, beta, gamma }));
                }
            }
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_file_it_is_the_grid_of_the_paper() {
        let settings = Grid::load(None, 0.25).unwrap().settings();
        assert_eq!(settings.len(), 36);
        assert_eq!(settings[0], Setting { cell_m: 0.25, alpha: 1.0, beta: 10.0, gamma: 1e-3 });
        assert_eq!(settings[35], Setting { cell_m: 0.25, alpha: 0.001, beta: 0.1, gamma: 1e-5 });
    }

    #[test]
    fn a_file_gives_what_it_names_and_no_setting_twice() {
        let grid = Grid::read("alpha = [1, 0.5, 1]\ncell_m = [0.1, 0.2]\n").unwrap();
        assert_eq!(grid.settings().len(), 2 * 2 * 3 * 3);
    }

    #[test]
    fn a_wrong_file_is_answered_with_line_and_range() {
        assert!(Grid::read("alpha = [1]\nbta = [1]").unwrap_err().starts_with(":2: unknown field `bta`"));
        assert!(Grid::read("beta = [0]").unwrap_err().contains("beta has 0; it takes numbers from"));
        assert!(Grid::read("gamma = []").unwrap_err().contains("gamma is empty"));
        assert!(Grid::read("alpha = [nan]").is_err() && Grid::read("alpha = 3").is_err());
    }
}
