//! The map as messages of ROS 2: labels as an occupancy grid, explored cells as a coloured cloud, all layers as a grid map.

use crate::geometry_msgs::{Point, Pose, Quaternion};
use crate::grid_map_msgs::{GridMap, GridMapInfo};
use crate::nav_msgs::{MapMetaData, OccupancyGrid};
use crate::sensor_msgs::{PointCloud2, PointField};
use crate::std_msgs::{Float32MultiArray, Header, MultiArrayDimension, MultiArrayLayout};
use scenecast_protocol::map::{Cell, Rect};

/// Bytes of a point: x, y, z and the colour with four bytes each, the label, and three of padding.
const POINT: u32 = 20;

/// The middle of each explored cell in the colour of its label, at the depth of the sea floor where that is known, or else at
/// 0. Viewers read `rgb` as a float whose octets are blue, green, red and 0.
pub fn cloud(grid: &Grid, header: Header, colour: impl Fn(u8) -> [u8; 3]) -> PointCloud2 {
    let (west, south) = grid.corner_m();
    let depths = grid.layers.iter().find(|layer| layer.is_depth).map(|layer| &layer.values);
    let mut data = Vec::new();
    for (at, &label) in grid.labels.iter().enumerate().filter(|(_, label)| **label != 0) {
        let (row, column) = (at / grid.area.width as usize, at % grid.area.width as usize);
        let middle = |corner: f64, index: usize| (corner + (index as f64 + 0.5) * grid.cell_m) as f32;
        let depth = depths.and_then(|depths| depths.get(at)).copied().filter(|depth| !depth.is_nan());
        for coordinate in [middle(west, column), middle(south, row), -depth.unwrap_or(0.0)] {
            data.extend(coordinate.to_le_bytes());
        }
        let [red, green, blue] = colour(label);
        data.extend([blue, green, red, 0, label, 0, 0, 0]);
    }
    let field = |name: &str, offset, datatype| PointField { name: name.to_owned(), offset, datatype, count: 1 };
    let fields = vec![
        field("x", 0, PointField::FLOAT32),
        field("y", 4, PointField::FLOAT32),
        field("z", 8, PointField::FLOAT32),
        field("rgb", 12, PointField::FLOAT32),
        field("label", 16, PointField::UINT8),
    ];
    let row_step = data.len() as u32;
    PointCloud2 {
        header,
        height: 1,
        width: row_step / POINT,
        fields,
        is_bigendian: false,
        point_step: POINT,
        row_step,
        data,
        is_dense: true,
    }
}

/// Cells of a grid at most: as one message it has 4 MiB, and 16 MiB a layer.
pub const MAX_GRID_CELLS: u64 = 1 << 22;

/// The cells of a map within a rectangle, row by row from the south, each row from the west.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub area: Rect,
    /// The edge of a cell, metres.
    pub cell_m: f64,
    /// From the cells' own frame to that of the message, metres east and north.
    pub shift_m: (f64, f64),
    /// The label of each cell; 0 is unexplored.
    pub labels: Vec<u8>,
    pub layers: Vec<GridLayer>,
}

/// A quantity of the cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GridLayer {
    pub name: String,
    /// Whether it is the depth of the sea floor, metres.
    pub is_depth: bool,
    /// The quantity of each cell; NaN where it is not known.
    pub values: Vec<f32>,
}

impl Grid {
    /// The labels of a rectangle; `None` if it has more than [`MAX_GRID_CELLS`] cells.
    pub fn new(area: Rect, cell_m: f64, shift_m: (f64, f64), label: impl Fn(Cell) -> u8) -> Option<Self> {
        let is_small = area.area() <= MAX_GRID_CELLS;
        is_small.then(|| Self { area, cell_m, shift_m, labels: area.cells().map(label).collect(), layers: Vec::new() })
    }

    /// Adds a layer, with the `value` of each cell of the area.
    pub fn add_layer(&mut self, name: &str, is_depth: bool, value: impl Fn(Cell) -> Option<f64>) {
        let values = self.area.cells().map(|cell| value(cell).map_or(f32::NAN, |value| value as f32)).collect();
        self.layers.push(GridLayer { name: name.to_owned(), is_depth, values });
    }

    /// The south-west corner, metres east and north in the frame of the message.
    pub fn corner_m(&self) -> (f64, f64) {
        let Rect { x, y, .. } = self.area;
        (f64::from(x) * self.cell_m + self.shift_m.0, f64::from(y) * self.cell_m + self.shift_m.1)
    }

    /// Its width from west to east and its height from south to north, metres.
    pub fn size_m(&self) -> (f64, f64) {
        (f64::from(self.area.width) * self.cell_m, f64::from(self.area.height) * self.cell_m)
    }
}

#[cfg(test)]
pub(crate) fn example() -> Grid {
    let area = Rect { x: -1, y: 2, width: 3, height: 2 };
    // North row: 4 0 6; south row: 1 2 200.
    let label = |cell: Cell| match (cell.x, cell.y) {
        (-1, 2) => 1,
        (0, 2) => 2,
        (1, 2) => 200,
        (-1, 3) => 4,
        (1, 3) => 6,
        _ => 0,
    };
    let mut grid = Grid::new(area, 0.5, (10.0, 20.0), label).unwrap();
    grid.add_layer("depth", true, |cell| (cell.y == 2).then_some(f64::from(cell.x) + 8.0));
    grid
}

