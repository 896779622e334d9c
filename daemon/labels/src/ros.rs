//! Messages of ROS 2 as items.

use crate::refusal::{LayerFault, MessageFault};
use crate::{Band, Content, Ground, Item, ItemTime, QuantityBand, Raster, Refusal};
use scenecast_messages::geometry_msgs::Quaternion;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::sensor_msgs::Image;
use scenecast_messages::std_msgs::{Float32MultiArray, Header};
use scenecast_protocol::map::{Decimal, LayerDescriptor, MAX_CLASS};

/// Frames of reference that stand still, of ROS REP 105.
const STILL_FRAMES: [&str; 2] = ["map", "odom"];
/// Turn of a grid that is taken for none, radians: on 2000 cells less than half a cell.
const MAX_TURN_RAD: f64 = 1e-4;

/// Refuses a message in another frame of reference than `wanted`; without a wanted one, `map`, `odom` and none are taken.
fn check_frame(header: &Header, wanted: &str) -> Result<(), Refusal> {
    let frame = header.frame_id.trim_start_matches('/');
    let (is_taken, taken) = match wanted.trim_start_matches('/') {
        "" => (frame.is_empty() || STILL_FRAMES.contains(&frame), "map or odom, or that of labels.frame,".to_owned()),
        wanted => (frame == wanted, format!("{wanted:?}, that of labels.frame,")),
    };
    if is_taken { Ok(()) } else { Err(Refusal::Frame(header.frame_id.clone(), taken)) }
}

/// Refuses a grid that does not lie along east and north. A quaternion of zeros, as messages have that nobody filled in, is
/// no turn.
fn check_turn(q: &Quaternion) -> Result<(), Refusal> {
    let length = q.x.hypot(q.y).hypot(q.z).hypot(q.w);
    // The angle about the axis, whichever that is.
    let turn_rad = 2.0 * q.x.hypot(q.y).hypot(q.z).atan2(q.w.abs());
    match length < 1e-9 || turn_rad <= MAX_TURN_RAD {
        true => Ok(()),
        false => Err(Refusal::Turned(turn_rad.to_degrees())),
    }
}

/// The time of a header; that of the arrival if it has none.
fn time(header: &Header) -> ItemTime {
    match header.stamp.nanos() {
        nanos if nanos > 0 => ItemTime::Unix(nanos as f64 / 1e9),
        _ => ItemTime::Arrival,
    }
}

/// Metres within the bounds of a place on the map.
fn metres(what: &'static str, value: f64) -> Result<f64, Refusal> {
    if value.abs() <= 1e6 { Ok(value) } else { Err(Refusal::Range(what, value, "-1e6 to 1e6 m")) }
}

/// The edge of a cell.
fn edge(value: f64) -> Result<f64, Refusal> {
    if (1e-4..=1e4).contains(&value) { Ok(value) } else { Err(Refusal::Range("resolution", value, "1e-4 to 1e4 m")) }
}

/// A name for people as that of a band: `Elevation (m)` becomes `elevation__m_`.
fn band_name(name: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    name.chars().map(word).take(LayerDescriptor::MAX_NAME).collect()
}

/// Layers of a message at most: more than a map has.
const MAX_LAYERS: usize = 64;

/// A band for each layer, or why it is refused. The vehicle chooses the scales.
pub fn bands_of_grid_map(map: &GridMap, frame: &str) -> Vec<Result<Item, Refusal>> {
    let place = match Place::of(map, frame) {
        Ok(place) => place,
        Err(why) => return vec![Err(why)],
    };
    let band = |(layer, array): (&String, &Float32MultiArray)| {
        let name = band_name(layer);
        let quantities = place.raster(array).map_err(|fault| MessageFault::Layer(layer.clone(), fault))?;
        if name.is_empty() {
            return Err(Refusal::Band);
        }
        let band = QuantityBand { name, unit: String::new(), scale: None };
        let content = Content::Quantities { band, ground: place.ground, quantities };
        Ok(Item { time: time(&map.header), classes: Vec::new(), content })
    };
    map.layers.iter().zip(&map.data).map(band).collect()
}

