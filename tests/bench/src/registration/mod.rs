//! The registration of camera frames against dead reckoning alone and against perfect navigation.

mod command;

pub(crate) use command::RegistrationBench;

use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_rehearsal::{Mission, MissionOptions, World};
use serde::Serialize;
use std::time::Duration;

/// A way to know where frames are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Navigation {
    /// Odometry without drift, no fixes, no registration.
    Perfect,
    /// Drifting odometry and fixes, without registration.
    DeadReckoned,
    /// Drifting odometry, fixes and registration.
    Registered,
}

/// One mission of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegistrationRow {
    pub scene: String,
    pub seed: u64,
    pub navigation: Navigation,
    /// Root mean square error of the frames' places after the best turn and shift of all, cells.
    pub error_rigid_cells: f64,
    /// The same with the vehicle's own placement of the map.
    pub error_placed_cells: f64,
    /// As rigid, when the whole graph is solved after the survey; 0 without registration.
    pub error_solved_cells: f64,
    /// Mutual information of the operator's map with the true classes over the survey's area, unexplored being a label
    /// of its own, after the best turn and shift of the map, nats; `None` without annotation.
    pub information_rigid_nats: Option<f64>,
    /// The same with the vehicle's own placement of the map.
    pub information_placed_nats: Option<f64>,
    /// Frames; those matched with the frame before; matches with earlier frames; matches that were not used.
    pub frames: u32,
    pub chained: u32,
    pub loops: u32,
    pub contradicted: u32,
}

/// Means over all scenes and seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegistrationSummary {
    pub navigation: Navigation,
    pub error_rigid_cells: f64,
    pub error_placed_cells: f64,
    pub error_solved_cells: f64,
    /// The mean mutual information divided by that with perfect navigation, rigid and placed.
    pub information_rigid: Option<f64>,
    pub information_placed: Option<f64>,
}

/// Flies the same survey over each scene with each kind of navigation.
pub fn measure_registration(
    config: &Config,
    scenes: &[(String, World)],
    (first, count): (u64, u64),
    progress: &mut dyn FnMut(&RegistrationRow),
) -> Result<Vec<RegistrationRow>, UserError> {
    let mut rows = Vec::new();
    for (scene, world) in scenes {
        for seed in first..first + count {
            for navigation in [Navigation::Perfect, Navigation::DeadReckoned, Navigation::Registered] {
                let row = fly(config, scene, world, seed, navigation)?;
                progress(&row);
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

fn fly(
    config: &Config,
    scene: &str,
    world: &World,
    seed: u64,
    navigation: Navigation,
) -> Result<RegistrationRow, UserError> {
    let mut config = config.clone();
    config.registration.enabled = navigation == Navigation::Registered;
    if navigation == Navigation::Perfect {
        navigate_perfectly(&mut config);
    }
    let mut mission = Mission::new(config, MissionOptions { world: world.clone(), seed, record: None })?;
    mission.run(Duration::ZERO, &mut |_| Ok(()))?;
    let cells = |metres: Option<f64>| metres.unwrap_or(0.0) / mission.cell_m();
    let errors = mission.registration_error_m();
    let information = mission.map_information(&mission.operator_map());
    let tally = mission.mapper().registration().unwrap_or_default();
    Ok(RegistrationRow {
        scene: scene.to_owned(),
        seed,
        navigation,
        error_rigid_cells: cells(errors.map(|e| e.rigid_m)),
        error_placed_cells: cells(errors.map(|e| e.placed_m)),
        error_solved_cells: cells(mission.solved_error_m()),
        information_rigid_nats: information.map(|i| i.rigid_nats),
        information_placed_nats: information.map(|i| i.placed_nats),
        frames: tally.frames,
        chained: tally.chained,
        loops: tally.loops,
        contradicted: tally.contradicted,
    })
}

/// No drift, no fixes, a known start, and no registration.
pub(crate) fn navigate_perfectly(config: &mut Config) {
    config.registration.enabled = false;
    config.navigation.drift_percent = 0.0;
    config.navigation.fix_period_s = 0.0;
    config.navigation.start_sigma_m = 0.0;
}

/// The means for each kind of navigation.
pub fn summarise(rows: &[RegistrationRow]) -> Vec<RegistrationSummary> {
    let of = |navigation| rows.iter().filter(move |row| row.navigation == navigation);
    let mean = |navigation, value: fn(&RegistrationRow) -> Option<f64>| {
        let values: Vec<f64> = of(navigation).filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let share = |navigation, value: fn(&RegistrationRow) -> Option<f64>| {
        let perfect = mean(Navigation::Perfect, value).filter(|perfect| *perfect > 0.0)?;
        Some(mean(navigation, value)? / perfect)
    };
    let all = [Navigation::Perfect, Navigation::DeadReckoned, Navigation::Registered];
    let one = |navigation| RegistrationSummary {
        navigation,
        error_rigid_cells: mean(navigation, |row| Some(row.error_rigid_cells)).unwrap_or(0.0),
        error_placed_cells: mean(navigation, |row| Some(row.error_placed_cells)).unwrap_or(0.0),
        error_solved_cells: mean(navigation, |row| Some(row.error_solved_cells)).unwrap_or(0.0),
        information_rigid: share(navigation, |row| row.information_rigid_nats),
        information_placed: share(navigation, |row| row.information_placed_nats),
    };
    all.map(one).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_registered_survey_is_truer_than_a_drifting_one() {
        let sets =
            ["survey.duration_s=180", "camera.width_px=480", "camera.height_px=360", "scene.refine_words_per_s=2000"];
        let ours = ["navigation.drift_percent=4", "operator.script=none", "survey.area_m=[40.0, 30.0, 52.0, 42.0]"];
        let sets: Vec<String> = sets.into_iter().chain(ours).map(str::to_owned).collect();
        let config = scenecast_config::load(None, &sets).unwrap();
        let scenes = [("reef".to_owned(), World::reef(3, config.camera.metres_per_pixel))];
        let rows = measure_registration(&config, &scenes, (1, 1), &mut |_| {}).unwrap();
        let [perfect, drifting, registered] = rows.as_slice() else { panic!("{rows:?}") };
        assert!(perfect.error_rigid_cells < 1e-6 && perfect.frames == 0, "{perfect:?}");
        assert!(drifting.error_rigid_cells > 2.0 * registered.error_rigid_cells, "{drifting:?} {registered:?}");
        assert!(registered.error_rigid_cells < 0.3 && registered.loops > 20, "{registered:?}");
        let means = summarise(&rows);
        assert_eq!(means[0].information_rigid, Some(1.0));
        assert!(means[2].error_placed_cells < 4.0, "{means:?}");
    }
}
