//! The true area of each label: where the vehicle's model finds it, once it has been shown the whole sea floor.

use scene_model::project::Pose;
use scenecast_core::{Area, UserError};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_rehearsal::Mission;
use scenecast_vehicle::{Frame, MapProducer, Mapper};
use scenecast_worlds::View;

/// The distance between the views as a share of their edges.
const SPACING: f64 = 0.9;
/// Mission time between two views, which is the time for refining, seconds.
const PAUSE_S: f64 = 2.0;

/// The label of each cell of `area`, in the world frame, by a copy of the vehicle's model, which sees the whole area from where the mission is
/// now. The mission itself stays as it is.
pub(super) fn labels_of(mission: &Mission, area: &Area) -> Result<LabelGrid, UserError> {
    let copied = Mapper::restore(mission.config(), None, &mission.mapper().save(0));
    let mut mapper = copied.map_err(UserError::failed)?.mapper;
    let mut world = mission.world().clone();
    let (camera, survey) = (&mission.config().camera, &mission.config().survey);
    let navigator = mission.vehicle().navigator();
    let ((x, y), (east, north)) = (navigator.position().xy(), navigator.world().xy());
    let mut t_s = mission.now().as_secs_f64();
    for (x_m, y_m) in places(area, camera.width_px, camera.height_px, camera.metres_per_pixel) {
        t_s += PAUSE_S;
        let (width_px, height_px, moment) = (camera.width_px, camera.height_px, (t_s * 1000.0) as u64);
        let altitude_m = survey.altitude_m;
        let image = world.view(&View { x_m, y_m, heading_rad: 0.0, altitude_m, width_px, height_px, moment });
        let depth_m = world.depth_m(survey.depth_m, x_m, y_m) - altitude_m;
        let pose = Pose { x: x_m - east + x, y: y_m - north + y, z: -depth_m, yaw_rad: 0.0 };
        mapper.handle_frame(&Frame::flat(&image, pose, 1.0), t_s);
    }
    let shift = |metres: f64| (metres / mission.cell_m()).round() as i32;
    let (right, up) = (shift(east - x), shift(north - y));
    let cells = mapper.current().labels.map_or(Vec::new(), |labels| labels.cells);
    Ok(cells.into_iter().map(|(cell, label)| (Cell::new(cell.x + right, cell.y + up), label)).collect())
}

/// The middles of the views that cover an area, lane by lane.
fn places(area: &Area, width_px: u32, height_px: u32, metres_per_pixel: f64) -> Vec<(f64, f64)> {
    let middles = |low: f64, high: f64, pixels: u32| -> Vec<f64> {
        let step = SPACING * f64::from(pixels) * metres_per_pixel;
        let count = ((high - low) / step).ceil().max(1.0) as u32;
        (0..count).map(|i| low + (f64::from(i) + 0.5) * (high - low) / f64::from(count)).collect()
    };
    let columns = middles(area.west, area.east, width_px);
    let rows = middles(area.south, area.north, height_px);
    rows.iter().flat_map(|&y| columns.iter().map(move |&x| (x, y))).collect()
}
