//! The comparison of planners as figures and as a picture: for each source of scenes, and tracks over the label map.

use super::scene::CELL_M;
use super::{Source, Trial};
use image::{ImageFormat, Rgb, RgbImage};
use scenecast_core::palette::colour;
use scenecast_protocol::map::Cell;
use serde::Serialize;
use std::io::Cursor;

/// A figure with its standard error over the trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    pub value: f64,
    /// By the jackknife; 0 for a single trial.
    pub standard_error: f64,
}

/// The means of the trials of one source. Utility per metre is in units of the scene's mean utility of a metre on which
/// all is new, so that rare and common classes have equal weight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceTable {
    pub source: Source,
    pub trials: usize,
    pub lawnmower: Estimate,
    pub greedy: Estimate,
    /// The planner of the best path over a horizon.
    pub horizon: Estimate,
    /// `horizon` if it knows the whole map from the start: the difference is the cost of not knowing it.
    pub map_known: Estimate,
    /// The mean of `horizon` divided by that of `lawnmower`.
    pub horizon_by_lawnmower: Estimate,
    /// The mean of `horizon` divided by that of `greedy`.
    pub horizon_by_greedy: Estimate,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanningTable {
    pub sources: Vec<SourceTable>,
    /// Breaches of fence, keep-outs and limit in all trials.
    pub violations: usize,
    pub seeds: u64,
}

/// The figures of a trial: lawnmower, greedy, horizon, and horizon with the known map.
pub(super) struct Row {
    source: Source,
    values: [f64; 4],
    violations: usize,
}

impl Row {
    pub(super) fn of(trial: &Trial) -> Self {
        let [lawnmower, greedy, horizon] = trial.utility_per_m;
        let values = [lawnmower, greedy, horizon, trial.map_known_per_m];
        Self { source: trial.source, values, violations: trial.violations }
    }
}

impl PlanningTable {
    pub(super) fn new(rows: &[Row], seeds: u64) -> Self {
        let mut sources: Vec<Source> = rows.iter().map(|row| row.source).collect();
        sources.sort_unstable();
        sources.dedup();
        let sources = sources.into_iter().map(|source| SourceTable::new(source, rows)).collect();
        Self { sources, violations: rows.iter().map(|row| row.violations).sum(), seeds }
    }
}

impl SourceTable {
    fn new(source: Source, rows: &[Row]) -> Self {
        let values: Vec<[f64; 4]> = rows.iter().filter(|row| row.source == source).map(|row| row.values).collect();
        let mean = |i: usize| estimate(&values, |sum| sum[i] / sum[4]);
        let ratio = |i: usize, j: usize| estimate(&values, |sum| sum[i] / sum[j].max(1e-9));
        Self {
            source,
            trials: values.len(),
            lawnmower: mean(0),
            greedy: mean(1),
            horizon: mean(2),
            map_known: mean(3),
            horizon_by_lawnmower: ratio(2, 0),
            horizon_by_greedy: ratio(2, 1),
        }
    }
}

/// A function of the sums over all trials (the four values and the number of trials), and its standard error by the
/// jackknife: the trials are left out one after the other (Efron, 1982).
fn estimate(values: &[[f64; 4]], of: impl Fn([f64; 5]) -> f64) -> Estimate {
    let n = values.len() as f64;
    let mut all = [0.0, 0.0, 0.0, 0.0, n];
    values.iter().for_each(|v| v.iter().zip(&mut all).for_each(|(v, sum)| *sum += v));
    let without = |v: &[f64; 4]| of([all[0] - v[0], all[1] - v[1], all[2] - v[2], all[3] - v[3], n - 1.0]);
    let standard_error = if values.len() < 2 {
        0.0
    } else {
        let parts: Vec<f64> = values.iter().map(without).collect();
        let mean = parts.iter().sum::<f64>() / n;
        ((n - 1.0) / n * parts.iter().map(|p| (p - mean).powi(2)).sum::<f64>()).sqrt()
    };
    let round = |value: f64| (value * 1e3).round() / 1e3;
    Estimate { value: round(of(all)), standard_error: round(standard_error) }
}

