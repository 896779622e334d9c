//! `grid_map_msgs/msg/GridMap`: a band for each layer.

use super::{band_name, check_frame, check_turn, edge, metres, time};
use crate::{Content, Ground, Item, QuantityBand, Raster, Refusal};
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::std_msgs::Float32MultiArray;

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
        let quantities = place.raster(array).map_err(|why| Refusal::Message(format!("layer {layer:?}: {why}")))?;
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
            let text = format!("{} names of layers and {} arrays", map.layers.len(), map.data.len());
            return Err(Refusal::Message(text));
        }
        let cell_m = edge(map.info.resolution)?;
        let cells = |length: f64| (length / cell_m).round().clamp(0.0, f64::from(u32::MAX)) as u32;
        let (rows, columns) = (cells(map.info.length_x), cells(map.info.length_y));
        Raster::<f32>::check(rows, columns)?;
        let first = (u32::from(map.outer_start_index), u32::from(map.inner_start_index));
        if first.0 >= rows || first.1 >= columns {
            return Err(Refusal::Message("a start index lies outside of the grid".to_owned()));
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
    fn raster(&self, array: &Float32MultiArray) -> Result<Raster<f32>, String> {
        let Self { rows, columns, first, .. } = *self;
        let [outer, inner] = array.layout.dim.as_slice() else {
            return Err(format!("{} dimensions, and two are taken", array.layout.dim.len()));
        };
        // grid_map writes column by column; the names of the dimensions tell.
        let is_by_rows = outer.label == "row_index";
        let expected = if is_by_rows { (rows, columns) } else { (columns, rows) };
        if (outer.size, inner.size) != expected {
            return Err(format!("{} x {} numbers on {rows} x {columns} cells", outer.size, inner.size));
        }
        let begin = array.layout.data_offset as usize;
        let count = rows as usize * columns as usize;
        let numbers = begin.checked_add(count).and_then(|end| array.data.get(begin..end));
        let numbers = numbers.ok_or(format!("{} numbers, and {count} are needed", array.data.len()))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::geometry_msgs::Quaternion;
    use scenecast_messages::std_msgs::{MultiArrayDimension, MultiArrayLayout};

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
}
