//! The quality of the maps over time, as a table and as charts.

use crate::mission::{MapInformation, MapQuality};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::fmt::Write;

const COLUMNS: &str = "t_s,vehicle_rigid_nats,vehicle_placed_nats,operator_rigid_nats,operator_placed_nats,agreement,\
                       age_s,error_rigid_cells,error_placed_cells,relabelled";

/// A table of samples, comma separated, with one line a sample; a value that is not known is empty.
pub fn quality_csv(samples: &[MapQuality]) -> String {
    let mut text = format!("{COLUMNS}\n");
    let or_empty = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
    for s in samples {
        let both = |map: Option<MapInformation>| {
            format!("{},{}", or_empty(map.map(|i| i.rigid_nats)), or_empty(map.map(|i| i.placed_nats)))
        };
        let (vehicle, operator) = (both(s.vehicle), both(s.operator));
        let (rigid, placed) = (or_empty(s.error_rigid_cells), or_empty(s.error_placed_cells));
        let relabelled = or_empty(s.relabelled);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:.0},{vehicle},{operator},{:.4},{:.2},{rigid},{placed},{relabelled}",
            s.t_s, s.agreement, s.age_s
        );
    }
    text
}

/// The charts of a mission: the information of both maps, and the errors of the frames' places.
pub fn mission_panels(samples: &[MapQuality]) -> Vec<Panel> {
    let rigid = |map: Option<MapInformation>| map.map(|i| i.rigid_nats);
    let placed = |map: Option<MapInformation>| map.map(|i| i.placed_nats);
    let curve = |name: &str, line, of: &dyn Fn(&MapQuality) -> Option<f64>| Curve::new(name, line, samples, of);
    let information = vec![
        curve("vehicle's map, rigid", Line::REFERENCE, &|s| rigid(s.vehicle)),
        curve("vehicle's map, placed", Line::REFERENCE.thin(), &|s| placed(s.vehicle)),
        curve("operator's map, rigid", Line::OURS, &|s| rigid(s.operator)),
        curve("operator's map, placed", Line::OURS.thin(), &|s| placed(s.operator)),
    ];
    let errors = vec![
        curve("rigid", Line::REFERENCE, &|s| s.error_rigid_cells),
        curve("placed", Line::REFERENCE.thin(), &|s| s.error_placed_cells),
    ];
    vec![
        Panel { title: "Mutual information with the true classes".to_owned(), unit: "nats", curves: information },
        Panel { title: "Error of the frames' places".to_owned(), unit: "cells", curves: errors },
    ]
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_s: f64, nats: Option<f64>) -> MapQuality {
        let map = nats.map(|rigid_nats| MapInformation { rigid_nats, placed_nats: rigid_nats / 2.0 });
        let (agreement, age_s) = (0.5, 12.0);
        MapQuality {
            t_s,
            vehicle: map,
            operator: map,
            agreement,
            age_s,
            relabelled: None,
            error_rigid_cells: None,
            error_placed_cells: Some(1.0),
        }
    }

    #[test]
    fn an_unknown_value_is_an_empty_field() {
        let text = quality_csv(&[sample(0.0, Some(0.5)), sample(30.0, None)]);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["0,0.5000,0.2500,0.5000,0.2500,0.5000,12.00,,1.0000,", "30,,,,,0.5000,12.00,,1.0000,"]);
    }

    #[test]
    fn curves_without_values_are_not_drawn() {
        let samples = [sample(0.0, Some(0.1)), sample(30.0, Some(0.5))];
        let svg = quality_plot(&mission_panels(&samples), "a mission").unwrap();
        let known = samples.map(|sample| MapQuality { error_rigid_cells: Some(0.5), ..sample });
        let whole = quality_plot(&mission_panels(&known), "a mission").unwrap();
        let lines = |svg: &str| svg.matches("<polyline").count();
        assert!(lines(&svg) < lines(&whole), "the error after a rigid fit is unknown");
        assert!(quality_plot(&mission_panels(&[]), "no sample").is_ok());
    }
}
