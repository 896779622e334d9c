//! The figures of a report as SVG: the map with its track, and lines over time. They are readable in print.

use super::Escaped;
use super::dive::{DiveVehicle, TrackPoint};
use crate::state::VehicleState;
use scenecast_protocol::map::Rect;
use std::fmt::Write;

/// Width of a figure, pixels.
const WIDTH: f64 = 760.0;

/// The map of the operator, north up, with the reported track, a grid of metres, a scale bar and an arrow to the north; `None` without
/// cells.
pub(super) fn map(state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let bounds = vehicle.labels.bounds()?;
    let shift = state.map.shift_m();
    let frame = Frame::around(bounds, vehicle.cell_m, shift);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"map of the sea floor\" xmlns=\"http://www.w3.org/2000/svg\">\n",
        frame.height_px() + 40.0
    );
    cells(&mut svg, &frame, bounds, state, vehicle);
    grid(&mut svg, &frame);
    track(&mut svg, &frame, &vehicle.track);
    scale(&mut svg, &frame);
    svg += "</svg>";
    Some(svg)
}

/// The part of the world that a figure shows, metres, and its scale.
struct Frame {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
    px_m: f64,
}

impl Frame {
    fn around(Rect { x, y, width, height }: Rect, cell_m: f64, (east_m, north_m): (f64, f64)) -> Self {
        let west = f64::from(x) * cell_m + east_m;
        let south = f64::from(y) * cell_m + north_m;
        let (east, north) = (west + f64::from(width) * cell_m, south + f64::from(height) * cell_m);
        // A narrow map gets room at its sides.
        let margin = ((north - south) * 0.6 - (east - west)).max(0.0) / 2.0 + 0.02 * (east - west);
        let (west, east) = (west - margin, east + margin);
        Self { west, south, east, north, px_m: WIDTH / (east - west) }
    }

    fn height_px(&self) -> f64 {
        (self.north - self.south) * self.px_m
    }

    fn place(&self, east_m: f64, north_m: f64) -> (f64, f64) {
        ((east_m - self.west) * self.px_m, (self.north - north_m) * self.px_m)
    }

    /// A round length of about a fifth of the width, metres.
    fn step_m(&self) -> f64 {
        round_length((self.east - self.west) / 5.0)
    }
}

/// The next lower of 1, 2 and 5 times a power of ten.
fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|n| n * power).find(|n| *n <= length * 1.000_001).unwrap_or(power)
}

/// Cells of one label side by side in a row are one rectangle.
fn cells(svg: &mut String, frame: &Frame, bounds: Rect, state: &VehicleState, vehicle: &DiveVehicle) {
    let shift = state.map.shift_m();
    let edge = vehicle.cell_m;
    let mut runs: std::collections::BTreeMap<u8, String> = std::collections::BTreeMap::new();
    let rows = vehicle.labels.copy_area(
        i64::from(bounds.x),
        i64::from(bounds.y),
        bounds.width as usize,
        bounds.height as usize,
    );
    for (row, labels) in rows.chunks(bounds.width.max(1) as usize).enumerate() {
        let north = (f64::from(bounds.y) + row as f64 + 1.0) * edge + shift.1;
        let mut column = 0;
        for run in labels.chunk_by(|a, b| a == b) {
            if let Some(&label) = run.first().filter(|label| **label != 0) {
                let west = (f64::from(bounds.x) + column as f64) * edge + shift.0;
                let (x, y) = frame.place(west, north);
                let path = runs.entry(state.label_book.shown_as(label)).or_default();
                let (width, height) = (run.len() as f64 * edge * frame.px_m, edge * frame.px_m);
                // Writing to a string cannot fail.
                let _ = write!(path, "M{x:.2} {y:.2}h{width:.2}v{height:.2}h-{width:.2}z");
            }
            column += run.len();
        }
    }
    for (label, path) in runs {
        let _ = writeln!(
            svg,
            "<path fill=\"{}\" shape-rendering=\"crispEdges\" d=\"{path}\"/>",
            state.label_book.colour_text(label)
        );
    }
}

