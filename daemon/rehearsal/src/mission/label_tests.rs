//! Labels of another program in a rehearsal: the operator's map becomes the one that was fed, with names and bands.

use super::{Mission, MissionOptions};
use crate::world::World;
use scenecast_protocol::map::{Cell, LabelGrid, LayerId};
use scenecast_protocol::time::Instant;
use std::path::{Path, PathBuf};

const WIDTH: i32 = 40;
const HEIGHT: i32 = 30;

/// Class of a cell after a number of grids; some cells are unknown.
fn class(x: i32, y: i32, grid: i32) -> u8 {
    match (x / 5 + y / 4 + grid) % 7 {
        6 => 255,
        class => (class * 40) as u8,
    }
}

fn picture(value: impl Fn(i32, i32) -> u8) -> Vec<u8> {
    // Rows go from north to south.
    (0..HEIGHT).rev().flat_map(|y| (0..WIDTH).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect()
}

fn write(dir: &Path, name: &str, header: &str, picture: Option<&[u8]>) {
    std::fs::write(dir.join(format!("{name}.json")), header).unwrap();
    picture.iter().for_each(|bytes| std::fs::write(dir.join(format!("{name}.bin")), bytes).unwrap());
}

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

fn header(kind: &str, t_s: i32, more: &str) -> String {
    format!(
        r#"{{"kind":"{kind}","t_s":{t_s},"west_m":0,"south_m":0,"cell_m":0.25,"encoding":"raw","width":{WIDTH},"height":{HEIGHT}{more}}}"#
    )
}

fn mission(dir: &Path, sets: &[&str]) -> Mission {
    let source = format!("labels.source=dir:{}", dir.display());
    let usual = ["scene.cell_m=0.25", "operator.script=none", "channel.loss=0.2", &source];
    let sets: Vec<String> = usual.iter().chain(sets).map(|set| (*set).to_owned()).collect();
    let config = scenecast_config::load(None, &sets).unwrap();
    Mission::new(config, MissionOptions { world: World::patches(5, 0.01), seed: 3, record: None }).unwrap()
}

fn fed(grid: i32) -> LabelGrid {
    let cells = (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y)));
    cells.filter(|&(x, y)| class(x, y, grid) != 255).map(|(x, y)| (Cell::new(x, y), class(x, y, grid) + 1)).collect()
}

