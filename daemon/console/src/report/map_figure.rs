//! The map of a report as SVG, with its track. It is readable in print.

use super::Escaped;
use super::chart::{WIDTH, round_length};
use super::dive::DiveVehicle;
use super::map_cells::ClassCells;
use scenecast_core::Area;
use scenecast_protocol::map::Rect;
use scenecast_surface::state::VehicleState;
use std::fmt::Write;

/// Characters of a marker's text on the map.
const MAX_MARKER: usize = 30;

/// The map of the operator, north up, with the reported track, a grid of metres, a scale bar and an arrow to the north; `None` without
/// cells.
pub(super) fn map(state: &VehicleState, vehicle: &DiveVehicle, area: Option<Area>) -> Option<String> {
    let bounds = vehicle.map.labels.bounds()?;
    let shift = state.map.shift_m();
    let path = vehicle.path();
    let places = path.iter().map(|point| (point.east_m, point.north_m));
    let fence_in_force = state.orders.fence_in_force.iter().flat_map(|applied| applied.order.fence.iter().flatten());
    let places = places.chain(state.markers.iter().map(|m| (m.x_m, m.y_m)));
    let places = places.chain(fence_in_force.map(|&[east_m, north_m]| (east_m, north_m)));
    let corners =
        area.map(|Area { west, south, east, north }| [(west, south), (east, south), (east, north), (west, north)]);
    let places = places.chain(corners.into_iter().flatten());
    let frame = Frame::around(bounds, vehicle.map.cell_m, shift, places);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"map of the sea floor\" xmlns=\"http://www.w3.org/2000/svg\">\n",
        frame.height_px() + 40.0
    );
    let class_cells = ClassCells::new(&frame, bounds, state, vehicle);
    class_cells.draw(&mut svg);
    grid(&mut svg, &frame);
    if let Some(corners) = corners {
        let _ = writeln!(svg, "<polygon class=\"area\" points=\"{}\"/>", points(&frame, corners.into_iter()));
    }
    let mut texts = Texts::default();
    fence(&mut svg, &frame, state, &mut texts);
    track(&mut svg, &frame, vehicle, &mut texts);
    for marker in &state.markers {
        let mut text: String = marker.text.chars().take(MAX_MARKER).collect();
        text += if marker.text.chars().count() > MAX_MARKER { "\u{2026}" } else { "" };
        point(&mut svg, &frame, (marker.x_m, marker.y_m), (&text, -5.0), &mut texts);
    }
    class_cells.number(&mut svg, &mut texts);
    scale(&mut svg, &frame);
    svg += "</svg>";
    Some(svg)
}

/// The part of the world that a figure shows, metres, and its scale.
pub(super) struct Frame {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
    px_m: f64,
}

impl Frame {
    /// The map, and places within its own size around it: one that is far away must not make the map small.
    pub(super) fn around(
        Rect { x, y, width, height }: Rect,
        cell_m: f64,
        (east_m, north_m): (f64, f64),
        places: impl Iterator<Item = (f64, f64)>,
    ) -> Self {
        let west = f64::from(x) * cell_m + east_m;
        let south = f64::from(y) * cell_m + north_m;
        let (east, north) = (west + f64::from(width) * cell_m, south + f64::from(height) * cell_m);
        let reach = (east - west).max(north - south);
        let is_near = |(x, y): &(f64, f64)| {
            (*x - x.clamp(west, east)).abs() <= reach && (*y - y.clamp(south, north)).abs() <= reach
        };
        let whole = places.filter(is_near).fold((west, south, east, north), |(west, south, east, north), (x, y)| {
            (west.min(x), south.min(y), east.max(x), north.max(y))
        });
        let (west, south, east, north) = whole;
        // Marks at an edge are whole.
        let edge = 0.012 * (east - west).max(north - south);
        let (south, north) = (south - edge, north + edge);
        // A narrow map gets room at its sides.
        let margin = ((north - south) * 0.6 - (east - west)).max(0.0) / 2.0 + 0.02 * (east - west);
        let (west, east) = (west - margin, east + margin);
        Self { west, south, east, north, px_m: WIDTH / (east - west) }
    }

    pub(super) fn height_px(&self) -> f64 {
        (self.north - self.south) * self.px_m
    }

    pub(super) fn place(&self, east_m: f64, north_m: f64) -> (f64, f64) {
        ((east_m - self.west) * self.px_m, (self.north - north_m) * self.px_m)
    }

    /// Pixels of a metre.
    pub(super) fn px_m(&self) -> f64 {
        self.px_m
    }

    /// A round length of about a fifth of the width, metres.
    fn step_m(&self) -> f64 {
        round_length((self.east - self.west) / 5.0)
    }
}

pub(super) fn grid(svg: &mut String, frame: &Frame) {
    let step = frame.step_m();
    let height = frame.height_px();
    let lines = |from: f64, to: f64| {
        let first = (from / step).ceil() as i64;
        (first..).map(move |n| n as f64 * step).take_while(move |at| *at <= to)
    };
    for east in lines(frame.west, frame.east) {
        let (x, _) = frame.place(east, frame.north);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{x:.1} 0V{height:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{east} m E</text>",
            x.clamp(26.0, WIDTH - 26.0),
            height + 14.0
        );
    }
    for north in lines(frame.south, frame.north) {
        let (_, y) = frame.place(frame.west, north);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M0 {y:.1}H{WIDTH}\"/><text x=\"2\" y=\"{:.1}\">{north} m N</text>",
            (y - 3.0).max(11.0)
        );
    }
}