fn grid(svg: &mut String, frame: &Frame) {
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
            "<path class=\"grid\" d=\"M{x:.1} 0V{height:.1}\"/><text x=\"{x:.1}\" y=\"{:.1}\">{east} m E</text>",
            height + 14.0
        );
    }
    for north in lines(frame.south, frame.north) {
        let (_, y) = frame.place(frame.west, north);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M0 {y:.1}H{WIDTH}\"/><text x=\"2\" y=\"{:.1}\">{north} m N</text>",
            y - 3.0
        );
    }
}

fn track(svg: &mut String, frame: &Frame, track: &[TrackPoint]) {
    let places = track.iter().map(|point| frame.place(point.east_m, point.north_m));
    let points: Vec<String> = places.map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    if points.len() > 1 {
        let _ = writeln!(svg, "<polyline class=\"track\" points=\"{}\"/>", points.join(" "));
    }
}

fn scale(svg: &mut String, frame: &Frame) {
    let (length, y) = (frame.step_m(), frame.height_px() + 28.0);
    let (end, right) = (10.0 + length * frame.px_m, WIDTH - 14.0);
    let _ = writeln!(
        svg,
        "<path class=\"scale\" d=\"M10 {y:.1}H{end:.1}M10 {a:.1}v8M{end:.1} {a:.1}v8\"/><text x=\"{:.1}\" y=\"{:.1}\">{length} m</text>\
         <path class=\"scale\" d=\"M{right} {y:.1}v-20l-5 8m5-8l5 8\"/><text x=\"{:.1}\" y=\"{:.1}\">N</text>",
        end + 6.0,
        y + 4.0,
        right - 18.0,
        y - 8.0,
        a = y - 4.0
    );
}

/// A quantity over time.
pub(super) struct Series<'a> {
    pub(super) name: &'a str,
    pub(super) unit: &'a str,
    /// Seconds since the beginning, and the value; NaN where it is unknown.
    pub(super) points: Vec<(f64, f64)>,
}

/// A quantity over time as a line; `None` with fewer than two known values.
pub(super) fn line(series: &Series<'_>, length_s: f64) -> Option<String> {
    const HEIGHT: f64 = 110.0;
    let known: Vec<(f64, f64)> = series.points.iter().copied().filter(|(_, value)| value.is_finite()).collect();
    if known.len() < 2 || length_s <= 0.0 {
        return None;
    }
    let most = known.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let top = if most > 0.0 { most } else { 1.0 };
    let place = |&(at_s, value): &(f64, f64)| {
        format!("{:.1},{:.1}", 60.0 + at_s / length_s * (WIDTH - 70.0), HEIGHT - 20.0 - value / top * (HEIGHT - 34.0))
    };
    let points: Vec<String> = known.iter().map(place).collect();
    Some(format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{name} over time\" xmlns=\"http://www.w3.org/2000/svg\">\
         <path class=\"grid\" d=\"M60 {bottom}H{WIDTH}M60 14H{WIDTH}\"/><polyline class=\"line\" points=\"{}\"/>\
         <text x=\"2\" y=\"{bottom}\">0</text><text x=\"2\" y=\"18\">{top:.digits$}</text><text x=\"60\" y=\"11\">{name}, {unit}</text>\
         <text x=\"60\" y=\"{HEIGHT}\">0 min</text><text x=\"{end}\" y=\"{HEIGHT}\">{minutes:.0} min</text></svg>",
        points.join(" "),
        name = Escaped(series.name),
        unit = Escaped(series.unit),
        bottom = HEIGHT - 20.0,
        digits = if top >= 10.0 { 0 } else { 3 },
        end = WIDTH - 50.0,
        minutes = length_s / 60.0
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_have_round_lengths() {
        assert_eq!([1.0, 3.7, 19.9, 50.0, 0.7].map(round_length), [1.0, 2.0, 10.0, 50.0, 0.5]);
    }
}
