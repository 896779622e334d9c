use super::*;
use scenecast_labels::{Band, BandScale, ItemTime, QuantityBand};
use scenecast_protocol::map::Decimal;

fn config(sets: &[&str]) -> Config {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    scenecast_config::load(None, &sets).unwrap()
}

fn map(sets: &[&str]) -> ForeignMap {
    ForeignMap::new(&config(&[&["scene.cell_m=0.5", "labels.source=dir:labels"], sets].concat()), 3)
}

fn raster(width: u32, values: &[u8]) -> Raster {
    Raster { width, height: values.len() as u32 / width, values: values.to_vec() }
}

fn item(content: Content) -> Item {
    Item { time: ItemTime::Arrival, classes: Vec::new(), content }
}

fn grid(width: u32, values: &[u8]) -> Item {
    item(Content::Grid { ground: Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 }, classes: raster(width, values) })
}

fn labels(map: &ForeignMap) -> Vec<(i32, i32, u8)> {
    map.labels().iter().map(|(cell, label)| (cell.x, cell.y, label)).collect()
}

#[test]
fn a_segmented_image_is_projected_like_a_camera_frame() {
    // A pixel of 0.5 m is a cell; the vehicle heads east, so that the top of the image lies in the east.
    let pose = ImagePose { x_m: 1.0, y_m: 1.0, depth_m: 5.0, heading_rad: f64::to_radians(90.0) };
    let image = |values: &[u8]| {
        item(Content::Image { pose: Some(pose), metres_per_pixel: Some(0.5), classes: raster(2, values) })
    };
    let mut seen = map(&[]);
    seen.handle_item(&image(&[0, 1, 255, 7]), ForeignSource::Labels, None, 4.0).unwrap();
    // Left and right of the top row: north-east and south-east.
    assert_eq!(labels(&seen), [(1, 1, 8), (2, 1, 2), (2, 2, 1)].map(|(x, y, l)| (x, y, l)));
    let changes = seen.take_changes(100).labels.unwrap();
    assert_eq!((seen.last_s(), changes.highest, changes.cells.len()), (Some(4.0), 8, 3));
    let own = item(Content::Image { pose: None, metres_per_pixel: Some(0.5), classes: raster(2, &[0, 1, 255, 7]) });
    let mut same = map(&[]);
    assert_eq!(same.handle_item(&own, ForeignSource::Labels, None, 4.0), Err(Refusal::NoPose));
    same.handle_item(&own, ForeignSource::Labels, Some(pose), 4.0).unwrap();
    assert_eq!(labels(&same), labels(&seen));
}

#[test]
fn images_vote_and_the_newest_wins_if_configured() {
    let pose = ImagePose { x_m: 0.25, y_m: 0.25, depth_m: 0.0, heading_rad: 0.0 };
    let image = |class: u8| {
        item(Content::Image { pose: Some(pose), metres_per_pixel: Some(0.1), classes: raster(2, &[class; 4]) })
    };
    for (sets, expected) in [(&[][..], 5), (&["labels.votes=newest"][..], 9)] {
        let mut seen = map(sets);
        for class in [4, 4, 8] {
            seen.handle_item(&image(class), ForeignSource::Labels, None, 0.0).unwrap();
        }
        assert_eq!(labels(&seen), [(0, 0, expected)]);
    }
}

#[test]
fn a_grid_states_each_cell_and_can_make_it_unknown() {
    let mut stated = map(&[]);
    stated.handle_item(&grid(2, &[0, 253, 255, 9]), ForeignSource::Labels, None, 0.0).unwrap();
    assert_eq!(labels(&stated), [(1, 0, 10), (0, 1, 1), (1, 1, 254)]);
    stated.handle_item(&grid(2, &[255, 253, 3, 9]), ForeignSource::Labels, None, 1.0).unwrap();
    let mut changed = stated.take_changes(100).labels.unwrap().cells;
    assert_eq!(changed.len(), 3, "nobody was given the cell that is unknown again");
    stated.handle_item(&grid(2, &[0, 253, 255, 255]), ForeignSource::Labels, None, 1.5).unwrap();
    changed = stated.take_changes(100).labels.unwrap().cells;
    changed.sort();
    assert_eq!(changed, [(Cell::new(0, 0), 0), (Cell::new(0, 1), 1), (Cell::new(1, 0), 0)]);
    assert_eq!(stated.labels().get(Cell::new(1, 0)), 0);
    stated.handle_item(&grid(2, &[1, 1, 1, 1]), ForeignSource::Labels, None, 2.0).unwrap();
    assert!(stated.labels().iter().all(|(_, label)| label == 2));
}