/// Edge of a cell in the image, pixels.
const PX: u32 = 5;
const GAP: u32 = 12;
const OUTLINE: Rgb<u8> = Rgb([220, 30, 30]);
const TRACK: Rgb<u8> = Rgb([255; 3]);
const SHADE: Rgb<u8> = Rgb([15, 20, 30]);

/// Lawnmower, greedy and horizon from left to right, as a PNG file. Favoured labels have their colours, the others a
/// faint grey of theirs; the fence and the keep-outs are red.
pub fn plot(trial: &Trial) -> image::ImageResult<Vec<u8>> {
    let cells = |metres: f64| (metres / CELL_M).round() as u32;
    let (width, height) = (cells(trial.scene.area.east) * PX, cells(trial.scene.area.north) * PX);
    let panels = trial.runs.len() as u32;
    let mut image = RgbImage::from_pixel(panels * width + (panels - 1) * GAP, height, Rgb([255; 3]));
    for (panel, run) in (0..).zip(&trial.runs) {
        let left = panel * (width + GAP);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let cell = Cell::new((x / PX) as i32, ((height - 1 - y) / PX) as i32);
            image.put_pixel(left + x, y, floor(trial, cell));
        }
        let place = |(x, y): (f64, f64)| {
            let px = f64::from(PX) / CELL_M;
            (f64::from(left) + x * px, f64::from(height) - y * px)
        };
        for outline in trial.task.fence.outlines() {
            outline
                .edges()
                .for_each(|(a, b)| line(&mut image, place(a.to_world().xy()), place(b.to_world().xy()), 1, OUTLINE));
        }
        for (reach, colour) in [(2, SHADE), (1, TRACK)] {
            run.track.windows(2).for_each(|leg| line(&mut image, place(leg[0]), place(leg[1]), reach, colour));
        }
    }
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

fn floor(trial: &Trial, cell: Cell) -> Rgb<u8> {
    let label = trial.scene.labels.get(cell);
    let rgb = colour(label);
    match trial.scene.utility.weight(label) {
        w if w > 0.0 => Rgb(rgb),
        _ => {
            let grey = rgb.iter().map(|&c| u16::from(c)).sum::<u16>() / 3;
            Rgb([(150 + grey / 4) as u8; 3])
        }
    }
}

fn line(image: &mut RgbImage, from: (f64, f64), to: (f64, f64), reach: i64, colour: Rgb<u8>) {
    let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0) as u32;
    for i in 0..=steps {
        let t = f64::from(i) / f64::from(steps);
        let (x, y) = ((from.0 + (to.0 - from.0) * t) as i64, (from.1 + (to.1 - from.1) * t) as i64);
        for (px, py) in (1 - reach..reach).flat_map(|dy| (1 - reach..reach).map(move |dx| (x + dx, y + dy))) {
            if let (Ok(px), Ok(py)) = (u32::try_from(px), u32::try_from(py))
                && px < image.width()
                && py < image.height()
            {
                image.put_pixel(px, py, colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_the_usual_standard_error() {
        let values = [1.0, 2.0, 3.0, 6.0].map(|v| [v, 1.0, 2.0 * v, 0.0]);
        // The deviations from 3 are 2, 1, 0 and 3: sqrt(14 / (3 x 4)).
        assert_eq!(estimate(&values, |sum| sum[0] / sum[4]), Estimate { value: 3.0, standard_error: 1.08 });
        let same = estimate(&values, |sum| sum[2] / sum[0]);
        assert_eq!(same, Estimate { value: 2.0, standard_error: 0.0 }, "one is always twice the other");
        assert_eq!(estimate(&values[..1], |sum| sum[0] / sum[4]), Estimate { value: 1.0, standard_error: 0.0 });
    }
}
