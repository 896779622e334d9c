//! All layers as `grid_map_msgs/msg/GridMap`.

use crate::grid::Grid;
use scenecast_messages::geometry_msgs::{Point, Pose, Quaternion};
use scenecast_messages::grid_map_msgs::{GridMap, GridMapInfo};
use scenecast_messages::std_msgs::{Float32MultiArray, Header, MultiArrayDimension, MultiArrayLayout};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::example;

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
}