/// Size and place of the layers: rows run along x and columns along y, both from their largest coordinate on.
struct Place {
    ground: Ground,
    rows: u32,
    columns: u32,
    /// Where the buffer begins, which is a ring in both directions.
    first: (u32, u32),
}

impl Place {
    fn of(map: &GridMap, frame: &str) -> Result<Self, Refusal> {
        check_frame(&map.header, frame)?;
        check_turn(&map.info.pose.orientation)?;
        if map.layers.len() != map.data.len() || map.layers.is_empty() || map.layers.len() > MAX_LAYERS {
            return Err(MessageFault::Layers { names: map.layers.len(), arrays: map.data.len() }.into());
        }
        let cell_m = edge(map.info.resolution)?;
        let cells = |length: f64| (length / cell_m).round().clamp(0.0, f64::from(u32::MAX)) as u32;
        let (rows, columns) = (cells(map.info.length_x), cells(map.info.length_y));
        Raster::<f32>::check(rows, columns)?;
        let first = (u32::from(map.outer_start_index), u32::from(map.inner_start_index));
        if first.0 >= rows || first.1 >= columns {
            return Err(MessageFault::StartIndex.into());
        }
        let middle = &map.info.pose.position;
        let corner = |middle: f64, cells: u32| middle - f64::from(cells) * cell_m / 2.0;
        let ground = Ground {
            west_m: metres("x", corner(middle.x, rows))?,
            south_m: metres("y", corner(middle.y, columns))?,
            cell_m,
        };
        Ok(Self { ground, rows, columns, first })
    }

    /// The numbers of a layer from the north-west on.
    fn raster(&self, array: &Float32MultiArray) -> Result<Raster<f32>, LayerFault> {
        let Self { rows, columns, first, .. } = *self;
        let [outer, inner] = array.layout.dim.as_slice() else {
            return Err(LayerFault::Dimensions(array.layout.dim.len()));
        };
        // grid_map writes column by column; the names of the dimensions tell.
        let is_by_rows = outer.label == "row_index";
        let expected = if is_by_rows { (rows, columns) } else { (columns, rows) };
        let sizes = (outer.size, inner.size);
        if sizes != expected {
            return Err(LayerFault::Sizes { sizes, rows, columns });
        }
        let begin = array.layout.data_offset as usize;
        let (found, needed) = (array.data.len(), rows as usize * columns as usize);
        let numbers = begin.checked_add(needed).and_then(|end| array.data.get(begin..end));
        let numbers = numbers.ok_or(LayerFault::Numbers { found, needed })?;
        let at = |row: u32, column: u32| {
            let (row, column) = ((row + first.0) % rows, (column + first.1) % columns);
            let (major, minor) = if is_by_rows { (row, column) } else { (column, row) };
            let place = major as usize * expected.1 as usize + minor as usize;
            numbers.get(place).copied().unwrap_or(f32::NAN)
        };
        // The first column is the northern one, the last row the western one.
        let values = (0..columns).flat_map(|column| (0..rows).rev().map(move |row| (row, column)));
        let values = values.map(|(row, column)| at(row, column)).collect();
        Ok(Raster { width: rows, height: columns, values })
    }
}

