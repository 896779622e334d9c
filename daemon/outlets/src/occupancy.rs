//! The labels as `nav_msgs/msg/OccupancyGrid`.

use crate::grid::Grid;
use scenecast_messages::geometry_msgs::{Point, Pose, Quaternion};
use scenecast_messages::nav_msgs::{MapMetaData, OccupancyGrid};
use scenecast_messages::std_msgs::Header;

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
    use crate::grid::example;

    #[test]
    fn labels_keep_their_octets_and_unexplored_cells_are_unknown() {
        let map = occupancy(&example(), Header { frame_id: "map".to_owned(), ..Header::default() });
        assert_eq!(map.data, [1, 2, -56, 4, -1, 6]);
        assert_eq!((map.info.width, map.info.height, map.info.resolution), (3, 2, 0.5));
        let Pose { position, orientation } = map.info.origin;
        assert_eq!((position.x, position.y, orientation.w), (9.5, 21.0, 1.0));
    }
}
