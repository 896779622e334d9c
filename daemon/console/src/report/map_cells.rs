//! The cells of a map in a figure, by class.

use super::dive::DiveVehicle;
use super::map_figure::{Frame, Texts};
use scenecast_protocol::map::Rect;
use scenecast_surface::state::VehicleState;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;

/// Most cells of a map whose classes are numbered.
const MAX_NUMBERED: u64 = 1 << 22;

/// The least room for a number, and how far numbers of one class are apart, pixels.
const NUMBER_ROOM: f64 = 7.0;
const NUMBERS_APART: f64 = 110.0;

/// The classes of the cells of a map in a figure.
pub(super) struct ClassCells<'a> {
    frame: &'a Frame,
    state: &'a VehicleState,
    bounds: Rect,
    edge_m: f64,
    /// Row by row from the south; 0 is none.
    classes: Vec<u8>,
}

impl<'a> ClassCells<'a> {
    pub(super) fn new(frame: &'a Frame, bounds: Rect, state: &'a VehicleState, vehicle: &DiveVehicle) -> Self {
        let Rect { x, y, width, height } = bounds;
        let labels = vehicle.map.labels.copy_area(i64::from(x), i64::from(y), width as usize, height as usize);
        let classes = labels.into_iter().map(|label| state.label_book.shown_as(label)).collect();
        Self { frame, state, bounds, edge_m: vehicle.map.cell_m, classes }
    }

    fn width(&self) -> usize {
        self.bounds.width as usize
    }

    fn at(&self, column: usize, row: usize) -> u8 {
        self.classes.get(row * self.width() + column).copied().unwrap_or_default()
    }

    /// Where so many columns and rows from the south-west corner lie in the figure, pixels.
    fn place(&self, columns: f64, rows: f64) -> (f64, f64) {
        let (east_m, north_m) = self.state.map.shift_m();
        let metres = |first: i32, n: f64, shift_m: f64| (f64::from(first) + n) * self.edge_m + shift_m;
        self.frame.place(metres(self.bounds.x, columns, east_m), metres(self.bounds.y, rows, north_m))
    }

    /// Draws the cells; those of one class side by side in a row are one rectangle.
    pub(super) fn draw(&self, svg: &mut String) {
        let mut runs: BTreeMap<u8, String> = BTreeMap::new();
        let cell_px = self.edge_m * self.frame.px_m();
        for (row, classes) in self.classes.chunks(self.width().max(1)).enumerate() {
            let mut column = 0;
            for run in classes.chunk_by(|a, b| a == b) {
                if let Some(&class) = run.first().filter(|class| **class != 0) {
                    let (x, y) = self.place(column as f64, row as f64 + 1.0);
                    // Rows that only touch have gaps where pixels are rounded.
                    let (width, height) = (run.len() as f64 * cell_px, cell_px + 0.5);
                    let path = runs.entry(class).or_default();
                    // Writing to a string cannot fail.
                    let _ = write!(path, "M{x:.2} {y:.2}h{width:.2}v{height:.2}h-{width:.2}z");
                }
                column += run.len();
            }
        }
        for (label, path) in runs {
            let colour = self.state.label_book.colour_text(label);
            let _ = writeln!(svg, "<path fill=\"{colour}\" shape-rendering=\"crispEdges\" d=\"{path}\"/>");
        }
        self.draw_borders(svg);
    }

    /// Lines between cells of different classes, so that they can be told apart in grey.
    fn draw_borders(&self, svg: &mut String) {
        let (width, height) = (self.width(), self.bounds.height as usize);
        let is_border = |a: u8, b: u8| a != b && a != 0 && b != 0;
        let mut path = String::new();
        let mut line = |from: (usize, usize), to: (usize, usize)| {
            let [(x, y), (to_x, to_y)] = [from, to].map(|(column, row)| self.place(column as f64, row as f64));
            // Writing to a string cannot fail.
            let _ = write!(path, "M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}");
        };
        for row in 1..height {
            let lines = runs_of(width, |column| is_border(self.at(column, row), self.at(column, row - 1)));
            lines.into_iter().for_each(|columns| line((columns.start, row), (columns.end, row)));
        }
        for column in 1..width {
            let lines = runs_of(height, |row| is_border(self.at(column, row), self.at(column - 1, row)));
            lines.into_iter().for_each(|rows| line((column, rows.start), (column, rows.end)));
        }
        let _ = writeln!(svg, "<path class=\"border\" d=\"{path}\"/>");
    }

