//! The paper's scatter plot: mutual information of the map, with the mosaic's colours and with
//! the annotations, against its bytes; and below it example maps from the Pareto front.

mod raster;

use image::RgbImage;
use plotters::prelude::*;
use raster::Raster;
use scenecast_core::UserError;
use scenecast_core::tuning_table::{Measurement, Row, Setting};
use std::ops::Range;

const WIDTH: u32 = 1240;
const SCATTER_HEIGHT: u32 = 620;
const EXAMPLE_HEIGHT: u32 = 380;
const HEIGHT: u32 = SCATTER_HEIGHT + EXAMPLE_HEIGHT;
/// The number of example maps that there is room for below the scatter plots.
pub const EXAMPLES: usize = 3;
const LEGEND_WIDTH: u32 = 220;
/// Height of a line of the legend, pixels.
const LEGEND_LINE: i32 = 26;
const FONT: (&str, u32) = ("sans-serif", 20);

const INK: RGBColor = RGBColor(40, 48, 56);
const FAINT: RGBColor = RGBColor(222, 227, 231);
const FRONT: RGBColor = RGBColor(120, 128, 136);
const BEST: RGBColor = RGBColor(200, 30, 40);
/// Colours of the values of alpha, or of the numbers of labels, in order (Okabe and Ito, distinguishable for colour-blind readers).
const SERIES: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(140, 140, 40),
];

type Drawn<Db> = Result<(), DrawingAreaErrorKind<<Db as DrawingBackend>::ErrorType>>;
type Area<Db> = DrawingArea<Db, plotters::coord::Shift>;

pub struct Plot<'a> {
    rows: &'a [Row],
    best: Option<&'a Row>,
    /// The maps of some rows, of the first sea floor, a pixel a cell.
    examples: Vec<(&'a Row, RgbImage)>,
    /// What the colours stand for: alpha, or where labels are habitats their number.
    series: Vec<f64>,
}

fn series(setting: &Setting) -> f64 {
    if setting.is_of_habitats() { setting.max_labels.into() } else { setting.alpha }
}

impl<'a> Plot<'a> {
    pub fn new(rows: &'a [Row], best: Option<&'a Row>) -> Self {
        let mut all: Vec<f64> = rows.iter().map(|row| series(&row.setting)).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all.dedup();
        Self { rows, best, examples: Vec::new(), series: all }
    }