/// The labels, as the layer `label`, and the other layers of a grid; NaN where a cell has no value.
///
/// A matrix of `grid_map` has its rows along x and its columns along y, begins where both are largest, and is written column
/// by column.
pub fn layers(grid: &Grid, header: Header) -> GridMap {
    let ((west, south), (length_x, length_y)) = (grid.corner_m(), grid.size_m());
    let position = Point { x: west + length_x / 2.0, y: south + length_y / 2.0, z: 0.0 };
    let labels: Vec<f32> = grid.labels.iter().map(|&l| if l == 0 { f32::NAN } else { f32::from(l) }).collect();
    let all = || std::iter::once(("label", &labels)).chain(grid.layers.iter().map(|l| (l.name.as_str(), &l.values)));
    GridMap {
        header,
        info: GridMapInfo {
            resolution: grid.cell_m,
            length_x,
            length_y,
            pose: Pose { position, orientation: Quaternion::from_yaw(0.0) },
        },
        layers: all().map(|(name, _)| name.to_owned()).collect(),
        basic_layers: vec!["label".to_owned()],
        data: all().map(|(_, values)| matrix(grid, values)).collect(),
        outer_start_index: 0,
        inner_start_index: 0,
    }
}

/// Rows from the south, each from the west, as a matrix of `grid_map`: since its columns are along y, each column is one of
/// these rows, backwards, and the northernmost comes first.
fn matrix(grid: &Grid, values: &[f32]) -> Float32MultiArray {
    let (width, height) = (grid.area.width, grid.area.height);
    let dimension = |label: &str, size, stride| MultiArrayDimension { label: label.to_owned(), size, stride };
    let dim = vec![dimension("column_index", height, width * height), dimension("row_index", width, width)];
    Float32MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data: values.iter().rev().copied().collect() }
}

/// The labels of a grid: -1 for an unexplored cell, or else the label. Labels above 127 appear as negative numbers, whose
/// octet is the label; no label is 255, the octet of -1.
pub fn occupancy(grid: &Grid, header: Header) -> OccupancyGrid {
    let (x, y) = grid.corner_m();
    let info = MapMetaData {
        map_load_time: header.stamp.clone(),
        resolution: grid.cell_m as f32,
        width: grid.area.width,
        height: grid.area.height,
        origin: Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(0.0) },
    };
    let value = |&label: &u8| if label == 0 { -1 } else { label.cast_signed() };
    OccupancyGrid { header, info, data: grid.labels.iter().map(value).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn explored_cells_become_points_in_the_colours_of_their_labels() {
        let cloud = cloud(&example(), Header::default(), |label| [label, 2, 3]);
        assert_eq!((cloud.width, cloud.row_step, cloud.data.len()), (5, 100, 100));
        let coordinate = |point: usize, field: usize| {
            let at = point * POINT as usize + field * 4;
            f32::from_le_bytes(cloud.data[at..at + 4].try_into().unwrap())
        };
        assert_eq!([0, 1, 2].map(|field| coordinate(0, field)), [9.75, 21.25, -7.0]);
        assert_eq!([0, 1, 2].map(|field| coordinate(4, field)), [10.75, 21.75, -0.0], "without a depth");
        assert_eq!(cloud.data[12..20], [3, 2, 1, 0, 1, 0, 0, 0]);
    }

    #[test]
    fn a_grid_has_its_corner_in_the_frame_of_the_message() {
        let grid = example();
        assert_eq!(grid.corner_m(), (9.5, 21.0));
        assert_eq!(grid.size_m(), (1.5, 1.0));
        assert_eq!(grid.labels, [1, 2, 200, 4, 0, 6]);
        let wide = Rect { x: 0, y: 0, width: 4096, height: 1025 };
        assert_eq!(Grid::new(wide, 1.0, (0.0, 0.0), |_| 0), None);
    }

    #[test]
    fn a_matrix_begins_in_the_north_east_and_runs_along_x() {
        let map = layers(&example(), Header::default());
        assert_eq!((map.layers.as_slice(), map.data.len()), (["label".to_owned(), "depth".to_owned()].as_slice(), 2));
        let labels: Vec<Option<f32>> = map.data[0].data.iter().map(|&v| (!v.is_nan()).then_some(v)).collect();
        assert_eq!(labels, [Some(6.0), None, Some(4.0), Some(200.0), Some(2.0), Some(1.0)]);
        let sizes: Vec<(&str, u32, u32)> =
            map.data[0].layout.dim.iter().map(|d| (d.label.as_str(), d.size, d.stride)).collect();
        assert_eq!(sizes, [("column_index", 2, 6), ("row_index", 3, 3)]);
        assert!(map.data[1].data[..3].iter().all(|v| v.is_nan()));
        assert_eq!(map.data[1].data[3..], [9.0, 8.0, 7.0]);
        let centre = map.info.pose.position;
        assert_eq!((centre.x, centre.y, map.info.length_x, map.info.length_y), (10.25, 21.5, 1.5, 1.0));
    }

    #[test]
    fn labels_keep_their_octets_and_unexplored_cells_are_unknown() {
        let map = occupancy(&example(), Header { frame_id: "map".to_owned(), ..Header::default() });
        assert_eq!(map.data, [1, 2, -56, 4, -1, 6]);
        assert_eq!((map.info.width, map.info.height, map.info.resolution), (3, 2, 0.5));
        let Pose { position, orientation } = map.info.origin;
        assert_eq!((position.x, position.y, orientation.w), (9.5, 21.0, 1.0));
    }
}
