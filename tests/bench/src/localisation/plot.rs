//! A track with and without the relay, as a chart.

use super::Tracks;
use plotters::coord::Shift;
use plotters::prelude::*;

const WIDTH: u32 = 900;
/// Space for the title, the labels of the axes and the margins, pixels.
const FRAME: (u32, u32) = (90, 120);
/// Height of the key below the tracks, pixels.
const KEY: f64 = 160.0;
const FONT: (&str, u32) = ("sans-serif", 18);

const SHIP: RGBColor = RGBColor(183, 163, 217);
const TRUTH: RGBColor = RGBColor(176, 176, 176);
const RECKONED: RGBColor = RGBColor(209, 73, 91);
const RELAYED: RGBColor = RGBColor(0, 121, 140);
const REFUSED: RGBColor = RGBColor(237, 174, 73);

type SvgError = DrawingAreaErrorKind<std::io::Error>;

/// Draws truth, dead reckoning and relayed estimate as SVG, in metres east and north.
///
/// # Errors
/// The error of `plotters`, if it cannot draw.
pub fn localisation_plot(tracks: &Tracks, title: &str) -> Result<String, SvgError> {
    let all = || tracks.truth.iter().chain(&tracks.reckoned).chain(&tracks.relayed).chain(&tracks.ship);
    let ends = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = all().map(of).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let margin = 0.03 * (high - low).max(1.0);
        low - margin..high + margin
    };
    let (east, north) = (ends(|p| p.0), ends(|p| p.1));
    let pixels_per_metre = f64::from(WIDTH - FRAME.0) / (east.end - east.start);
    let north = north.start - KEY / pixels_per_metre..north.end;
    let height = ((north.end - north.start) * pixels_per_metre).round() as u32 + FRAME.1;
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
    draw(&area, tracks, title, east, north)?;
    drop(area);
    Ok(svg)
}

fn draw(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    tracks: &Tracks,
    title: &str,
    east: std::ops::Range<f64>,
    north: std::ops::Range<f64>,
) -> Result<(), SvgError> {
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(title, FONT)
        .x_label_area_size(50)
        .y_label_area_size(70)
        .build_cartesian_2d(east, north)?;
    chart
        .configure_mesh()
        .x_desc("metres east")
        .y_desc("metres north")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(FONT)
        .light_line_style(TRANSPARENT)
        .draw()?;
    let with_error = |name: &str, track: &[(f64, f64)]| format!("{name}, mean error {:.1} m", tracks.mean_error(track));
    for (track, style, name) in [
        (&tracks.ship, SHIP.stroke_width(2), "surface vehicle".to_owned()),
        (&tracks.truth, TRUTH.stroke_width(5), "true track".to_owned()),
        (&tracks.reckoned, RECKONED.stroke_width(2), with_error("dead reckoning", &tracks.reckoned)),
        (&tracks.relayed, RELAYED.stroke_width(2), with_error("with the fixes of the relay", &tracks.relayed)),
    ] {
        let key = move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], style);
        chart.draw_series(LineSeries::new(track.iter().step_by(5).copied(), style))?.label(name).legend(key);
    }
    for (used, colour, name) in [(true, RELAYED, "fix that was used"), (false, REFUSED, "fix that was refused")] {
        let fixes = tracks.fixes.iter().filter(|fix| fix.1 == used);
        chart
            .draw_series(fixes.map(|fix| Circle::new(fix.0, 3, colour.filled())))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 10, y), 3, colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE)
        .label_font(FONT)
        .draw()?;
    area.present()
}