    /// The smallest map of the Pareto front of the annotations, one in the middle and the largest.
    pub fn front_examples(rows: &'a [Row]) -> Vec<&'a Row> {
        let front = front(rows, |row| row.measurement.mutual_information_nats);
        let last = front.len().saturating_sub(1);
        let mut indices: Vec<usize> = (0..EXAMPLES).map(|i| i * last / (EXAMPLES - 1)).collect();
        indices.dedup();
        indices.into_iter().filter_map(|index| front.get(index).copied()).collect()
    }

    /// Draws these maps below the scatter plots, the first [`EXAMPLES`] of them, each with the row that it belongs to.
    pub fn with_examples(self, examples: Vec<(&'a Row, RgbImage)>) -> Self {
        Self { examples, ..self }
    }

    pub fn svg(&self) -> Result<String, UserError> {
        let mut svg = String::new();
        self.draw(SVGBackend::with_string(&mut svg, (WIDTH, HEIGHT))).map_err(UserError::failed)?;
        Ok(svg)
    }

    pub fn png(&self) -> Result<Vec<u8>, UserError> {
        let mut raster = Raster::new(WIDTH, HEIGHT);
        self.draw(&mut raster).map_err(UserError::failed)?;
        raster.finish().map_err(UserError::failed)
    }

    fn draw<Db: DrawingBackend>(&self, backend: Db) -> Drawn<Db> {
        let root = backend.into_drawing_area();
        root.fill(&WHITE)?;
        let (scatter, below) = root.split_vertically(SCATTER_HEIGHT);
        let (panels, legend) = scatter.split_horizontally(WIDTH - LEGEND_WIDTH);
        let (mosaic, annotations) = panels.split_horizontally((WIDTH - LEGEND_WIDTH) / 2);
        self.panel(&mosaic, "MI with the mosaic's colours, nats", |m| m.mosaic_mutual_information_nats)?;
        self.panel(&annotations, "MI with the annotations, nats", |m| m.mutual_information_nats)?;
        self.legend(&legend)?;
        for (area, (row, map)) in below.split_evenly((1, EXAMPLES)).iter().zip(&self.examples) {
            example(area, row, map)?;
        }
        root.present()
    }

    fn panel<Db: DrawingBackend>(&self, area: &Area<Db>, title: &str, of: fn(&Measurement) -> f64) -> Drawn<Db> {
        let bytes = |row: &Row| row.measurement.map_bytes as f64;
        let information = |row: &Row| of(&row.measurement);
        let place = |row: &Row| (bytes(row), information(row));
        let mut chart = ChartBuilder::on(area)
            .margin(16)
            .caption(title, FONT.into_font().color(&INK))
            .x_label_area_size(56)
            .y_label_area_size(64)
            .build_cartesian_2d(axis(self.rows.iter().map(bytes)), axis(self.rows.iter().map(information)))?;
        chart
            .configure_mesh()
            .x_desc("bytes of the map")
            .x_labels(6)
            .x_label_formatter(&|bytes| format!("{bytes:.0}"))
            .y_labels(6)
            .light_line_style(TRANSPARENT)
            .bold_line_style(FAINT)
            .axis_style(INK)
            .label_style(FONT.into_font().color(&INK))
            .draw()?;
        let front = front(self.rows, information);
        let mut stairs: Vec<(f64, f64)> = front.iter().take(1).map(|row| place(row)).collect();
        for step in front.windows(2) {
            stairs.extend([(bytes(step[1]), information(step[0])), place(step[1])]);
        }
        chart.draw_series(LineSeries::new(stairs, FRONT.stroke_width(2)))?;
        chart.draw_series(self.rows.iter().map(|row| Circle::new(place(row), 5, self.colour(row).filled())))?;
        chart.draw_series(front.iter().map(|row| Circle::new(place(row), 8, FRONT.stroke_width(2))))?;
        chart.draw_series(self.best.iter().map(|row| Circle::new(place(row), 11, BEST.stroke_width(2))))?;
        Ok(())
    }

    fn legend<Db: DrawingBackend>(&self, area: &Area<Db>) -> Drawn<Db> {
        let is_of_habitats = self.rows.iter().all(|row| row.setting.is_of_habitats());
        let mut lines: Vec<(Option<(i32, ShapeStyle)>, String)> = self
            .series
            .iter()
            .zip(SERIES.iter().cycle())
            .map(|(value, colour)| {
                (
                    Some((5, colour.filled())),
                    if is_of_habitats { format!("{value} labels") } else { format!("alpha {value}") },
                )
            })
            .collect();
        lines.push((Some((8, FRONT.stroke_width(2))), "Pareto front".to_owned()));
        if let Some(Row { setting, measurement, .. }) = self.best {
            lines.push((Some((11, BEST.stroke_width(2))), "best in the budget:".to_owned()));
            let labels = match setting.is_of_habitats() {
                true => vec![format!("{} labels", setting.max_labels), format!("{} frames/s", setting.frames_per_s)],
                false => {
                    let Setting { alpha, beta, gamma, .. } = setting;
                    vec![format!("alpha {alpha}"), format!("beta {beta}"), format!("gamma {gamma}")]
                }
            };
            let others = [format!("cells {} m", setting.cell_m), format!("{:.0} bit/s", measurement.stream_bps)];
            lines.extend(labels.into_iter().chain(others).map(|text| (None, text)));
        }
        for (y, (mark, text)) in (60..).step_by(LEGEND_LINE as usize).zip(lines) {
            if let Some((radius, style)) = mark {
                area.draw(&Circle::new((16, y), radius, style))?;
            }
            area.draw(&Text::new(text, (36, y - 8), FONT.into_font().color(&INK)))?;
        }
        Ok(())
    }

    fn colour(&self, row: &Row) -> RGBColor {
        let index = self.series.iter().position(|&value| value == series(&row.setting)).unwrap_or(0);
        SERIES[index % SERIES.len()]
    }
}

/// A map under its setting; equal neighbours of a row are one rectangle.
fn example<Db: DrawingBackend>(area: &Area<Db>, row: &Row, map: &RgbImage) -> Drawn<Db> {
    let Row { setting, measurement, .. } = row;
    let labels = match setting.is_of_habitats() {
        true => format!("{} labels", setting.max_labels),
        false => format!("alpha {}", setting.alpha),
    };
    let title = format!("{labels}: {:.2} nats, {} bytes", measurement.mutual_information_nats, measurement.map_bytes);
    area.draw(&Text::new(title, (16, 8), FONT.into_font().color(&INK)))?;
    let (wide, high) = area.dim_in_pixel();
    let (columns, rows) = map.dimensions();
    let scale = (f64::from(wide - 32) / f64::from(columns)).min(f64::from(high - 56) / f64::from(rows));
    let at = |column: u32, row: u32| {
        (16 + (f64::from(column) * scale).round() as i32, 40 + (f64::from(row) * scale).round() as i32)
    };
    for (row, pixels) in (0..).zip(map.rows()) {
        let pixels: Vec<_> = pixels.collect();
        let mut column = 0;
        for run in pixels.chunk_by(|a, b| a == b) {
            let [red, green, blue] = run[0].0;
            let corners = [at(column, row), at(column + run.len() as u32, row + 1)];
            area.draw(&Rectangle::new(corners, RGBColor(red, green, blue).filled()))?;
            column += run.len() as u32;
        }
    }
    Ok(())
}

/// The range of an axis over all of the values; it starts at 0 unless they are close to each other.
fn axis(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let margin = if high - low > 1e-9 { 0.08 * (high - low) } else { high.abs().max(1e-3) };
    let from = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - margin };
    from..high + margin
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
            setting: Setting { alpha: mutual_information_nats, ..setting },
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
        let svg = plot.svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("bytes of the map"));
        assert_eq!(svg.matches("r=\"5\"").count(), 2 * rows.len() + plot.series.len());
        let png = image::load_from_memory(&plot.png().unwrap()).unwrap();
        assert_eq!((png.width(), png.height()), (WIDTH, HEIGHT));
    }

    #[test]
    fn example_maps_of_the_front_are_drawn_below_it() {
        let rows = rows();
        let map = RgbImage::from_fn(6, 4, |x, _| image::Rgb([if x < 3 { 9 } else { 250 }, 100, 7]));
        let examples: Vec<_> = Plot::front_examples(&rows).into_iter().map(|row| (row, map.clone())).collect();
        let bytes: Vec<usize> = examples.iter().map(|(row, _)| row.measurement.map_bytes).collect();
        assert_eq!(bytes, [500, 900, 1500]);
        let plot = Plot::new(&rows, rows.first()).with_examples(examples);
        assert_eq!(plot.svg().unwrap().matches("fill=\"#096407\"").count(), 3 * 4);
        let png = image::load_from_memory(&plot.png().unwrap()).unwrap().to_rgb8();
        let is_left = |&(_, y, pixel): &(u32, u32, &image::Rgb<u8>)| y > SCATTER_HEIGHT && pixel.0 == [9, 100, 7];
        assert!(png.enumerate_pixels().filter(is_left).count() > 3 * 100 * 100);
        assert!(Plot::front_examples(&rows[..1]).len() == 1 && Plot::front_examples(&[]).is_empty());
    }

    #[test]
    fn empty_and_equal_rows_can_be_drawn() {
        Plot::new(&[], None).png().unwrap();
        let rows = [rows()[0]; 3];
        assert!(!Plot::new(&rows, None).svg().unwrap().contains("NaN"));
    }
}
