//! The paper's scatter plot: mutual information of the map, with the mosaic's colours and with
//! the annotations, against its bytes.

mod axis;
mod raster;
mod svg;

use axis::Axis;
use raster::Raster;
use scenecast_core::UserError;
use scenecast_core::tuning_table::{Measurement, Row};
use svg::Svg;

pub(super) const WIDTH: u32 = 1240;
pub(super) const HEIGHT: u32 = 620;
/// Width of a character and height of a line of text, pixels.
pub(super) const CHARACTER: (f64, f64) = (9.0, 18.0);

const INK: Colour = [40, 48, 56];
const FAINT: Colour = [222, 227, 231];
const FRONT: Colour = [120, 128, 136];
const BEST: Colour = [200, 30, 40];
/// Colours of the values of alpha, in order (Okabe and Ito, distinguishable for colour-blind readers).
const SERIES: [Colour; 7] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [140, 140, 40]];

pub(super) type Colour = [u8; 3];

/// The part of a text that is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A drawing surface; positions are in pixels from the top left corner.
pub(super) trait Canvas {
    fn line(&mut self, from: (f64, f64), to: (f64, f64), width: f64, colour: Colour);
    fn disc(&mut self, centre: (f64, f64), radius: f64, colour: Colour);
    fn ring(&mut self, centre: (f64, f64), radius: f64, colour: Colour);
    /// Draws a line of text, vertically centred at the position.
    fn text(&mut self, at: (f64, f64), anchor: Anchor, colour: Colour, text: &str);
}

pub struct Plot<'a> {
    rows: &'a [Row],
    best: Option<&'a Row>,
    alphas: Vec<f64>,
}

struct Panel {
    left: f64,
    title: &'static str,
    information: fn(&Measurement) -> f64,
}

const PANELS: [Panel; 2] = [
    Panel {
        left: 80.0,
        title: "MI with the mosaic's colours, nats",
        information: |m| m.mosaic_mutual_information_nats,
    },
    Panel { left: 590.0, title: "MI with the annotations, nats", information: |m| m.mutual_information_nats },
];
const PANEL_WIDTH: f64 = 420.0;
const TOP: f64 = 60.0;
const BOTTOM: f64 = 540.0;
const LEGEND: f64 = 1040.0;

impl<'a> Plot<'a> {
    pub fn new(rows: &'a [Row], best: Option<&'a Row>) -> Self {
        let mut alphas: Vec<f64> = rows.iter().map(|row| row.setting.alpha).collect();
        alphas.sort_by(|a, b| b.total_cmp(a));
        alphas.dedup();
        Self { rows, best, alphas }
    }

    pub fn svg(&self) -> String {
        let mut svg = Svg::new(WIDTH, HEIGHT);
        self.draw(&mut svg);
        svg.finish()
    }

    pub fn png(&self) -> Result<Vec<u8>, UserError> {
        let mut raster = Raster::new(WIDTH, HEIGHT);
        self.draw(&mut raster);
        raster.finish().map_err(|e| UserError::Failed(e.to_string()))
    }

    fn draw(&self, canvas: &mut dyn Canvas) {
        for panel in &PANELS {
            self.panel(canvas, panel);
        }
        self.legend(canvas);
    }

    fn panel(&self, canvas: &mut dyn Canvas, panel: &Panel) {
        let bytes = |row: &Row| row.measurement.map_bytes as f64;
        let information = |row: &Row| (panel.information)(&row.measurement);
        let across = Axis::over(self.rows.iter().map(bytes), panel.left, panel.left + PANEL_WIDTH);
        let up = Axis::over(self.rows.iter().map(information), BOTTOM, TOP);
        for (x, tick) in across.ticks() {
            canvas.line((x, TOP), (x, BOTTOM), 1.0, FAINT);
            canvas.text((x, BOTTOM + 18.0), Anchor::Middle, INK, &tick);
        }
        for (y, tick) in up.ticks() {
            canvas.line((panel.left, y), (panel.left + PANEL_WIDTH, y), 1.0, FAINT);
            canvas.text((panel.left - 8.0, y), Anchor::End, INK, &tick);
        }
        canvas.line((panel.left, TOP), (panel.left, BOTTOM), 1.5, INK);
        canvas.line((panel.left, BOTTOM), (panel.left + PANEL_WIDTH, BOTTOM), 1.5, INK);
        canvas.text((panel.left - 60.0, TOP - 32.0), Anchor::Start, INK, panel.title);
        canvas.text((panel.left + PANEL_WIDTH / 2.0, BOTTOM + 48.0), Anchor::Middle, INK, "bytes of the map");
        let place = |row: &Row| (across.place(bytes(row)), up.place(information(row)));
        let front = front(self.rows, information);
        for step in front.windows(2) {
            let (from, to) = (place(step[0]), place(step[1]));
            canvas.line(from, (to.0, from.1), 1.5, FRONT);
            canvas.line((to.0, from.1), to, 1.5, FRONT);
        }
        for row in self.rows {
            canvas.disc(place(row), 5.0, self.colour(row));
        }
        front.iter().for_each(|row| canvas.ring(place(row), 8.0, FRONT));
        if let Some(best) = self.best {
            canvas.ring(place(best), 11.0, BEST);
        }
    }