/// A segmented image without a pose: the value of a pixel of `mono8` or `8UC1` is its class, 255 is unknown.
///
/// # Errors
///
/// Another encoding, sizes that contradict each other, class 254.
pub fn item_of_image(image: &Image) -> Result<Item, Refusal> {
    if !matches!(image.encoding.as_str(), "mono8" | "8UC1") {
        return Err(MessageFault::Encoding(image.encoding.clone()).into());
    }
    let (width, height, step) = (image.width, image.height, image.step as usize);
    Raster::<u8>::check(width, height)?;
    let needed = (height as usize - 1).checked_mul(step).and_then(|bytes| bytes.checked_add(width as usize));
    if step < width as usize || needed.is_none_or(|needed| image.data.len() < needed) {
        return Err(Refusal::RawLength(image.data.len(), width, height));
    }
    let rows = image.data.chunks(step).take(height as usize);
    let values: Vec<u8> = rows.flat_map(|row| row.iter().take(width as usize)).copied().collect();
    if let Some(&class) = values.iter().find(|&&class| class > MAX_CLASS && class != u8::MAX) {
        return Err(Refusal::Class(class));
    }
    let classes = Raster { width, height, values };
    let content = Content::Image { pose: None, metres_per_pixel: None, classes };
    Ok(Item { time: time(&image.header), classes: Vec::new(), content })
}

/// A whole grid of classes: the octet of a value is the class, 0 to 253, and -1 is unknown.
///
/// # Errors
///
/// Another frame of reference than `frame` (empty: `map` or `odom`), a turned grid, sizes out of range, class 254.
pub fn item_of_occupancy(grid: &OccupancyGrid, frame: &str) -> Result<Item, Refusal> {
    let (ground, classes) = raster(grid, frame)?;
    if let Some(&class) = classes.values.iter().find(|&&class| class > MAX_CLASS && class != u8::MAX) {
        return Err(Refusal::Class(class));
    }
    Ok(Item { time: time(&grid.header), classes: Vec::new(), content: Content::Grid { ground, classes } })
}

/// A band whose values are those of the grid, such as a costmap; -1 is not known. Its name is the last part of the topic.
///
/// # Errors
///
/// As [`item_of_occupancy`].
pub fn band_of_occupancy(grid: &OccupancyGrid, topic: &str, frame: &str) -> Result<Item, Refusal> {
    let (ground, levels) = raster(grid, frame)?;
    let name = band_name(topic.rsplit('/').next().unwrap_or(topic));
    let one = Decimal::new(1, 0);
    let band = Band { name, unit: String::new(), scale: one, offset: Decimal::new(0, 0), no_data: u8::MAX };
    Ok(Item { time: time(&grid.header), classes: Vec::new(), content: Content::Band { band, ground, levels } })
}

