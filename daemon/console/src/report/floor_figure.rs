//! The sea floor in a report, by the images of it that arrived.

use super::chart::WIDTH;
use super::dive::{Dive, DiveVehicle};
use super::map_figure::{Frame, grid, scale};
use super::words;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use scenecast_surface::state::VehicleState;
use std::fmt::Write;

/// Bytes of images in a report; of more, those of the west are shown.
const MAX_BYTES: usize = 1_500_000;

impl Dive {
    /// The images of the sea floor at their places, on the cells of the map.
    pub(super) fn floor_figure(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let Some(bounds) = vehicle.map.labels.bounds().filter(|_| !vehicle.floor.is_empty()) else { return };
        let shift = state.map.shift_m();
        let frame = Frame::around(bounds, vehicle.map.cell_m, shift, std::iter::empty());
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"images of the sea floor\" xmlns=\"http://www.w3.org/2000/svg\">\n",
            frame.height_px() + 40.0
        );
        let cells = format!("floor-{}", state.id);
        let _ = write!(svg, "<clipPath id=\"{cells}\"><path d=\"");
        let edge = vehicle.map.cell_m;
        for (cell, _) in vehicle.map.labels.iter() {
            let (west, north) = (f64::from(cell.x) * edge + shift.0, f64::from(cell.y + 1) * edge + shift.1);
            let (x, y) = frame.place(west, north);
            let side = edge * frame.px_m();
            let _ = write!(svg, "M{x:.1} {y:.1}h{side:.2}v{side:.2}h-{side:.2}z");
        }
        let _ = writeln!(svg, "\"/></clipPath>\n<g clip-path=\"url(#{cells})\">");
        let (mut bytes, mut shown) = (0, 0);
        for view in &vehicle.floor {
            bytes += view.data.len();
            if bytes > MAX_BYTES {
                break;
            }
            shown += 1;
            let half = view.width_m / 2.0;
            let (x, y) = frame.place(view.middle.x - half + shift.0, view.middle.y + half + shift.1);
            let side = view.width_m * frame.px_m();
            let image = BASE64_STANDARD.encode(&view.data);
            let _ = writeln!(
                svg,
                "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{side:.2}\" height=\"{side:.2}\" href=\"data:image/webp;base64,{image}\"/>"
            );
        }
        svg += "</g>\n";
        grid(&mut svg, &frame);
        scale(&mut svg, &frame);
        svg += "</svg>";
        let all = vehicle.floor.len();
        let shown = if shown == all { String::new() } else { format!(" ({shown} of them are shown)") };
        let _ = writeln!(
            page,
            "<figure class=\"map\">{svg}<figcaption>The sea floor itself, by the {} of it that arrived{shown}: put together on board from camera \
             frames, as the vehicle placed them then. White: no image, or no cell of the map. A square of which only a part was seen has the mean \
             colour of that part elsewhere.</figcaption></figure>",
            words::counted(all, "image", "images")
        );
    }
}
