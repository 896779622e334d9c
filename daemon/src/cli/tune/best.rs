//! The setting to take to sea.

use super::measure::Measurement;
use super::table::Row;
use crate::config::Config;

/// The row with the highest mutual information whose stream fits the budget; of equals the one with the smaller stream.
pub(super) fn best(rows: &[Row], budget_bps: f64) -> Option<&Row> {
    let fits = rows.iter().filter(|row| row.measurement.stream_bps <= budget_bps);
    fits.max_by(|a, b| {
        let (a, b) = (&a.measurement, &b.measurement);
        a.mutual_information_nats.total_cmp(&b.mutual_information_nats).then(b.stream_bps.total_cmp(&a.stream_bps))
    })
}

/// The setting as a configuration file, with everything else of the scene model that it was found with.
pub(super) fn toml(row: &Row, config: &Config, budget_bps: f64) -> String {
    let Measurement { mutual_information_nats, normalised_mutual_information, map_bytes, stream_bps, .. } =
        row.measurement;
    let (setting, scene) = (row.setting, &config.scene);
    format!(
        "# scenecast tune: mutual information {mutual_information_nats:.3} nats (normalised {normalised_mutual_information:.3}), \
         map of {map_bytes} bytes,\n# stream of {stream_bps:.0} bit/s of at most {budget_bps}\n\n\
         [scene]\ncell_m = {:?}\nalpha = {:?}\nbeta = {:?}\ngamma = {:?}\nbirth = \"{}\"\nmax_labels = {}\n\
         refine_words_per_s = {}\nmax_words_per_cell = {}\n",
        setting.cell_m,
        setting.alpha,
        setting.beta,
        setting.gamma,
        scene.birth,
        scene.max_labels,
        scene.refine_words_per_s,
        scene.max_words_per_cell
    )
}

#[cfg(test)]
mod tests {
    use super::super::grid::Setting;
    use super::*;

    fn row(alpha: f64, mutual_information_nats: f64, stream_bps: f64) -> Row {
        let setting = Setting { cell_m: 0.25, alpha, beta: 0.1, gamma: 1e-5 };
        let measurement = Measurement {
            mutual_information_nats,
            normalised_mutual_information: 0.1,
            null_mutual_information_nats: 0.0,
            mosaic_mutual_information_nats: 1.0,
            labels: 9,
            map_bytes: 1000,
            stream_bps,
        };
        Row { setting, measurement }
    }

    #[test]
    fn the_best_fits_the_budget() {
        let rows = [row(1.0, 0.3, 900.0), row(0.1, 0.4, 1500.0), row(0.01, 0.3, 700.0)];
        assert_eq!(best(&rows, 1e4).map(|row| row.setting.alpha), Some(0.1));
        assert_eq!(best(&rows, 1000.0).map(|row| row.setting.alpha), Some(0.01));
        assert_eq!(best(&rows, 10.0), None);
    }

    #[test]
    fn it_can_be_loaded_as_a_configuration() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-best.toml", std::process::id()));
        std::fs::write(&path, toml(&row(1e-5, 0.3, 900.0), &Config::default(), 1e4)).unwrap();
        let config = crate::config::load(Some(&path), &[]).unwrap();
        assert_eq!((config.scene.alpha, config.scene.gamma, config.scene.cell_m), (1e-5, 1e-5, 0.25));
    }
}