/// The octets of the values, from the north.
fn raster(grid: &OccupancyGrid, frame: &str) -> Result<(Ground, Raster), Refusal> {
    check_frame(&grid.header, frame)?;
    check_turn(&grid.info.origin.orientation)?;
    let (width, height) = (grid.info.width, grid.info.height);
    Raster::<u8>::check(width, height)?;
    if grid.data.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(Refusal::RawLength(grid.data.len(), width, height));
    }
    // The number that a person wrote, of which the message has the nearest binary one.
    let resolution = grid.info.resolution.to_string().parse().unwrap_or(f64::NAN);
    let position = &grid.info.origin.position;
    let ground =
        Ground { west_m: metres("x", position.x)?, south_m: metres("y", position.y)?, cell_m: edge(resolution)? };
    let rows = grid.data.chunks_exact(width as usize).rev();
    let values = rows.flatten().map(|value| value.cast_unsigned()).collect();
    Ok((ground, Raster { width, height, values }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ItemTime;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::geometry_msgs::Quaternion;
    use scenecast_messages::std_msgs::{MultiArrayDimension, MultiArrayLayout};

    #[test]
    fn frames_that_move_with_the_robot_are_refused() {
        let of = |frame: &str, wanted| check_frame(&Header { frame_id: frame.to_owned(), ..Header::default() }, wanted);
        assert!(of("map", "").is_ok() && of("/odom", "").is_ok() && of("", "").is_ok() && of("world", "world").is_ok());
        let refused = of("base_link", "").unwrap_err().to_string();
        assert!(refused.contains("\"base_link\": map or odom"), "{refused}");
        assert!(of("map", "world").is_err() && of("", "world").is_err());
    }

    #[test]
    fn a_turned_grid_is_refused_with_its_angle() {
        assert!(check_turn(&Quaternion::from_yaw(0.0)).is_ok());
        assert!(check_turn(&Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 }).is_ok());
        assert!(check_turn(&Quaternion { x: 0.0, y: 0.0, z: 0.0, w: -1.0 }).is_ok());
        let refused = check_turn(&Quaternion::from_yaw(0.5)).unwrap_err().to_string();
        assert!(refused.contains("28.65 degrees"), "{refused}");
        assert!(check_turn(&Quaternion { x: f64::NAN, y: 0.0, z: 0.0, w: 1.0 }).is_err());
    }

    /// Two rows along x and three columns along y; a number tells the cell of its row and its column.
    fn map(numbers: &[f32]) -> GridMap {
        let dimension = |label: &str, size, stride| MultiArrayDimension { label: label.to_owned(), size, stride };
        let dim = vec![dimension("column_index", 3, 6), dimension("row_index", 2, 2)];
        let array = Float32MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data: numbers.to_vec() };
        let mut map = GridMap { layers: vec!["Elevation (m)".to_owned()], data: vec![array], ..GridMap::default() };
        (map.info.resolution, map.info.length_x, map.info.length_y) = (0.5, 1.0, 1.5);
        (map.info.pose.position.x, map.info.pose.position.y) = (10.0, 20.0);
        map
    }

    fn raster(map: &GridMap) -> Vec<f32> {
        let item = bands_of_grid_map(map, "").remove(0).unwrap();
        let Content::Quantities { band, ground, quantities } = item.content else { panic!() };
        assert_eq!((&*band.name, band.scale), ("elevation__m_", None));
        assert_eq!(ground, Ground { west_m: 9.5, south_m: 19.25, cell_m: 0.5 });
        assert_eq!((quantities.width, quantities.height), (2, 3));
        quantities.values
    }

    #[test]
    fn a_layer_is_unrolled_from_its_ring() {
        // Row, then column; the row with the largest x comes first, and so does the column with the largest y.
        let plain = map(&[0.0, 10.0, 1.0, 11.0, 2.0, 12.0]);
        assert_eq!(raster(&plain), [10.0, 0.0, 11.0, 1.0, 12.0, 2.0]);
        // The buffer begins at its second row and third column.
        let mut ring = map(&[11.0, 1.0, 12.0, 2.0, 10.0, 0.0]);
        (ring.outer_start_index, ring.inner_start_index) = (1, 2);
        assert_eq!(raster(&ring), [10.0, 0.0, 11.0, 1.0, 12.0, 2.0]);
        let mut by_rows = map(&[0.0, 1.0, 2.0, 10.0, 11.0, 12.0]);
        by_rows.data[0].layout.dim.reverse();
        assert_eq!(raster(&by_rows), [10.0, 0.0, 11.0, 1.0, 12.0, 2.0]);
    }

    #[test]
    fn unusable_grid_maps_are_refused_by_name() {
        let said = |change: &dyn Fn(&mut GridMap)| {
            let mut map = map(&[0.0; 6]);
            change(&mut map);
            bands_of_grid_map(&map, "").remove(0).unwrap_err().to_string()
        };
        assert!(said(&|m| m.layers.clear()).contains("0 names of layers and 1 arrays"));
        assert!(said(&|m| m.outer_start_index = 2).contains("start index"));
        assert!(said(&|m| m.info.length_x = 5.0).contains("3 x 2 numbers on 10 x 3 cells"));
        assert!(said(&|m| m.info.length_x = f64::NAN).contains("0 x 3"));
        assert!(said(&|m| m.info.length_y = 1e300).contains("pixels"));
        assert!(said(&|m| m.info.resolution = 0.0).contains("resolution"));
        assert!(said(&|m| m.data[0].data.truncate(5)).contains("5 numbers, and 6 are needed"));
        assert!(said(&|m| m.data[0].layout.data_offset = u32::MAX).contains("are needed"));
        assert!(said(&|m| m.data[0].layout.dim.clear()).contains("0 dimensions"));
        assert!(said(&|m| m.info.pose.orientation = Quaternion::from_yaw(0.3)).contains("turned"));
        assert!(said(&|m| m.layers[0].clear()).contains("the band"));
    }

    #[test]
    fn rows_with_padding_become_a_raster() {
        let mut image = Image { height: 2, width: 2, encoding: "mono8".to_owned(), step: 3, ..Image::default() };
        image.header.stamp = Time::from_nanos(1_700_000_000_500_000_000);
        image.data = vec![1, 255, 99, 3, 4];
        let item = item_of_image(&image).unwrap();
        assert_eq!(item.time, ItemTime::Unix(1_700_000_000.5));
        assert!(
            matches!(&item.content, Content::Image { classes, pose: None, .. } if classes.values == [1, 255, 3, 4])
        );
        let said = |image: &Image| item_of_image(image).unwrap_err().to_string();
        assert!(said(&Image { encoding: "rgb8".to_owned(), ..image.clone() }).contains("\"rgb8\": mono8"));
        assert!(said(&Image { step: 1, ..image.clone() }).contains("not those of 2 x 2"));
        assert!(said(&Image { step: u32::MAX, ..image.clone() }).contains("not those"));
        assert!(said(&Image { height: 0, ..image.clone() }).contains("2 x 0"));
        image.data[4] = 254;
        assert!(said(&image).contains("class 254"));
    }

    fn grid() -> OccupancyGrid {
        let mut grid = OccupancyGrid::default();
        grid.header.frame_id = "map".to_owned();
        grid.info.resolution = 0.1;
        (grid.info.width, grid.info.height) = (3, 2);
        (grid.info.origin.position.x, grid.info.origin.position.y) = (-4.0, 7.0);
        grid.data = vec![0, 1, -1, 100, -3, 5];
        grid
    }

    #[test]
    fn the_octets_of_a_grid_are_classes_from_the_south() {
        let item = item_of_occupancy(&grid(), "").unwrap();
        let Content::Grid { ground, classes } = item.content else { panic!() };
        assert_eq!(ground, Ground { west_m: -4.0, south_m: 7.0, cell_m: 0.1 });
        assert_eq!(classes.values, [100, 253, 5, 0, 1, 255]);
        let costs = band_of_occupancy(&grid(), "/local_costmap/costmap", "").unwrap();
        let Content::Band { band, levels, .. } = costs.content else { panic!() };
        assert_eq!((&*band.name, band.no_data, levels), ("costmap", 255, classes));
    }

    #[test]
    fn unusable_grids_are_refused_by_name() {
        let said = |change: &dyn Fn(&mut OccupancyGrid)| {
            let mut grid = grid();
            change(&mut grid);
            item_of_occupancy(&grid, "").unwrap_err().to_string()
        };
        assert!(said(&|g| g.data[2] = -2).contains("class 254"));
        assert!(said(&|g| g.data.truncate(5)).contains("not those of 3 x 2"));
        assert!(said(&|g| g.info.origin.orientation = Quaternion::from_yaw(1.0)).contains("turned"));
        assert!(said(&|g| g.header.frame_id = "base_link".to_owned()).contains("base_link"));
        assert!(said(&|g| g.info.resolution = f32::NAN).contains("resolution"));
        assert!(said(&|g| g.info.origin.position.x = f64::INFINITY).contains("x inf"));
        assert!(said(&|g| (g.info.width, g.info.height) = (u32::MAX, u32::MAX)).contains("pixels"));
        assert!(said(&|g| g.info.width = 0).contains("0 x 2"));
    }
}
