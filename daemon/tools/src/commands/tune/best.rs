//! The setting to take to sea.

use scenecast_config::Config;
use scenecast_core::tuning_table::{Measurement, Row};

/// The setting as a configuration file, with everything else of the scene model that it was found with.
pub fn toml(row: &Row, config: &Config, budget_bps: f64) -> String {
    let Measurement { mutual_information_nats, normalised_mutual_information, map_bytes, stream_bps, .. } =
        row.measurement;
    let (setting, scene) = (row.setting, &config.scene);
    format!(
        "# scenecast tune: mutual information {mutual_information_nats:.3} nats (normalised {normalised_mutual_information:.3}), \
         map of {map_bytes} bytes,\n# stream of {stream_bps:.0} bit/s of at most {budget_bps}\n\n\
         [scene]\ncell_m = {:?}\nalpha = {:?}\nbeta = {:?}\ngamma = {:?}\nbirth = \"{}\"\nmax_labels = {}\n\
         refine_words_per_s = {}\nframes_per_s = {:?}\nmax_words_per_cell = {}\n\n[map]\ncells = \"{}\"\n",
        setting.cell_m,
        setting.alpha,
        setting.beta,
        setting.gamma,
        scene.birth,
        scene.max_labels,
        setting.refine_words_per_s as u32,
        setting.frames_per_s,
        scene.max_words_per_cell,
        setting.cells.name()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_config::MapCells;
    use scenecast_core::tuning_table::TuningTable;
    use scenecast_protocol::directive::CellBand;

    #[test]
    fn it_can_be_loaded_as_a_configuration() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-best.toml", std::process::id()));
        let shipped = TuningTable::shipped();
        let row = shipped.rows().find(|row| row.setting.cells == CellBand::Coarse).unwrap();
        std::fs::write(&path, toml(row, &Config::default(), 1e4)).unwrap();
        let config = scenecast_config::load(Some(&path), &[]).unwrap();
        let (found, setting) = (&config.scene, row.setting);
        assert_eq!((found.alpha, found.gamma, found.cell_m), (setting.alpha, setting.gamma, setting.cell_m));
        assert_eq!((found.frames_per_s, config.map.cells), (setting.frames_per_s, MapCells::Coarse));
    }
}
