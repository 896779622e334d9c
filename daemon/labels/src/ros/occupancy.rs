//! `nav_msgs/msg/OccupancyGrid`: a grid of classes, or a band.

use super::{band_name, check_frame, check_turn, edge, metres, time};
use crate::{Band, Content, Ground, Item, Raster, Refusal};
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_protocol::map::{Decimal, MAX_CLASS};

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
    use scenecast_messages::geometry_msgs::Quaternion;

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