/// Places in metres east and north as the points of a line.
fn points(frame: &Frame, places: impl Iterator<Item = (f64, f64)>) -> String {
    let points = places.map(|(east_m, north_m)| frame.place(east_m, north_m));
    points.map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Fence and keep-outs that were in force at the end, and where the vehicle returns to.
fn fence(svg: &mut String, frame: &Frame, state: &VehicleState, texts: &mut Texts) {
    let Some(order) = state.orders.fence_in_force.as_ref().map(|applied| &applied.order) else { return };
    let mut outline = |corners: &[[f64; 2]], class: &str| {
        let points = points(frame, corners.iter().map(|&[east_m, north_m]| (east_m, north_m)));
        let _ = writeln!(svg, "<polygon class=\"{class}\" points=\"{points}\"/>");
    };
    order.fence.iter().for_each(|fence| outline(fence, "fence"));
    order.keep_outs.iter().for_each(|keep_out| outline(keep_out, "out"));
    order
        .return_point
        .iter()
        .for_each(|&[east_m, north_m]| point(svg, frame, (east_m, north_m), ("return", 16.0), texts));
}

/// The path of the vehicle, its ends, where its program began again, and where its images lie.
fn track(svg: &mut String, frame: &Frame, vehicle: &DiveVehicle, texts: &mut Texts) {
    for leg in vehicle.legs().filter(|leg| leg.len() > 1) {
        let points = points(frame, leg.iter().map(|point| (point.east_m, point.north_m)));
        let _ = writeln!(svg, "<polyline class=\"track\" points=\"{points}\"/>");
    }
    for (_, image) in vehicle.exemplars.iter().filter(|(_, image)| image.width_m > 0.0) {
        let (x, y) = frame.place(image.middle.x, image.middle.y);
        let _ =
            writeln!(svg, "<rect class=\"point\" x=\"{:.1}\" y=\"{:.1}\" width=\"5\" height=\"5\"/>", x - 2.5, y - 2.5);
    }
    let path = vehicle.path();
    let began = path.iter().zip(path.iter().skip(1)).filter(|(a, b)| vehicle.began_between(a, b));
    let restarts = began.map(|(_, after)| (Some(after), "restart"));
    let ends = if vehicle.has_own_path() { ["start", "end"] } else { ["first report", "last report"] };
    for (place, name) in [(path.first(), ends[0]), (path.last(), ends[1])].into_iter().chain(restarts) {
        place.into_iter().for_each(|place| point(svg, frame, (place.east_m, place.north_m), (name, -5.0), texts));
    }
}

/// The rooms of the texts on a map, pixels: left, top, right, bottom.
#[derive(Default)]
pub(super) struct Texts(Vec<[f64; 4]>);

impl Texts {
    /// The width of a character at the most, the height of a line, and the room between texts.
    pub(super) const CHARACTER: f64 = 7.5;
    const APART: f64 = 5.0;
    const LINE: f64 = 13.0;

    /// Takes the room of a text from its left end and its base line on; false where another one is.
    pub(super) fn take(&mut self, text: &str, (left, base): (f64, f64)) -> bool {
        let room = [left, base - Self::LINE + 2.0, left + text.chars().count() as f64 * Self::CHARACTER, base + 2.0];
        let meets = |other: &[f64; 4]| {
            room[0] < other[2] + Self::APART
                && other[0] < room[2] + Self::APART
                && room[1] < other[3]
                && other[1] < room[3]
        };
        let is_free = !self.0.iter().any(meets);
        self.0.extend(is_free.then_some(room));
        is_free
    }
}

/// A place with its name, so many pixels below it.
fn point(
    svg: &mut String,
    frame: &Frame,
    (east_m, north_m): (f64, f64),
    (name, below): (&str, f64),
    texts: &mut Texts,
) {
    let (x, y) = frame.place(east_m, north_m);
    // A text near the right or the upper edge would be cut.
    let (side, anchor) = if x > WIDTH * 0.75 { (-6.0, "end") } else { (6.0, "start") };
    let width = if side < 0.0 { name.chars().count() as f64 * Texts::CHARACTER } else { 0.0 };
    // Two places of the vehicle may be the same: the name of the second stands lower.
    let is_free = texts.take(name, (x + side - width, (y + below).max(12.0)));
    let below = if is_free { below } else { below + Texts::LINE };
    let _ = writeln!(
        svg,
        "<circle class=\"point\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/><text class=\"number\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
        x + side,
        (y + below).max(12.0),
        Escaped(name)
    );
}

pub(super) fn scale(svg: &mut String, frame: &Frame) {
    let (length, y) = (frame.step_m(), frame.height_px() + 28.0);
    let (end, right) = (10.0 + length * frame.px_m, WIDTH - 14.0);
    let _ = writeln!(
        svg,
        "<path class=\"scale\" d=\"M10 {y:.1}H{end:.1}M10 {a:.1}v8M{end:.1} {a:.1}v8\"/><text x=\"{:.1}\" y=\"{:.1}\">{length} m</text>\
         <path class=\"scale\" d=\"M{right} {:.1}v-18l-5 7m5-7l5 7\"/><text x=\"{:.1}\" y=\"{:.1}\">N</text>",
        end + 6.0,
        y + 4.0,
        y + 10.0,
        right - 18.0,
        y + 4.0,
        a = y - 4.0
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_do_not_run_into_each_other() {
        let mut texts = Texts::default();
        assert!(texts.take("12", (100.0, 50.0)));
        assert!(!texts.take("16", (110.0, 50.0)), "it would read 1216");
        assert!(!texts.take("16", (116.0, 50.0)), "without room between them");
        assert!(texts.take("16", (110.0, 70.0)) && texts.take("16", (125.0, 50.0)));
    }
}
