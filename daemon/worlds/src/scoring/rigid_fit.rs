//! The best rigid fit of one track to another.

/// A point and the point that it should be at.
pub type PointPair = ((f64, f64), (f64, f64));

/// A turn and a shift of the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidFit {
    cos: f64,
    sin: f64,
    from: (f64, f64),
    to: (f64, f64),
}

impl RigidFit {
    /// The turn and shift with the least squares between `from`, once it is moved, and `to`.
    pub fn new(pairs: &[PointPair]) -> Self {
        let count = pairs.len().max(1) as f64;
        let sum = pairs.iter().fold([0.0; 4], |s, (a, b)| [s[0] + a.0, s[1] + a.1, s[2] + b.0, s[3] + b.1]);
        let [ax, ay, bx, by] = sum.map(|sum| sum / count);
        let (mut cos, mut sin) = (0.0, 0.0);
        for (a, b) in pairs {
            let (a, b) = ((a.0 - ax, a.1 - ay), (b.0 - bx, b.1 - by));
            cos += a.0 * b.0 + a.1 * b.1;
            sin += a.0 * b.1 - a.1 * b.0;
        }
        let norm = f64::hypot(cos, sin);
        let (cos, sin) = if norm > 1e-9 { (cos / norm, sin / norm) } else { (1.0, 0.0) };
        Self { cos, sin, from: (ax, ay), to: (bx, by) }
    }

    /// The point, turned and shifted by the fit.
    pub fn apply(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (x, y) = (x - self.from.0, y - self.from.1);
        (self.cos * x - self.sin * y + self.to.0, self.sin * x + self.cos * y + self.to.1)
    }
}

/// The root mean square distance of pairs of points.
pub fn rms_distance(pairs: impl Iterator<Item = PointPair>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in pairs {
        sum += (a.0 - b.0).powi(2) + (a.1 - b.1).powi(2);
        count += 1.0;
    }
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_and_shifted_track_fits_exactly() {
        let (sin, cos) = 0.3f64.sin_cos();
        let moved = |(x, y): (f64, f64)| (cos * x - sin * y + 5.0, sin * x + cos * y - 2.0);
        let pairs: Vec<_> = [(0.0, 0.0), (4.0, 1.0), (-2.0, 7.0)].map(|at| (at, moved(at))).to_vec();
        let fit = RigidFit::new(&pairs);
        assert!(rms_distance(pairs.iter().map(|&(a, b)| (fit.apply(a), b))) < 1e-12);
        assert!(rms_distance(pairs.iter().copied()) > 4.0);
        assert_eq!(RigidFit::new(&[]).apply((1.0, 2.0)), (1.0, 2.0));
    }
}