#[test]
fn the_limit_on_cells_of_labels_and_bands_counts_erased_ones() {
    let place = |kind: Content, west_m: f64| match kind {
        Content::Grid { classes, ground } => item(Content::Grid { ground: Ground { west_m, ..ground }, classes }),
        Content::Band { band, levels, ground } => {
            item(Content::Band { band, ground: Ground { west_m, ..ground }, levels })
        }
        other => item(other),
    };
    let band = |values: &[u8]| {
        let (scale, offset) = (Decimal::new(1, 0), Decimal::new(0, 0));
        let band = Band { name: "silt".into(), unit: String::new(), scale, offset, no_data: 255 };
        let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
        Content::Band { band, ground, levels: raster(values.len() as u32, values) }
    };
    let labels = |values: &[u8]| grid(values.len() as u32, values).content;
    let of = |is_band: bool, values: &[u8]| if is_band { band(values) } else { labels(values) };
    for is_band in [false, true] {
        let of = |values: &[u8]| of(is_band, values);
        let mut map = map(&[]);
        map.max_cells = 5;
        let full = Err(Refusal::FullMap(5));
        assert_eq!(map.handle_item(&place(of(&[1; 6]), 0.0), ForeignSource::Labels, None, 0.0), full);
        assert!(map.bands.iter().next().is_none() && map.labels().is_empty(), "nothing of it is used");
        map.handle_item(&place(of(&[1; 4]), 0.0), ForeignSource::Labels, None, 0.0).unwrap();
        map.handle_item(&place(of(&[2; 4]), 0.0), ForeignSource::Labels, None, 1.0).unwrap();
        map.handle_item(&place(of(&[255; 4]), 0.0), ForeignSource::Labels, None, 2.0).unwrap();
        assert_eq!(
            map.handle_item(&place(of(&[1; 2]), 50.0), ForeignSource::Labels, None, 3.0),
            full,
            "erased cells are cells"
        );
        map.handle_item(&place(of(&[255; 9]), 0.0), ForeignSource::Labels, None, 4.0).unwrap();
        map.handle_item(&place(of(&[3; 5]), 0.0), ForeignSource::Labels, None, 5.0).unwrap();
    }
}

#[test]
fn a_class_keeps_its_name_and_a_band_its_scale() {
    let mut map = map(&[]);
    let named = |name: &str| Item { classes: vec![ClassEntry::new(4, name, None).unwrap()], ..grid(1, &[3]) };
    map.handle_item(&named("rock"), ForeignSource::Labels, None, 0.0).unwrap();
    let refused = map.handle_item(&named("mud"), ForeignSource::Labels, None, 1.0).unwrap_err();
    assert_eq!(refused, Refusal::OtherName(3, "rock".to_owned()));
    assert_eq!((map.last_s(), map.classes().next().unwrap().name()), (Some(0.0), "rock"));
    let band = |scale: i32, name: &str| {
        let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
        let (scale, offset) = (Decimal::new(scale, -1), Decimal::new(-80, 0));
        let band = Band { name: name.into(), unit: "dB".into(), scale, offset, no_data: 255 };
        item(Content::Band { band, ground, levels: raster(3, &[0, 100, 255]) })
    };
    map.handle_item(&band(5, "backscatter"), ForeignSource::Labels, None, 2.0).unwrap();
    assert_eq!(
        map.handle_item(&band(6, "backscatter"), ForeignSource::Labels, None, 3.0),
        Err(Refusal::OtherBand("backscatter".into()))
    );
    let (layer, levels) = map.take_changes(100).bands.remove(0);
    let cells: Vec<_> = levels.iter().map(|&(cell, level)| (cell, layer.middle(level).unwrap())).collect();
    assert_eq!((&*layer.name, &*layer.unit, layer.share), ("backscatter", "dB", 8));
    assert_eq!(cells, [(Cell::new(0, 0), -80.0), (Cell::new(1, 0), -30.0)]);
    let full =
        (0..20).find_map(|i| map.handle_item(&band(5, &format!("band_{i}")), ForeignSource::Labels, None, 4.0).err());
    assert!(matches!(full, Some(Refusal::TooManyBands(_))));
}

