//! The best rigid fit of one track to another.

/// The distances of the points from `truth` after the best turn and shift.
pub fn rigid_errors(points: &[(f64, f64)], truth: &[(f64, f64)]) -> Vec<f64> {
    let count = points.len() as f64;
    let mean = |track: &[(f64, f64)]| {
        let sum = track.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
        (sum.0 / count, sum.1 / count)
    };
    let (from, to) = (mean(points), mean(truth));
    let (mut cos, mut sin) = (0.0, 0.0);
    for (a, b) in points.iter().zip(truth) {
        let (ax, ay, bx, by) = (a.0 - from.0, a.1 - from.1, b.0 - to.0, b.1 - to.1);
        cos += ax * bx + ay * by;
        sin += ax * by - ay * bx;
    }
    let norm = f64::hypot(cos, sin).max(1e-12);
    let (cos, sin) = (cos / norm, sin / norm);
    let error = |(a, b): (&(f64, f64), &(f64, f64))| {
        let (x, y) = (a.0 - from.0, a.1 - from.1);
        (cos * x - sin * y + to.0 - b.0).hypot(sin * x + cos * y + to.1 - b.1)
    };
    points.iter().zip(truth).map(error).collect()
}
