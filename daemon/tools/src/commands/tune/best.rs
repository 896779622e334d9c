//! The best setting as a configuration file.

use scenecast_config::Config;
use scenecast_core::tuning_table::{Measurement, Row, Setting};

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
