//! Explored cells as a coloured `sensor_msgs/msg/PointCloud2`.

use crate::grid::Grid;
use scenecast_messages::sensor_msgs::{PointCloud2, PointField};
use scenecast_messages::std_msgs::Header;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::example;

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
}