    /// Writes the number of each class where it is wide, so that classes can be told apart in grey.
    pub(super) fn number(&self, svg: &mut String, texts: &mut Texts) {
        if self.bounds.area() > MAX_NUMBERED {
            return;
        }
        let cell_px = self.edge_m * self.frame.px_m();
        let (room, apart) = ((NUMBER_ROOM / cell_px).ceil() as u32, NUMBERS_APART / cell_px);
        for (class, (column, row)) in wide_places(&self.classes, self.width(), room, apart) {
            let (x, y) = self.place(column as f64 + 0.5, row as f64 + 0.5);
            let (number, base) = (class.to_string(), y + 4.0);
            let left = x - number.len() as f64 * Texts::CHARACTER / 2.0;
            if texts.take(&number, (left, base)) {
                let _ = writeln!(
                    svg,
                    "<text class=\"number\" x=\"{x:.1}\" y=\"{base:.1}\" text-anchor=\"middle\">{number}</text>"
                );
            }
        }
    }
}

/// The longest ranges below `end` of which all are so.
fn runs_of(end: usize, is_so: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for n in (0..end).filter(|n| is_so(*n)) {
        match runs.last_mut().filter(|run| run.end == n) {
            Some(run) => run.end = n + 1,
            None => runs.push(n..n + 1),
        }
    }
    runs
}

/// Columns and rows of cells of each class that are far, along both axes, from the ends of their runs: the farthest of all, and those with
/// at least so much room, `apart` cells from each other; 0 is no class.
fn wide_places(classes: &[u8], width: usize, least_room: u32, apart: f64) -> Vec<(u8, (usize, usize))> {
    let height = classes.len() / width.max(1);
    let mut room = vec![u32::MAX; classes.len()];
    // The lengths so far of runs in each of the four directions.
    let mut measure = |line: &mut dyn Iterator<Item = usize>| {
        let (mut before, mut length) = (0, 0);
        for cell in line {
            length = if classes[cell] == before { length + 1 } else { 1 };
            before = classes[cell];
            room[cell] = room[cell].min(length);
        }
    };
    for row in 0..height {
        measure(&mut (0..width).map(|column| row * width + column));
        measure(&mut (0..width).rev().map(|column| row * width + column));
    }
    for column in 0..width {
        measure(&mut (0..height).map(|row| row * width + column));
        measure(&mut (0..height).rev().map(|row| row * width + column));
    }
    let mut found: BTreeMap<u8, Vec<(usize, usize)>> = BTreeMap::new();
    let mut cells: Vec<usize> = (0..classes.len()).filter(|cell| classes[*cell] != 0).collect();
    cells.sort_by_key(|cell| (std::cmp::Reverse(room[*cell]), *cell));
    for cell in cells {
        let (column, row) = (cell % width, cell / width);
        let places = found.entry(classes[cell]).or_default();
        let is_far = |&(x, y): &(usize, usize)| (x.abs_diff(column) as f64).hypot(y.abs_diff(row) as f64) >= apart;
        if places.is_empty() || room[cell] >= least_room && places.iter().all(is_far) {
            places.push((column, row));
        }
    }
    found.into_iter().flat_map(|(class, places)| places.into_iter().map(move |place| (class, place))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_is_numbered_where_it_is_wide() {
        let map = "1111111 1333111 1333220 1333222 1111222";
        let classes: Vec<u8> = map.bytes().filter(u8::is_ascii_digit).map(|digit| digit - b'0').collect();
        assert_eq!(wide_places(&classes, 7, 9, 1.0), [(1, (0, 0)), (2, (5, 3)), (3, (2, 2))]);
        let far = wide_places(&classes, 7, 1, 5.0);
        assert_eq!(far.iter().filter(|(class, _)| *class == 1).count(), 2, "{far:?}");
        assert_eq!(wide_places(&[], 0, 1, 1.0), []);
    }

    #[test]
    fn neighbours_are_joined_to_ranges() {
        assert_eq!(runs_of(8, |n| [1, 2, 3, 6].contains(&n)), [1..4, 6..7]);
        assert!(runs_of(0, |_| true).is_empty());
    }
}