#[test]
fn a_fed_map_converges_with_names_bands_and_refusals() {
    let dir = folder("fed-labels");
    let names =
        r##","classes":[{"class":0,"name":"sand","colour":"#E0C080"},{"class":40,"name":"Posidonia oceanica"}]"##;
    for grid in 0..4 {
        let more = if grid == 0 { names } else { "" };
        write(&dir, &format!("{grid}"), &header("grid", 10 + 5 * grid, more), Some(&picture(|x, y| class(x, y, grid))));
    }
    let band = r#","name":"backscatter","unit":"dB","scale":0.5,"offset":-80"#;
    write(&dir, "band", &header("band", 12, band), Some(&picture(|x, y| if x == y { 255 } else { (x * 6) as u8 })));
    write(&dir, "wrong", &header("grid", 13, r#","classes":[{"class":0,"name":"mud"}]"#), Some(&picture(|_, _| 0)));
    write(&dir, "lonely", &header("grid", 14, ""), None);
    for sets in
        [&[][..], &["modem.kind=udp", "modem.full_duplex=true", "channel.half_duplex=false", "channel.range_m=10"]]
    {
        let mut mission = mission(&dir, sets);
        let mut until = 40.0;
        let is_done =
            |m: &Mission| m.surface().map(m.address()).is_some_and(|map| map == &fed(3)) && m.vehicle().is_converged();
        while !is_done(&mission) {
            assert!(until < 400.0, "not equal after {until} s");
            mission.advance(Instant::from_secs_f64(until)).unwrap();
            until += 1.0;
        }
        assert_eq!(mission.vehicle().map(), &fed(3));
        let record = mission.surface().record(mission.address()).unwrap();
        assert_eq!((record.label_name(1), record.label_name(41)), (Some("sand"), Some("Posidonia oceanica")));
        assert_eq!((record.label_book(1).unwrap().colour.as_deref(), record.label_name(81)), (Some("#e0c080"), None));
        let view = mission.surface().view(mission.address()).unwrap();
        let id = view.layers().id("backscatter").unwrap();
        let layer = view.layer(id).unwrap();
        assert_eq!((id, &*layer.descriptor().unit), (LayerId::new(4).unwrap(), "dB"));
        let quantity = |x, y| layer.descriptor().middle(layer.levels().shown().get(Cell::new(x, y)));
        assert_eq!((quantity(10, 3), quantity(39, 3), quantity(7, 7)), (Some(-50.0), Some(37.0), None));
        let refused: Vec<&str> = mission.refused_labels().iter().map(|line| line.rsplit('/').next().unwrap()).collect();
        assert!(refused[0].starts_with("wrong.json: class 0 is named \"sand\" already"), "{refused:?}");
        assert!(refused[1].starts_with("lonely.json: the header: the picture is missing"), "{refused:?}");
        assert_eq!(refused.len(), 2);
        let renamed = scenecast_surface::record::StoredLabel { name: Some("silt".into()), ..Default::default() };
        let address = mission.address();
        mission.surface_mut().record_mut(address).unwrap().set_label(1, renamed).unwrap();
        mission.advance(Instant::from_secs_f64(until + 30.0)).unwrap();
        assert_eq!(mission.surface().record(address).unwrap().label_name(1), Some("silt"));
    }
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn a_real_annotated_map_converges_exactly() {
    let map = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/benthic_map/map_idx_25cm.png");
    let Ok(bytes) = std::fs::read(&map) else {
        assert!(std::env::var_os("CI").is_none(), "{} is missing", map.display());
        println!("SKIPPED: {} is missing", map.display());
        return;
    };
    let dir = folder("real-labels");
    std::fs::write(dir.join("map.png"), bytes).unwrap();
    write(&dir, "map", r#"{"kind":"grid","t_s":5,"west_m":0,"south_m":0,"cell_m":0.25}"#, None);
    let radio = ["modem.kind=udp", "modem.full_duplex=true", "channel.half_duplex=false", "channel.range_m=10"];
    let rate = ["channel.bit_rate=200000", "link.budget_bps=200000", "link.frame_bytes=1000"];
    let mut mission = mission(&dir, &[&radio[..], &rate].concat());
    mission.advance(Instant::from_secs_f64(40.0)).unwrap();
    assert!(mission.vehicle().is_converged() && mission.vehicle().map().explored() == 385 * 174);
    assert_eq!(mission.surface().map(mission.address()), Some(mission.vehicle().map()));
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn a_band_arrives_beside_the_labels_of_the_scene_model() {
    let dir = folder("beside-labels");
    let band = |file: &str, name: &str, (time, first): (f64, f32)| {
        let header = format!(
            r#"{{"kind":"band","name":"{name}","time":{time},"west_m":0,"south_m":0,"cell_m":0.25,"encoding":"float32","width":{WIDTH},"height":{HEIGHT}}}"#
        );
        let numbers = (0..WIDTH * HEIGHT).flat_map(|i| (first + 0.5 * (i % WIDTH) as f32).to_le_bytes());
        write(&dir, file, &header, Some(&numbers.collect::<Vec<u8>>()));
    };
    band("a", "elevation", (1.7e9, -30.0));
    // In the place of the scene model's own layer, 20 s later.
    band("b", "curiosity", (1.7e9 + 20.0, 0.0));
    write(&dir, "labels", &header("grid", 1, ""), Some(&picture(|_, _| 3)));
    let sets = [
        "labels.source=".to_owned(),
        format!("bands.source=dir:{}", dir.display()),
        "map.layer_shares={curiosity=10}".to_owned(),
        "survey.duration_s=60".to_owned(),
        "modem.kind=udp".to_owned(),
        "modem.full_duplex=true".to_owned(),
        "channel.half_duplex=false".to_owned(),
        "channel.range_m=10".to_owned(),
        "bands.ranges=[\"curiosity=0..25.3\"]".to_owned(),
    ];
    let mut mission = mission(&dir, &sets.each_ref().map(String::as_str));
    assert!(!mission.has_foreign_labels());
    mission.run(std::time::Duration::from_secs(600), &mut |_| Ok(())).unwrap();
    let (vehicle, address) = (mission.vehicle(), mission.address());
    assert!(vehicle.is_converged() && vehicle.map().explored() > 100, "{}", vehicle.map().explored());
    assert_eq!(mission.surface().map(address), Some(vehicle.map()));
    let view = mission.surface().view(address).unwrap();
    let layer = view.layer(view.layers().id("elevation").unwrap()).unwrap();
    let quantity = |x, y| layer.descriptor().middle(layer.levels().shown().get(Cell::new(x, y)));
    assert!((quantity(10, 3).unwrap() + 25.0).abs() < 0.11 && quantity(WIDTH, 3).is_none());
    let own = view.layer(view.layers().id("curiosity").unwrap()).unwrap();
    assert_eq!(own.descriptor().middle(own.levels().shown().get(Cell::new(10, 3))), Some(5.5), "whole bits");
    let is_inside = |cell: Cell| (0..WIDTH).contains(&cell.x) && (0..HEIGHT).contains(&cell.y);
    assert!(own.levels().shown().iter().all(|(cell, _)| is_inside(cell)), "those of the scene model are gone");
    let refused = mission.refused_labels();
    assert!(refused.len() == 1 && refused[0].contains("bands alone"), "{refused:?}");
    std::fs::remove_dir_all(&dir).unwrap();
}