#[test]
fn a_restored_foreign_map_is_the_saved_one() {
    let mut before = map(&[]);
    before.handle_item(&grid(2, &[0, 253, 255, 9]), ForeignSource::Labels, None, 5.0).unwrap();
    before.handle_item(&grid(1, &[255]), ForeignSource::Labels, None, 6.0).unwrap();
    before.set_mark(ForeignSource::Labels, "000017");
    before.classes.insert(10, ClassEntry::new(10, "kelp", Some([1, 2, 3])).unwrap());
    let config = config(&["scene.cell_m=0.5", "labels.source=dir:labels"]);
    let bytes = before.save(77);
    let (after, lineage) = ForeignMap::restore(&config, &bytes).unwrap();
    assert_eq!((after, lineage), (before, 77));
    let other = ForeignMap::restore(&self::config(&["scene.cell_m=0.25"]), &bytes).unwrap_err();
    assert_eq!(other.to_string(), "it was made with cells of 0.5 m");
    for cut in 0..bytes.len() {
        assert!(ForeignMap::restore(&config, &bytes[..cut]).is_err());
    }
}

/// A checkpoint, in hexadecimal digits.
const CHECKPOINT: &str = "53434e4c4142454c020000005f000000000000004d03000000000000e03f010000000000001c400106303030\
    30313700010400010404030400050002010202fe01020001011a6000fe08000005ffffe0a7fea26261636b73\
    63617474657264420100000101020001010a08830102036b656c70c6243b64";

#[test]
fn the_bytes_of_a_checkpoint_are_those_of_its_version() {
    let mut same = map(&[]);
    same.handle_item(&grid(2, &[0, 253, 255, 9]), ForeignSource::Labels, None, 5.0).unwrap();
    same.handle_item(&grid(2, &[0, 253, 255, 255]), ForeignSource::Labels, None, 6.0).unwrap();
    let pose = ImagePose { x_m: 1.25, y_m: 0.25, depth_m: 0.0, heading_rad: 0.0 };
    let image = Content::Image { pose: Some(pose), metres_per_pixel: Some(0.1), classes: raster(2, &[4; 4]) };
    same.handle_item(&item(image), ForeignSource::Labels, None, 6.5).unwrap();
    let (scale, offset) = (Decimal::new(5, -1), Decimal::new(-80, 0));
    let band = Band { name: "backscatter".into(), unit: "dB".into(), scale, offset, no_data: 255 };
    let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
    for values in [[0, 100, 255], [0, 255, 255]] {
        let band = Content::Band { band: band.clone(), ground, levels: raster(3, &values) };
        same.handle_item(&item(band), ForeignSource::Labels, None, 7.0).unwrap();
    }
    same.classes.insert(10, ClassEntry::new(10, "kelp", Some([1, 2, 3])).unwrap());
    same.set_mark(ForeignSource::Labels, "000017");
    let digits = |at: usize| u8::from_str_radix(&CHECKPOINT[at..at + 2], 16).unwrap();
    let mut bytes: Vec<u8> = (0..CHECKPOINT.len()).step_by(2).map(digits).collect();
    let config = config(&["scene.cell_m=0.5", "labels.source=dir:labels"]);
    assert_eq!(ForeignMap::restore(&config, &bytes).unwrap(), (same, 77));
    for cut in 0..bytes.len() {
        assert!(ForeignMap::restore(&config, &bytes[..cut]).is_err());
    }
    bytes[8] = 1;
    let other = ForeignMap::restore(&config, &bytes).unwrap_err();
    assert_eq!(other.to_string(), "version 1, this program reads version 2");
}

#[test]
fn bands_come_beside_the_labels_of_the_scene_model() {
    let mut beside = map(&["labels.source=", "bands.source=dir:bands"]);
    let labels = beside.handle_item(&grid(1, &[3]), ForeignSource::Bands, None, 0.0);
    assert_eq!(labels, Err(Refusal::BandsAlone));
    let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
    let band = |numbers: &[f32], scale| {
        let band = QuantityBand { name: "elevation".into(), unit: "m".into(), scale };
        let quantities = Raster { width: numbers.len() as u32, height: 1, values: numbers.to_vec() };
        item(Content::Quantities { band, ground, quantities })
    };
    beside.handle_item(&band(&[-20.0, f32::NAN, -10.0], None), ForeignSource::Bands, None, 0.0).unwrap();
    let update = beside.take_changes(100);
    let (layer, levels) = &update.bands[0];
    assert_eq!((update.labels.is_none(), levels.len(), layer.scale), (true, 2, Decimal::new(1, -1)));
    assert!((layer.middle(levels[0].1).unwrap() + 20.0).abs() < 0.051);
    // The scale that was chosen stays; a quantity below it is not known.
    beside.handle_item(&band(&[-1e6, -15.0], None), ForeignSource::Bands, None, 1.0).unwrap();
    let (again, levels) = beside.take_changes(100).bands.remove(0);
    assert_eq!((again == *layer, levels[0]), (true, (Cell::new(0, 0), 0)));
    let other = beside.handle_item(&band(&[0.0], BandScale::between(0.0, 1.0)), ForeignSource::Bands, None, 2.0);
    assert_eq!(other, Err(Refusal::OtherBand("elevation".into())));
    let mut configured = map(&["bands.ranges=[\"elevation=-40..-10\"]"]);
    configured.handle_item(&band(&[-40.0, -10.0], None), ForeignSource::Labels, None, 0.0).unwrap();
    let (layer, levels) = configured.take_changes(9).bands.remove(0);
    assert_eq!((levels[0].1, levels[1].1, layer.scale), (1, 254, Decimal::nearest(30.0 / 253.0)));
    let nothing = configured.handle_item(&band(&[f32::NAN], None), ForeignSource::Labels, None, 1.0);
    assert_eq!(nothing, Ok(()), "the scale is known");
    let mut empty = map(&[]);
    let huge = empty.handle_item(&band(&[1e9], None), ForeignSource::Labels, None, 1.0);
    assert_eq!(huge, Err(Refusal::NoScale("elevation".into())));
}

