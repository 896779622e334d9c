//! Frames with distances: words lie at their true places, on a floor that is not flat.

use scenecast_config::Config;
use scenecast_files::{Recording, configured_recording};
use scenecast_protocol::map::LayerDescriptor;
use scenecast_protocol::map::{Cell, LayerId};
use scenecast_rehearsal::{Mission, MissionOptions, World};
use scenecast_tests::{RELIEF_CAMERA, is_on_block, relief_depth_m, scratch, write_relief};
use scenecast_vehicle::{Frame, MapChanges, Mapper};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

const CELL_M: f64 = 0.25;
const DEPTH_STEP_M: f64 = 0.1;

fn config(dir: &Path, sets: &[&str]) -> Result<Config, String> {
    let mut all = vec![
        format!("map.depth_step_m={DEPTH_STEP_M}"),
        format!("camera.source=tum:{}", dir.display()),
        format!("camera.matrix={RELIEF_CAMERA:?}"),
        format!("scene.cell_m={CELL_M}"),
        "camera.flat_field=false".to_owned(),
        "survey.altitude_m=4".to_owned(),
    ];
    all.extend(sets.iter().map(|set| (*set).to_owned()));
    scenecast_config::load(None, &all).map_err(|error| error.to_string())
}

/// The map of a recording, whose frames are changed before.
fn map(config: &Config, change: impl FnOnce(&mut Recording)) -> MapChanges {
    let mut recording = configured_recording(config).unwrap().unwrap();
    change(&mut recording);
    let mut mapper = Mapper::new(config, None, 0, 1).unwrap();
    for frame in &recording.frames {
        let (image, view) = frame.read().unwrap();
        let pose =
            scene_model::project::Pose { x: frame.x_m, y: frame.y_m, z: -frame.depth_m, yaw_rad: -frame.heading_rad };
        let shot = Frame { image: &image, pose, scale: frame.scale, view: view.as_ref() };
        let placed = mapper.register(&shot);
        mapper.handle_frame(&shot.placed(&placed), frame.t_s);
    }
    mapper.current()
}

/// Of the cells away from the block's edge, which hold its walls: the share of those on the block whose depth is right by 0.2 m;
/// and cells that are of the block by label and in truth, over those that are so by one of both.
fn scores(map: &MapChanges) -> (f64, f64) {
    let is_block =
        |cell: Cell| is_on_block((f64::from(cell.x) + 0.5) * CELL_M, (f64::from(cell.y) + 0.5) * CELL_M, 0.8 * CELL_M);
    let scale = LayerDescriptor::depth_around(Config::default().survey.depth_m, DEPTH_STEP_M);
    let on_block = map.layers[&LayerId::DEPTH].iter().filter(|(cell, _)| is_block(*cell) == Some(true));
    let depths = on_block.map(|(_, level)| scale.middle(*level).unwrap());
    let errors: Vec<f64> = depths.map(|depth_m| (depth_m - relief_depth_m(true)).abs()).collect();
    let right = errors.iter().filter(|error| **error < 0.2).count() as f64 / errors.len() as f64;
    let mut votes: BTreeMap<u8, i32> = BTreeMap::new();
    let cells: Vec<(bool, u8)> =
        map.labels.as_ref().unwrap().cells.iter().filter_map(|&(cell, label)| Some((is_block(cell)?, label))).collect();
    for &(is_block, label) in &cells {
        *votes.entry(label).or_default() += if is_block { 1 } else { -1 };
    }
    let count = |is_counted: &dyn Fn(bool, bool) -> bool| {
        cells.iter().filter(|(is_block, label)| is_counted(*is_block, votes[label] > 0)).count() as f64
    };
    (right, count(&|truth, label| truth && label) / count(&|truth, label| truth || label))
}

#[test]
fn words_with_depth_lie_at_their_true_places() {
    let dir = scratch("depth-places");
    write_relief(&dir);
    let config = config(&dir, &["registration.enabled=false", "scene.labels=topics"]).unwrap();
    let (depth, block) = scores(&map(&config, |_| {}));
    let (flat_depth, flat_block) =
        scores(&map(&config, |recording| recording.frames.iter_mut().for_each(|frame| frame.depth = None)));
    println!("right depth {depth:.3}, flat {flat_depth:.3}; overlap of the block {block:.3}, flat {flat_block:.3}");
    assert!(depth > 0.95 && block > 0.85, "{depth} {block}");
    assert!(flat_depth == 0.0 && flat_block < block - 0.2, "{flat_depth} {flat_block}");
}

#[test]
fn frames_with_depth_are_registered_as_images() {
    let dir = scratch("depth-registered");
    write_relief(&dir);
    let (depth, block) = scores(&map(&config(&dir, &[]).unwrap(), |_| {}));
    println!("registered: right depth {depth:.3}, overlap of the block {block:.3}");
    assert!(depth > 0.8 && block > 0.8, "{depth} {block}");
}

#[test]
fn a_sequence_with_depth_is_rehearsed() {
    let dir = scratch("depth-rehearsed");
    write_relief(&dir);
    let sets = ["registration.enabled=false", "operator.script=none", "survey.duration_s=90"];
    let config = config(&dir, &sets).unwrap();
    let direct = map(&config, |_| {}).labels.unwrap().cells;
    let options = MissionOptions { world: World::patches(2, 0.01), seed: 1, record: None };
    let mut mission = Mission::new(config, options).unwrap();
    mission.run(Duration::from_secs(3600), &mut |_| Ok(())).unwrap();
    let sent = mission.vehicle().map();
    let cells = direct.iter().filter(|(cell, _)| sent.get(*cell) > 0).count();
    assert!(cells > direct.len() * 9 / 10, "{cells} of {}", direct.len());
}

#[test]
fn an_oblique_sequence_is_refused_unless_registration_is_off() {
    let dir = scratch("depth-oblique");
    write_relief(&dir);
    let half = 0.5f64.sqrt();
    std::fs::write(dir.join("groundtruth.txt"), format!("0 1 2 -3 {half} 0 0 -{half}\n")).unwrap();
    let refused = configured_recording(&config(&dir, &[]).unwrap()).unwrap_err().to_string();
    assert!(refused.contains("the camera looks 90 degrees away from straight down"), "{refused}");
    let recording = configured_recording(&config(&dir, &["registration.enabled=false"]).unwrap()).unwrap().unwrap();
    assert_eq!(recording.frames.len(), 1);
    assert!(recording.notes[0].contains("17 of 18 images have no depth image or no pose"), "{:?}", recording.notes);
}
