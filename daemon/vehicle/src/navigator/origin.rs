//! The place of the map's origin in the world, as a robust mean of fixes.

/// A fix that is further from the mean than so many standard deviations counts less.
const HUBER: f64 = 1.5;

/// A mean of the differences between fixes and the map. A registered map does not drift, so that all fixes count alike.
#[derive(Debug)]
pub(super) struct Origin {
    at: (f64, f64),
    variance_m2: f64,
}

impl Origin {
    /// An origin at a place, known to `sigma_m` metres in each direction.
    pub(super) fn new(at: (f64, f64), sigma_m: f64) -> Self {
        Self { at, variance_m2: sigma_m * sigma_m }
    }

    pub(super) fn at(&self) -> (f64, f64) {
        self.at
    }

    pub(super) fn add_uncertainty(&mut self, sigma_m: f64) {
        self.variance_m2 += sigma_m * sigma_m;
    }

    /// The map has drifted by `sigma_m` more, in the same direction as before.
    pub(super) fn drift(&mut self, sigma_m: f64) {
        self.variance_m2 = (self.variance_m2.max(0.0).sqrt() + sigma_m).powi(2);
    }

    /// A fix says that the origin is `at`, with a standard deviation in metres.
    pub(super) fn correct(&mut self, at: (f64, f64), sigma_m: f64) {
        let off = (at.0 - self.at.0, at.1 - self.at.1);
        let expected = (self.variance_m2 + sigma_m * sigma_m).sqrt();
        let doubt = (off.0.hypot(off.1) / (HUBER * std::f64::consts::SQRT_2 * expected)).max(1.0);
        let gain = self.variance_m2 / (self.variance_m2 + (doubt * sigma_m).powi(2)).max(1e-12);
        self.at = (self.at.0 + gain * off.0, self.at.1 + gain * off.1);
        self.variance_m2 *= 1.0 - gain;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_fixes_count_alike_and_an_outlier_counts_little() {
        let mut origin = Origin::new((0.0, 0.0), 50.0);
        for i in 0..100 {
            let noise = [0.4, -0.4, 0.3, -0.5, 0.2][i % 5];
            origin.correct((3.0 + noise, -2.0 - noise), 0.5);
        }
        let (x, y) = origin.at();
        assert!((x - 3.0).abs() < 0.02 && (y + 2.0).abs() < 0.02, "{x} {y}");
        origin.correct((13.0, -2.0), 0.5);
        assert!((origin.at().0 - x).abs() < 0.05, "{}", origin.at().0);
    }

    #[test]
    fn a_map_that_drifts_follows_new_fixes() {
        let mut origin = Origin::new((0.0, 0.0), 0.1);
        origin.drift(5.0);
        origin.correct((1.0, 0.0), 0.5);
        assert!(origin.at().0 > 0.95, "{}", origin.at().0);
    }
}
