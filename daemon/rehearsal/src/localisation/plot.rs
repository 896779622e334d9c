//! A track with and without the relay, as a drawing.

use super::Tracks;
use std::fmt::Write;

const WIDTH: f64 = 900.0;
const MARGIN: f64 = 30.0;
const FOOT: f64 = 96.0;

/// Draws truth, dead reckoning and relayed estimate as SVG, north up.
pub fn localisation_plot(tracks: &Tracks, title: &str) -> String {
    let all = || tracks.truth.iter().chain(&tracks.reckoned).chain(&tracks.relayed).chain(&tracks.ship);
    let (mut west, mut south, mut east, mut north) = (f64::MAX, f64::MAX, f64::MIN, f64::MIN);
    for &(x, y) in all() {
        (west, south, east, north) = (west.min(x), south.min(y), east.max(x), north.max(y));
    }
    let scale = (WIDTH - 2.0 * MARGIN) / (east - west).max(1.0);
    let height = (north - south).max(1.0) * scale + 2.0 * MARGIN;
    let at = |&(x, y): &(f64, f64)| ((x - west) * scale + MARGIN, (north - y) * scale + MARGIN);
    let line = |track: &[(f64, f64)], colour: &str, style: &str| {
        let points = track.iter().step_by(5).map(&at).fold(String::new(), |mut all, (x, y)| {
            let _ = write!(all, "{x:.1},{y:.1} ");
            all
        });
        format!("<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" {style}/>\n")
    };
    let total = height + FOOT;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {total:.0}\" font-family=\"sans-serif\" \
         font-size=\"15\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    svg += &line(&tracks.ship, "#b7a3d9", "stroke-width=\"1.5\"");
    svg += &line(&tracks.truth, "#b0b0b0", "stroke-width=\"5\"");
    svg += &line(&tracks.reckoned, "#d1495b", "stroke-width=\"2\" stroke-dasharray=\"7 4\"");
    svg += &line(&tracks.relayed, "#00798c", "stroke-width=\"2\"");
    for (place, used) in &tracks.fixes {
        let (x, y) = at(place);
        let inside = (0.0..=WIDTH).contains(&x) && (0.0..=height).contains(&y);
        if inside {
            let colour = if *used { "#00798c" } else { "#edae49" };
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{colour}\"/>");
        }
    }
    svg += &legend(tracks, title, scale, height);
    svg + "</svg>\n"
}

fn legend(tracks: &Tracks, title: &str, scale: f64, top: f64) -> String {
    let error = |track: &[(f64, f64)]| format!("{:.1} m", tracks.mean_error(track));
    let bar = 100.0 * scale;
    let mut text = format!("<text x=\"{MARGIN}\" y=\"{:.0}\" font-weight=\"bold\">{title}</text>\n", top + 8.0);
    let entries = [
        ("#b0b0b0", "where it was".to_owned()),
        ("#d1495b", format!("dead reckoning, mean error {}", error(&tracks.reckoned))),
        ("#00798c", format!("with the relay and its fixes, mean error {}", error(&tracks.relayed))),
        ("#b7a3d9", "the surface vehicle".to_owned()),
        ("#edae49", "fix that the vehicle refused".to_owned()),
    ];
    for (i, (colour, name)) in entries.iter().enumerate() {
        let (x, y) = (MARGIN + (i % 2) as f64 * 400.0, top + 32.0 + (i / 2) as f64 * 22.0);
        let _ = writeln!(
            text,
            "<rect x=\"{x:.0}\" y=\"{:.0}\" width=\"18\" height=\"5\" fill=\"{colour}\"/>\
             <text x=\"{:.0}\" y=\"{y:.0}\">{name}</text>",
            y - 8.0,
            x + 24.0
        );
    }
    let (x, y) = (WIDTH - MARGIN - bar, top + 76.0);
    let _ = writeln!(
        text,
        "<path d=\"M{x:.1} {y:.0}h{bar:.1}\" stroke=\"#222\" stroke-width=\"3\"/>\
         <text x=\"{x:.1}\" y=\"{:.0}\">100 m, north up</text>",
        y - 8.0
    );
    text
}
