//! A recorded mission for processes whose camera plays it.

use crate::scratch;
use scenecast_rehearsal::{Mission, MissionOptions, World};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

const SHARED: [&str; 3] = ["camera.width_px=320", "camera.height_px=240", "operator.script=none"];

/// The folder of a recorded mission of a minute, and the map that `sim` makes of it as a PNG.
pub fn recorded() -> &'static (PathBuf, Vec<u8>) {
    static RECORDED: OnceLock<(PathBuf, Vec<u8>)> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let dir = scratch("recorded");
        let fly = |sets: &[String], record| {
            let sets: Vec<String> = SHARED.iter().map(|s| (*s).to_owned()).chain(sets.iter().cloned()).collect();
            let config = scenecast_config::load(None, &sets).expect("the settings are allowed");
            let options = MissionOptions { world: World::patches(2, 0.01), seed: 1, record };
            let mut mission = Mission::new(config, options).expect("a mission");
            mission.run(Duration::from_secs(3600), &mut |_| Ok(())).expect("the mission ends");
            mission
        };
        fly(&["survey.duration_s=60".into()], Some(dir.clone()));
        let replay = fly(&["survey.duration_s=90".into(), format!("camera.source=frames:{}", dir.display())], None);
        assert!(replay.is_drained());
        let map = scenecast_core::label_picture::encode(replay.vehicle().map()).expect("a map is a picture");
        (dir, map)
    })
}
