//! Random and damaged bytes through every reader of labels.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use scenecast_labels::ros::{band_of_occupancy, bands_of_grid_map, item_of_image, item_of_occupancy};
use scenecast_labels::{Item, Refusal, Stream};
use scenecast_messages::geometry_msgs::Quaternion;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::sensor_msgs::Image;
use scenecast_messages::std_msgs::{Float32MultiArray, MultiArrayDimension, MultiArrayLayout};
use scenecast_messages::{Message, decode, encode};

/// Inputs of the usual run; SCENECAST_LABEL_INPUTS=10000000 is the long one.
const INPUTS: u64 = 60_000;

const HEADERS: [&str; 5] = [
    r##"{"kind":"grid","west_m":0,"south_m":1,"cell_m":0.5,"encoding":"raw","width":3,"height":2,"bytes":6,"age_s":2,"classes":[{"class":1,"name":"rock","colour":"#102030"}]}"##,
    r#"{"kind":"image","t_s":3,"x_m":1,"y_m":2,"metres_per_pixel":0.1,"encoding":"raw","width":2,"height":3,"bytes":6}"#,
    r#"{"kind":"band","name":"silt","scale":0.5,"offset":-8,"west_m":0,"south_m":0,"cell_m":1,"encoding":"raw16","width":1,"height":3,"bytes":6,"low":0,"step":2}"#,
    r#"{"kind":"band","name":"ph","time":1700000000,"west_m":0,"south_m":0,"cell_m":1,"encoding":"float32","width":1,"height":1,"bytes":4}"#,
    r#"{"kind":"classes","classes":[{"class":9,"name":"kelp"}]}"#,
];

fn png(depth: png::BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 5, 4);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![3; 20 * if depth == png::BitDepth::Sixteen { 2 } else { 1 }]).unwrap();
    writer.finish().unwrap();
    bytes
}

fn occupancy() -> OccupancyGrid {
    let mut grid = OccupancyGrid { data: vec![1, 2, -1, 4, 5, 6], ..OccupancyGrid::default() };
    (grid.info.width, grid.info.height, grid.info.resolution) = (3, 2, 0.25);
    grid.info.origin.orientation = Quaternion::from_yaw(0.0);
    grid
}

fn grid_map() -> GridMap {
    let dimension = |label: &str, size| MultiArrayDimension { label: label.to_owned(), size, stride: size };
    let dim = vec![dimension("column_index", 2), dimension("row_index", 3)];
    let array = Float32MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data: vec![1.0; 6] };
    let mut map = GridMap { layers: vec!["silt".to_owned()], data: vec![array], ..GridMap::default() };
    (map.info.resolution, map.info.length_x, map.info.length_y) = (0.5, 1.5, 1.0);
    map
}

fn image() -> Image {
    Image { width: 2, height: 2, step: 3, encoding: "mono8".to_owned(), data: vec![1; 6], ..Image::default() }
}

/// Overwrites, inserts or removes a few bytes; some of the new ones are small, as lengths are.
fn damage(bytes: &mut Vec<u8>, random: &mut Xoshiro256PlusPlus) {
    for _ in 0..random.next_u64() % 5 {
        let at = (random.next_u64() % (bytes.len() as u64 + 1)) as usize;
        let byte = random.next_u64() as u8 >> (random.next_u64() % 8);
        match random.next_u64() % 5 {
            0 => bytes.insert(at, byte),
            1 if at < bytes.len() => drop(bytes.remove(at)),
            2 => bytes.truncate(at),
            _ if at < bytes.len() => bytes[at] = byte,
            _ => {}
        }
    }
}

fn count(result: &Result<Item, Refusal>, counts: &mut [u64; 2]) {
    counts[usize::from(result.is_err())] += 1;
    if let Err(why) = result {
        assert!(!why.to_string().is_empty());
    }
}

/// A message of these bytes, if they are one.
fn message<M: Message>(good: &[u8], random: &mut Xoshiro256PlusPlus) -> Option<M> {
    let mut bytes = good.to_vec();
    damage(&mut bytes, random);
    decode(&bytes).ok()
}

#[test]
fn random_and_damaged_labels_never_panic() {
    let inputs = std::env::var("SCENECAST_LABEL_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(INPUTS);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(18);
    let pictures = [png(png::BitDepth::Eight), png(png::BitDepth::Sixteen), vec![1; 6], vec![0, 0, 128, 63]];
    let (occupancy, grid_map, image) = (encode(&occupancy()), encode(&grid_map()), encode(&image()));
    let (mut counts, mut messages) = ([0; 2], 0);
    for _ in 0..inputs {
        let mut pick = |from: usize| (random.next_u64() % from as u64) as usize;
        let (kind, header, picture) = (pick(6), HEADERS[pick(HEADERS.len())], &pictures[pick(pictures.len())]);
        match kind {
            0 => {
                let (mut header, mut picture) = (header.as_bytes().to_vec(), picture.clone());
                damage(&mut header, &mut random);
                damage(&mut picture, &mut random);
                let _ = Item::peek(&header);
                count(&Item::read(&header, &picture), &mut counts);
            }
            1 => {
                // Only the picture is damaged.
                let header = header.replace(r#""encoding":"raw","#, "");
                let mut picture = picture.clone();
                damage(&mut picture, &mut random);
                count(&Item::read(header.as_bytes(), &picture), &mut counts);
            }
            2 => {
                let mut bytes = [header.as_bytes(), b"\n", picture].concat().repeat(2);
                damage(&mut bytes, &mut random);
                let (mut stream, at) = (Stream::default(), bytes.len() / 3);
                bytes.chunks(at.max(1)).for_each(|piece| stream.push(piece, |item| count(&item, &mut counts)));
                let _ = stream.finish();
            }
            3 => {
                let Some(grid) = message::<OccupancyGrid>(&occupancy, &mut random) else { continue };
                messages += 1;
                count(&item_of_occupancy(&grid, ""), &mut counts);
                count(&band_of_occupancy(&grid, "/map/costmap", "map"), &mut counts);
            }
            4 => {
                let Some(map) = message::<GridMap>(&grid_map, &mut random) else { continue };
                messages += 1;
                bands_of_grid_map(&map, "").iter().for_each(|item| count(item, &mut counts));
            }
            _ => {
                let Some(image) = message::<Image>(&image, &mut random) else { continue };
                messages += 1;
                count(&item_of_image(&image), &mut counts);
            }
        }
    }
    println!("{inputs} inputs: {} items taken, {} refused, {messages} messages", counts[0], counts[1]);
    assert!(counts[0] > inputs / 20 && counts[1] > inputs / 20 && messages > inputs / 20, "it reaches too little");
}
