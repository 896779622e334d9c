//! Curves over the time of a mission, in one panel beside the other.

use crate::mission::MapQuality;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Size of a panel, pixels.
const PANEL: (u32, u32) = (560, 400);
/// Panels beside each other in one row.
const ACROSS: usize = 2;
const TITLE: u32 = 34;
const FONT: (&str, u32) = ("sans-serif", 16);

type SvgError = DrawingAreaErrorKind<std::io::Error>;

/// The look of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    rgb: (u8, u8, u8),
    width: u32,
}

impl Line {
    /// Grey, for the value that a curve can reach at best.
    pub const REFERENCE: Self = Self { rgb: (120, 120, 120), width: 3 };
    pub const OURS: Self = Self { rgb: (0, 121, 140), width: 3 };
    pub const BASELINE: Self = Self { rgb: (209, 73, 91), width: 3 };

    #[must_use]
    pub fn thin(self) -> Self {
        Self { width: 1, ..self }
    }

    fn style(self) -> ShapeStyle {
        RGBColor(self.rgb.0, self.rgb.1, self.rgb.2).stroke_width(self.width)
    }
}

/// A value over time in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub name: String,
    pub line: Line,
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// The curve of a value; samples without it are left out.
    pub fn new(name: &str, line: Line, samples: &[MapQuality], of: &dyn Fn(&MapQuality) -> Option<f64>) -> Self {
        let points = samples.iter().filter_map(|sample| Some((sample.t_s, of(sample)?))).collect();
        Self { name: name.to_owned(), line, points }
    }
}

/// Curves with a common scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub title: String,
    /// The unit of the curves' values.
    pub unit: &'static str,
    pub curves: Vec<Curve>,
}

/// Draws panels, two in a row, as SVG.
///
/// # Errors
/// The error of `plotters`, if it cannot draw.
pub fn quality_plot(panels: &[Panel], title: &str) -> Result<String, SvgError> {
    let across = panels.len().clamp(1, ACROSS);
    let rows = panels.len().div_ceil(across).max(1);
    let size = (PANEL.0 * across as u32, PANEL.1 * rows as u32 + TITLE);
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
    area.fill(&WHITE)?;
    let below = area.titled(title, FONT)?;
    for (place, panel) in below.split_evenly((rows, across)).iter().zip(panels) {
        draw(place, panel)?;
    }
    area.present()?;
    drop((below, area));
    Ok(svg)
}

fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel) -> Result<(), SvgError> {
    let end = |of: fn(&(f64, f64)) -> f64| panel.curves.iter().flat_map(|c| &c.points).map(of).fold(0.0, f64::max);
    let (seconds, most) = (end(|p| p.0).max(1.0), end(|p| p.1).max(1e-3) * 1.05);
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(&panel.title, FONT)
        .x_label_area_size(42)
        .y_label_area_size(60)
        .build_cartesian_2d(0.0..seconds, 0.0..most)?;
    chart
        .configure_mesh()
        .x_desc("seconds")
        .y_desc(panel.unit)
        .x_label_formatter(&|x| format!("{x:.0}"))
        .label_style(FONT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for curve in panel.curves.iter().filter(|curve| !curve.points.is_empty()) {
        let style = curve.line.style();
        let key = move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], style);
        chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?.label(&curve.name).legend(key);
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .label_font(FONT)
        .draw()
}