#[test]
fn a_layer_without_numbers_is_taken_and_changes_nothing() {
    let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
    let band = |name: &str, quantity: f32, scale| {
        let band = QuantityBand { name: name.to_owned(), unit: "m".into(), scale };
        item(Content::Quantities { band, ground, quantities: Raster { width: 1, height: 1, values: vec![quantity] } })
    };
    let mut map = map(&[]);
    for scale in [None, BandScale::between(0.0, 253.0)] {
        for i in 0..20 {
            let empty = band(&format!("band_{i}"), f32::NAN, scale);
            assert_eq!(map.handle_item(&empty, ForeignSource::Labels, None, 1.0), Ok(()));
        }
        assert!(map.take_changes(9).bands.is_empty());
    }
    map.handle_item(&band("band_7", -3.0, None), ForeignSource::Labels, None, 2.0).unwrap();
    assert_eq!(map.take_changes(9).bands[0].1.len(), 1);
}

#[test]
fn a_restored_map_is_given_away_whole() {
    let config = config(&["scene.cell_m=0.5", "labels.source=dir:labels"]);
    let mut before = ForeignMap::new(&config, 0);
    before.handle_item(&grid(2, &[0, 253, 255, 9]), ForeignSource::Labels, None, 5.0).unwrap();
    let given = before.take_changes(100);
    assert!(!before.has_changes());
    let (mut after, _) = ForeignMap::restore(&config, &before.save(1)).unwrap();
    assert_eq!(after.take_changes(100), given);
}

/// `SCENECAST_LARGE_MAP=2000` measures four million cells.
#[test]
#[expect(clippy::disallowed_methods, reason = "it measures how long the vehicle's loop takes")]
fn slices_of_a_large_map_add_up_in_the_vehicle() {
    use scenecast_protocol::time::Instant;
    let side = std::env::var("SCENECAST_LARGE_MAP").ok().and_then(|side| side.parse().ok()).unwrap_or(300u32);
    let config = config(&["scene.cell_m=0.5", "labels.source=dir:labels"]);
    let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
    let area = scenecast_core::Area { west: 0.0, south: 0.0, east: 1000.0, north: 1000.0 };
    let mut vehicle =
        crate::assemble(&config, None, profile, area, crate::Durable::default(), 1, Instant::ZERO).unwrap();
    let mut map = ForeignMap::new(&config, 0);
    let values: Vec<u8> = (0..side * side).map(|i| ((i / 300 + i / side / 40) % 20) as u8).collect();
    map.handle_item(&grid(side, &values), ForeignSource::Labels, None, 0.0).unwrap();
    for round in 0..3u8 {
        let (mut longest, mut slices, mut persisted) = (0f64, 0, 0);
        while map.has_changes() {
            let changes = map.take_changes(1 << 13);
            let began = std::time::Instant::now();
            vehicle.handle_changes(&changes, Instant::ZERO);
            while let Some(output) = vehicle.poll_output() {
                if output == crate::VehicleOutput::Persist {
                    persisted += 1;
                    vehicle.handle_persisted();
                }
            }
            longest = longest.max(began.elapsed().as_secs_f64());
            slices += 1;
        }
        println!("round {round}: {slices} slices, the longest takes {:.1} ms", longest * 1e3);
        assert!(vehicle.map() == map.labels(), "round {round}");
        assert_eq!(persisted, 1, "the labels are stored once, before the first of them is sent");
        // A class that was not there before.
        map.handle_item(&grid(1, &[round + 30]), ForeignSource::Labels, None, 1.0).unwrap();
    }
}
