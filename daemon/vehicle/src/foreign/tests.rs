use super::*;
use scenecast_protocol::map::Decimal;

fn config(sets: &[&str]) -> Config {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    scenecast_config::load(None, &sets).unwrap()
}

fn map(sets: &[&str]) -> ForeignMap {
    ForeignMap::new(&config(&[&["scene.cell_m=0.5"], sets].concat()), 3)
}

fn raster(width: u32, values: &[u8]) -> Raster {
    Raster { width, height: values.len() as u32 / width, values: values.to_vec() }
}

fn item(content: Content) -> Item {
    Item { t_s: None, classes: Vec::new(), content }
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
    seen.handle_item(&image(&[0, 1, 255, 7]), None, 4.0).unwrap();
    // Left and right of the top row: north-east and south-east.
    assert_eq!(labels(&seen), [(1, 1, 8), (2, 1, 2), (2, 2, 1)].map(|(x, y, l)| (x, y, l)));
    assert_eq!((seen.last_s(), seen.update().map.labels), (Some(4.0), 8));
    let own = item(Content::Image { pose: None, metres_per_pixel: Some(0.5), classes: raster(2, &[0, 1, 255, 7]) });
    let mut same = map(&[]);
    assert_eq!(same.handle_item(&own, None, 4.0), Err(Refusal::NoPose));
    same.handle_item(&own, Some(pose), 4.0).unwrap();
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
            seen.handle_item(&image(class), None, 0.0).unwrap();
        }
        assert_eq!(labels(&seen), [(0, 0, expected)]);
    }
}

#[test]
fn a_grid_states_each_cell_and_can_make_it_unknown() {
    let mut stated = map(&[]);
    stated.handle_item(&grid(2, &[0, 253, 255, 9]), None, 0.0).unwrap();
    assert_eq!(labels(&stated), [(1, 0, 10), (0, 1, 1), (1, 1, 254)]);
    stated.handle_item(&grid(2, &[255, 253, 3, 9]), None, 1.0).unwrap();
    let update = stated.update().map;
    assert_eq!(update.cells.len(), 4);
    assert!(update.cells.contains(&(Cell::new(0, 1), 0)) && update.cells.contains(&(Cell::new(0, 0), 4)));
    stated.handle_item(&grid(2, &[1, 1, 1, 1]), None, 2.0).unwrap();
    assert!(stated.update().map.cells.iter().all(|&(_, label)| label == 2));
}

#[test]
fn labels_and_bands_have_a_limit_on_cells_that_counts_erased_ones() {
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
        assert_eq!(map.handle_item(&place(of(&[1; 6]), 0.0), None, 0.0), full);
        assert!(map.update().bands.is_empty() && map.update().map.cells.is_empty(), "nothing of it is used");
        map.handle_item(&place(of(&[1; 4]), 0.0), None, 0.0).unwrap();
        map.handle_item(&place(of(&[2; 4]), 0.0), None, 1.0).unwrap();
        map.handle_item(&place(of(&[255; 4]), 0.0), None, 2.0).unwrap();
        assert_eq!(map.handle_item(&place(of(&[1; 2]), 50.0), None, 3.0), full, "erased cells are cells");
        map.handle_item(&place(of(&[255; 9]), 0.0), None, 4.0).unwrap();
        map.handle_item(&place(of(&[3; 5]), 0.0), None, 5.0).unwrap();
    }
}

#[test]
fn a_class_keeps_its_name_and_a_band_its_scale() {
    let mut map = map(&[]);
    let named = |name: &str| Item { classes: vec![ClassEntry::new(4, name, None).unwrap()], ..grid(1, &[3]) };
    map.handle_item(&named("rock"), None, 0.0).unwrap();
    let refused = map.handle_item(&named("mud"), None, 1.0).unwrap_err();
    assert_eq!(refused, Refusal::OtherName(3, "rock".to_owned()));
    assert_eq!((map.last_s(), map.update().classes[0].name()), (Some(0.0), "rock"));
    let band = |scale: i32, name: &str| {
        let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
        let (scale, offset) = (Decimal::new(scale, -1), Decimal::new(-80, 0));
        let band = Band { name: name.into(), unit: "dB".into(), scale, offset, no_data: 255 };
        item(Content::Band { band, ground, levels: raster(3, &[0, 100, 255]) })
    };
    map.handle_item(&band(5, "backscatter"), None, 2.0).unwrap();
    assert_eq!(map.handle_item(&band(6, "backscatter"), None, 3.0), Err(Refusal::OtherBand("backscatter".into())));
    let (layer, cells) = map.update().bands.remove(0);
    assert_eq!((&*layer.name, &*layer.unit, layer.share), ("backscatter", "dB", 8));
    assert_eq!(cells, [(Cell::new(0, 0), -80.0), (Cell::new(1, 0), -30.0)]);
    let full = (0..20).find_map(|i| map.handle_item(&band(5, &format!("band_{i}")), None, 4.0).err());
    assert!(matches!(full, Some(Refusal::TooManyBands(_))));
}

#[test]
fn a_restored_foreign_map_is_the_saved_one() {
    let mut before = map(&[]);
    before.handle_item(&grid(2, &[0, 253, 255, 9]), None, 5.0).unwrap();
    before.handle_item(&grid(1, &[255]), None, 6.0).unwrap();
    before.set_mark("000017");
    before.classes.insert(10, ClassEntry::new(10, "kelp", Some([1, 2, 3])).unwrap());
    let config = config(&["scene.cell_m=0.5"]);
    let bytes = before.save(77);
    let (after, lineage) = ForeignMap::restore(&config, &bytes).unwrap();
    assert_eq!((after, lineage), (before, 77));
    let other = ForeignMap::restore(&self::config(&["scene.cell_m=0.25"]), &bytes).unwrap_err();
    assert_eq!(other.to_string(), "it was made with cells of 0.5 m");
    for cut in 0..bytes.len() {
        assert!(ForeignMap::restore(&config, &bytes[..cut]).is_err());
    }
}
