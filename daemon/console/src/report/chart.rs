//! The lines over time of a report as SVG, and its scales. They are readable in print.

use super::{Escaped, gaps};
use scenecast_core::utc_text;

/// Width of a figure, pixels.
pub(super) const WIDTH: f64 = 760.0;

/// The next lower of 1, 2 and 5 times a power of ten.
pub(super) fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|n| n * power).find(|n| *n <= length * 1.000_001).unwrap_or(power)
}

/// The scale bar below an image that is so wide on the sea floor: a round length of at most half of the width.
pub(super) fn scale_of_image(width_m: f64) -> String {
    let length_m = round_length(width_m / 2.0);
    let bar = 130.0 * length_m / width_m;
    let length = match length_m {
        m if m < 0.0095 => format!("{:.0} mm", m * 1000.0),
        m if m < 0.95 => format!("{:.0} cm", m * 100.0),
        m => format!("{m:.0} m"),
    };
    format!(
        "<svg viewBox=\"0 0 130 14\" role=\"img\" aria-label=\"scale\"><path class=\"scale\" d=\"M1 3v6h{bar:.1}v-6\"/>\
         <text x=\"{:.1}\" y=\"11\">{length}</text></svg>",
        bar + 6.0
    )
}

/// The values of one quantity from which [`line`] draws a chart.
pub(super) struct Series<'a> {
    pub(super) name: &'a str,
    pub(super) unit: String,
    /// Seconds since the beginning, and the value; NaN where it is unknown.
    pub(super) points: Vec<(f64, f64)>,
}

/// A quantity over time as a line, from `begin_s` on, seconds since 1970; `None` with fewer than two known values.
pub(super) fn line(series: &Series<'_>, begin_s: f64, length_s: f64) -> Option<String> {
    const HEIGHT: f64 = 110.0;
    let known: Vec<(f64, f64)> = series.points.iter().copied().filter(|(_, value)| value.is_finite()).collect();
    if known.len() < 2 || length_s <= 0.0 {
        return None;
    }
    let most = known.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let top = round_height(most);
    let place = |&(at_s, value): &(f64, f64)| {
        let x = 60.0 + (at_s / length_s).clamp(0.0, 1.0) * (WIDTH - 70.0);
        format!("{x:.1} {:.1}", HEIGHT - 20.0 - value / top * (HEIGHT - 42.0))
    };
    let lines = rows(&series.points).into_iter().map(|row| {
        let points: Vec<String> = thinned(&row, length_s / WIDTH).iter().map(place).collect();
        // A point alone is a dot.
        format!("M{}h0", points.join("L"))
    });
    let lines: String = lines.collect();
    Some(format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{name} over time\" xmlns=\"http://www.w3.org/2000/svg\">\
         <path class=\"grid\" d=\"M60 {bottom}H{WIDTH}M60 {middle}H{WIDTH}M60 22H{WIDTH}{ticks}\"/><path class=\"line\" stroke-linecap=\"round\" d=\"{lines}\"/>\
         <text x=\"2\" y=\"{bottom}\">0</text><text x=\"2\" y=\"26\">{top}</text><text x=\"60\" y=\"11\">{name}, {unit}</text>\
         <text x=\"60\" y=\"{low}\">{begin} UTC</text><text x=\"{half}\" y=\"{low}\" text-anchor=\"middle\">{noon}</text>\
         <text x=\"{WIDTH}\" y=\"{low}\" text-anchor=\"end\">{end} UTC</text></svg>",
        name = Escaped(series.name),
        unit = Escaped(&series.unit),
        bottom = HEIGHT - 20.0,
        middle = (HEIGHT - 20.0 + 22.0) / 2.0,
        low = HEIGHT - 4.0,
        ticks = [0.25, 0.5, 0.75].map(|at| format!("M{:.1} 22V{}", 60.0 + at * (WIDTH - 70.0), HEIGHT - 20.0)).concat(),
        half = 60.0 + 0.5 * (WIDTH - 70.0),
        noon = clock(begin_s + length_s / 2.0),
        begin = clock(begin_s),
        end = clock(begin_s + length_s)
    ))
}

/// The points of a line without those of unknown values, apart where one is unknown or comes far later than usual.
fn rows(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let times: Vec<f64> = points.iter().map(|(at_s, _)| *at_s).collect();
    let most_apart_s = gaps::unusual_s(&times);
    let is_near = |a: &(f64, f64), b: &(f64, f64)| b.0 - a.0 <= most_apart_s && a.1.is_finite() && b.1.is_finite();
    points.chunk_by(is_near).filter(|row| row[0].1.is_finite()).map(<[_]>::to_vec).collect()
}

/// Of the points within each so many seconds, the least and the greatest one.
fn thinned(row: &[(f64, f64)], column_s: f64) -> Vec<(f64, f64)> {
    let column = |point: &(f64, f64)| (point.0 / column_s).floor();
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let ends = row.chunk_by(|a, b| column(a) == column(b)).flat_map(|points| {
        let mut ends: Vec<(f64, f64)> =
            points.iter().min_by(by_value).into_iter().chain(points.iter().max_by(by_value)).copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends.dedup();
        ends
    });
    ends.collect()
}

/// Month, day, hours, minutes and seconds of a moment, UTC.
fn clock(at_s: f64) -> String {
    utc_text(at_s).get(5..19).unwrap_or_default().replace('T', " ")
}

/// The next higher of 1, 2 and 5 times a power of ten; 1 for nothing.
fn round_height(most: f64) -> f64 {
    if most <= 0.0 {
        return 1.0;
    }
    let power = 10f64.powf(most.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|n| n * power).find(|n| *n >= most * 0.999_999).unwrap_or(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_have_round_lengths() {
        assert_eq!([1.0, 3.7, 19.9, 50.0, 0.7].map(round_length), [1.0, 2.0, 10.0, 50.0, 0.5]);
        assert_eq!([0.0, 1.0, 3.7, 24_992.0, 61.0].map(round_height), [1.0, 1.0, 5.0, 50_000.0, 100.0]);
    }

    #[test]
    fn a_line_breaks_where_nothing_is_known() {
        let lengths = |points: &[(f64, f64)]| rows(points).iter().map(Vec::len).collect::<Vec<_>>();
        let at = |s: u32| (f64::from(s), 1.0);
        let paused: Vec<_> = (0..40).chain(70..99).map(at).collect();
        assert_eq!(lengths(&paused), [40, 29], "30 s where a second is usual");
        let seldom: Vec<_> = (0..9).map(|n| at(n * 60)).collect();
        assert_eq!(lengths(&seldom), [9], "a minute is usual");
        assert_eq!(lengths(&[at(0), at(1), (2.0, f64::NAN), at(3)]), [2, 1]);
        assert_eq!(
            thinned(&[(0.0, 1.0), (0.1, 9.0), (0.2, 3.0), (1.5, 2.0)], 1.0),
            [(0.0, 1.0), (0.1, 9.0), (1.5, 2.0)]
        );
    }
}