    fn legend(&self, canvas: &mut dyn Canvas) {
        let mut y = TOP + 10.0;
        let mut entry = |mark: &mut dyn FnMut(&mut dyn Canvas, f64), text: &str| {
            mark(canvas, y);
            canvas.text((LEGEND + 18.0, y), Anchor::Start, INK, text);
            y += 26.0;
        };
        for (alpha, colour) in self.alphas.iter().zip(SERIES.iter().cycle()) {
            entry(&mut |canvas, y| canvas.disc((LEGEND, y), 5.0, *colour), &format!("alpha {alpha}"));
        }
        entry(&mut |canvas, y| canvas.ring((LEGEND, y), 8.0, FRONT), "Pareto front");
        if let Some(best) = self.best {
            entry(&mut |canvas, y| canvas.ring((LEGEND, y), 11.0, BEST), "best in the budget:");
            let (setting, measurement) = (best.setting, best.measurement);
            entry(&mut |_, _| {}, &format!("alpha {}", setting.alpha));
            entry(&mut |_, _| {}, &format!("beta {}", setting.beta));
            entry(&mut |_, _| {}, &format!("gamma {}", setting.gamma));
            entry(&mut |_, _| {}, &format!("cells {} m", setting.cell_m));
            entry(&mut |_, _| {}, &format!("{:.0} bit/s", measurement.stream_bps));
        }
    }

    fn colour(&self, row: &Row) -> Colour {
        let index = self.alphas.iter().position(|&alpha| alpha == row.setting.alpha).unwrap_or(0);
        SERIES[index % SERIES.len()]
    }
}

/// The Pareto front, smallest map first: rows with more information than every row of as few bytes.
fn front(rows: &[Row], information: impl Fn(&Row) -> f64) -> Vec<&Row> {
    let mut by_bytes: Vec<&Row> = rows.iter().collect();
    by_bytes.sort_by(|a, b| {
        a.measurement.map_bytes.cmp(&b.measurement.map_bytes).then(information(b).total_cmp(&information(a)))
    });
    let mut most = f64::NEG_INFINITY;
    by_bytes.retain(|row| {
        let better = information(row) > most;
        most = most.max(information(row));
        better
    });
    by_bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_core::tuning_table::TuningTable;

    fn rows() -> Vec<Row> {
        let setting = TuningTable::shipped().rows().next().unwrap().setting;
        let row = |(map_bytes, mutual_information_nats)| Row {
            setting: scenecast_core::tuning_table::Setting { alpha: mutual_information_nats, ..setting },
            measurement: Measurement {
                mutual_information_nats,
                normalised_mutual_information: 0.0,
                null_mutual_information_nats: 0.0,
                mosaic_mutual_information_nats: 2.0 * mutual_information_nats,
                labels: 4,
                map_bytes,
                stream_bps: 100.0,
            },
        };
        [(900, 0.2), (500, 0.1), (500, 0.15), (1200, 0.19), (1500, 0.4)].map(row).into()
    }

    #[test]
    fn the_front_has_rows_that_no_smaller_map_beats() {
        let rows = rows();
        let bytes: Vec<usize> = front(&rows, |row| row.measurement.mutual_information_nats)
            .iter()
            .map(|r| r.measurement.map_bytes)
            .collect();
        assert_eq!(bytes, [500, 900, 1500]);
    }

    #[test]
    fn both_plots_show_every_setting_and_have_the_same_size() {
        let rows = rows();
        let plot = Plot::new(&rows, rows.first());
        let svg = plot.svg();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("bytes of the map"));
        assert_eq!(svg.matches("r=\"5\"").count(), 2 * rows.len() + plot.alphas.len());
        let png = image::load_from_memory(&plot.png().unwrap()).unwrap();
        assert_eq!((png.width(), png.height()), (WIDTH, HEIGHT));
    }

    #[test]
    fn empty_and_equal_rows_can_be_drawn() {
        Plot::new(&[], None).png().unwrap();
        let rows = [rows()[0]; 3];
        assert!(!Plot::new(&rows, None).svg().contains("NaN"));
    }
}
