//! What part of the sea floor the map covers, and how deep it is there.

use super::dive::{Dive, DiveVehicle};
use super::words::{self, lat_lon};
use scenecast_core::{Area, fence_of, place_of};
use scenecast_protocol::map::{Cell, Quantity, UNEXPLORED};
use scenecast_surface::state::VehicleState;
use std::ops::RangeInclusive;

/// The limits of the operator's map in words, in metres and, with an origin, in degrees; `None` while it has no cells.
pub(super) fn of_map(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let bounds = vehicle.map.labels.bounds()?;
    let (shift, cell_m) = (state.map.shift_m(), vehicle.map.cell_m);
    let (west, south) = (f64::from(bounds.x) * cell_m + shift.0, f64::from(bounds.y) * cell_m + shift.1);
    let (east, north) = (west + f64::from(bounds.width) * cell_m, south + f64::from(bounds.height) * cell_m);
    let on_earth = dive.state.mission.origin.map_or_else(String::new, |origin| {
        let [(south, west), (north, east)] = [(west, south), (east, north)].map(|(x, y)| lat_lon(origin, x, y));
        format!(", or from latitude {south:.6} to {north:.6} and from longitude {west:.6} to {east:.6}")
    });
    Some(format!(
        "The map reaches from {} to {} and from {} to {}{on_earth}.{}",
        words::east(west),
        words::east(east),
        words::north(south),
        words::north(north),
        unseen(dive, state, vehicle, shift)
    ))
}

/// How deep the sea floor is, where the map has a layer of it.
pub(super) fn sea_floor(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let cells = dive.map_cells(state, vehicle);
    let layer = cells.layers.iter().find(|layer| layer.descriptor.quantity == Quantity::Depth)?;
    let depths: Vec<f64> = vehicle.map.labels.iter().filter_map(|(cell, _)| layer.value(cell)).collect();
    let median = words::median(&depths)?;
    let (least, most) = depths.iter().fold((median, median), |(least, most), m| (least.min(*m), most.max(*m)));
    Some(match format!("{least:.1}") == format!("{most:.1}") {
        true => format!("The water is {least:.1} m deep there."),
        false => format!(
            "The water is {median:.1} m deep there in the median of the cells, and {least:.1} to {most:.1} m in all of them."
        ),
    })
}

/// The area of the survey that was configured.
pub(super) fn of_survey(dive: &Dive, vehicle: &DiveVehicle) -> Option<Area> {
    let area = dive.ran_with(vehicle).settings.get("survey.area_m")?;
    let [west, south, east, north] = serde_json::from_value(area.clone()).ok()?;
    Some(Area { west, south, east, north })
}

/// How much of the configured area, or else of what the fence leaves, has cells.
fn unseen(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle, shift: (f64, f64)) -> String {
    let Some(area) = of_survey(dive, vehicle) else {
        return match seen_of_fence(state, vehicle, shift) {
            Some(share) => format!(" Of the area within the fence, {:.1} % is on the map.", share * 100.0),
            None if dive.knows_settings(vehicle) => {
                " No area of the survey is configured, so how much of it was not seen is not known.".to_owned()
            }
            None => " The area of the survey is among the vehicle's settings, which this record does not have, so how much of it was not seen \
                     is not known."
                .to_owned(),
        };
    };
    let middles = vehicle.map.labels.iter().map(|(cell, _)| vehicle.middle_of(cell, shift));
    let share = area.covered(middles, vehicle.map.cell_m);
    let fence = seen_of_fence(state, vehicle, shift);
    let fence = fence.map_or_else(String::new, |share| {
        format!(" Of the area within the fence, {:.1} % is on the map.", share * 100.0)
    });
    let Area { west, south, east, north } = area;
    let all_m2 = (east - west) * (north - south);
    let (all, missing) = (words::area(all_m2), words::area(all_m2 * (1.0 - share)));
    let seen = match share {
        share if share >= 1.0 - f64::EPSILON => format!("all {all} are on the map"),
        share if share >= 0.9995 => format!("all but {missing} of {all} are on the map"),
        share => format!("{:.1} % is on the map, and {missing} of {all} are not", share * 100.0),
    };
    format!(" Of the area of the survey, {west} to {east} m east and {south} to {north} m north, {seen}.{fence}")
}

/// The share of what the fence in force leaves that has cells; `None` without a fence.
fn seen_of_fence(state: &VehicleState, vehicle: &DiveVehicle, shift: (f64, f64)) -> Option<f64> {
    const MAX_CELLS: i64 = 1 << 22;
    let order = &state.orders.fence_in_force.as_ref()?.order;
    let corners = order.fence.as_ref()?;
    let fence = fence_of(Some(corners), &order.keep_outs, None).ok()?;
    let range = |axis: usize, shift_m: f64| {
        let cells = corners.iter().map(|corner| ((corner[axis] - shift_m) / vehicle.map.cell_m).floor() as i32);
        Some(cells.clone().min()?..=cells.max()?)
    };
    let (columns, rows) = (range(0, shift.0)?, range(1, shift.1)?);
    let count = |range: &RangeInclusive<i32>| i64::from(*range.end()) - i64::from(*range.start()) + 1;
    if count(&columns).checked_mul(count(&rows))? > MAX_CELLS {
        return None;
    }
    let place = |cell: Cell| place_of("cell", vehicle.middle_of(cell, shift).into());
    let all = rows.flat_map(|y| columns.clone().map(move |x| Cell::new(x, y)));
    let inside = all.filter(|&cell| place(cell).is_ok_and(|place| fence.allows(place)));
    let (seen, all) = inside.fold((0u64, 0u64), |(seen, all), cell| {
        (seen + u64::from(vehicle.map.labels.get(cell) != UNEXPLORED), all + 1)
    });
    (all > 0).then(|| seen as f64 / all as f64)
}
