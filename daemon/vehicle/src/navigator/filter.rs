//! The Kalman filter of the vehicle's position and of the errors of its sensors.

use super::odometer::Displacement;

/// Size of the state: position (2, metres), scale error of the log (1), compass error (1, radians), and the drift that
/// does not depend on the direction, such as a current (2, metres for each metre of path).
const N: usize = 6;
type Vector = [f64; N];

/// An extended Kalman filter. The path length is its clock, because a vehicle that stands does not drift.
#[derive(Debug)]
pub(super) struct Filter {
    state: Vector,
    p: [Vector; N],
    drift: f64,
}

/// The expected position at the time of a fix, and the uncertainty of its difference from the fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// East and north in the world frame, metres.
    pub(super) at: (f64, f64),
    /// Covariance of the difference, square metres: xx, xy, yy.
    cov_m2: [f64; 3],
}

impl Expected {
    /// The squared Mahalanobis distance of a difference.
    pub(super) fn distance2(&self, (dx, dy): (f64, f64)) -> f64 {
        let [xx, xy, yy] = self.cov_m2;
        (dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx) / (xx * yy - xy * xy).max(1e-12)
    }
}

impl Filter {
    /// The length of path in metres after which the sensors' errors may have changed completely.
    const MEMORY_M: f64 = 500.0;
    /// The random part of the drift: its standard deviation after a metre, divided by the drift.
    const RANDOM: f64 = 0.5;

    /// Starts at a position without uncertainty. `drift` is the expected error in metres for each metre of path.
    pub(super) fn new((x_m, y_m): (f64, f64), drift: f64) -> Self {
        let mut p = [[0.0; N]; N];
        for (i, row) in p.iter_mut().enumerate().skip(2) {
            row[i] = drift * drift;
        }
        Self { state: [x_m, y_m, 0.0, 0.0, 0.0, 0.0], p, drift }
    }

    /// The expected error in metres for each metre of path.
    pub(super) fn drift(&self) -> f64 {
        self.drift
    }

    pub(super) fn position(&self) -> (f64, f64) {
        (self.state[0], self.state[1])
    }

    pub(super) fn sigma_m(&self) -> f64 {
        ((self.p[0][0] + self.p[1][1]) / 2.0).max(0.0).sqrt()
    }

    /// Adds an independent standard deviation to the position.
    pub(super) fn add_uncertainty(&mut self, sigma_m: f64) {
        self.p[0][0] += sigma_m * sigma_m;
        self.p[1][1] += sigma_m * sigma_m;
    }

    /// The position is known to have changed by this vector.
    pub(super) fn shift(&mut self, dx_m: f64, dy_m: f64) {
        self.state[0] += dx_m;
        self.state[1] += dy_m;
    }

    /// A measured displacement, corrected by the estimated errors of the sensors.
    fn corrected(&self, path: &Displacement) -> (f64, f64) {
        let [_, _, scale, turn, cx, cy] = self.state;
        let (sin, cos) = turn.sin_cos();
        let (dx, dy) = (path.dx_m * (1.0 + scale), path.dy_m * (1.0 + scale));
        (dx * cos - dy * sin + cx * path.length_m, dx * sin + dy * cos + cy * path.length_m)
    }

    /// The derivatives of the corrected displacement with respect to the last four numbers of the state: of x and of y.
    fn slopes(path: &Displacement) -> [[f64; 4]; 2] {
        // Evaluated at zero correction. The corrections are a few percent, so these derivatives are right to a few
        // percent.
        [[path.dx_m, -path.dy_m, path.length_m, 0.0], [path.dy_m, path.dx_m, 0.0, path.length_m]]
    }

    /// Takes a measured displacement and returns it corrected.
    pub(super) fn handle_travel(&mut self, dx_m: f64, dy_m: f64) -> (f64, f64) {
        let path = Displacement { dx_m, dy_m, length_m: dx_m.hypot(dy_m) };
        let (x, y) = self.corrected(&path);
        self.shift(x, y);
        // P = F P F' + Q, where F is the identity with the slopes in its upper right.
        let slopes = Self::slopes(&path);
        for (row, slope) in slopes.iter().enumerate() {
            for column in 0..N {
                self.p[row][column] += (0..4).map(|k| slope[k] * self.p[k + 2][column]).sum::<f64>();
            }
        }
        for (column, slope) in slopes.iter().enumerate() {
            for row in 0..N {
                self.p[row][column] += (0..4).map(|k| slope[k] * self.p[row][k + 2]).sum::<f64>();
            }
        }
        let per_metre = self.drift * self.drift * path.length_m;
        for i in 0..2 {
            self.p[i][i] += Self::RANDOM * Self::RANDOM * per_metre;
        }
        for i in 2..N {
            let goal = self.drift * self.drift;
            // The variance never grows beyond the one at the start.
            self.p[i][i] = (self.p[i][i] + 2.0 * per_metre / Self::MEMORY_M).min(goal.max(self.p[i][i]));
        }
        (x, y)
    }

    /// The rows of the measurement matrix of a fix: for x and for y.
    fn measures(since: &Displacement) -> [Vector; 2] {
        let [x, y] = Self::slopes(since);
        [[1.0, 0.0, -x[0], -x[1], -x[2], -x[3]], [0.0, 1.0, -y[0], -y[1], -y[2], -y[3]]]
    }

    fn times(&self, h: &Vector) -> Vector {
        std::array::from_fn(|row| (0..N).map(|k| self.p[row][k] * h[k]).sum())
    }

    /// The position before the displacement `since`, and the uncertainty against a fix of `sigma` metres.
    pub(super) fn expect(&self, since: &Displacement, sigma: f64) -> Expected {
        let (back_x, back_y) = self.corrected(since);
        let [hx, hy] = Self::measures(since);
        let dot = |a: &Vector, b: &Vector| (0..N).map(|k| a[k] * b[k]).sum::<f64>();
        let (px, py) = (self.times(&hx), self.times(&hy));
        let noise = sigma * sigma + self.noise_since(since);
        let cov_m2 = [dot(&hx, &px) + noise, dot(&hx, &py), dot(&hy, &py) + noise];
        Expected { at: (self.state[0] - back_x, self.state[1] - back_y), cov_m2 }
    }

    /// The random drift since a fix was taken counts as noise of the fix.
    fn noise_since(&self, since: &Displacement) -> f64 {
        (Self::RANDOM * self.drift).powi(2) * since.length_m
    }

    /// Takes a fix of the position before the displacement `since`.
    pub(super) fn correct(&mut self, since: &Displacement, fix: (f64, f64), sigma: f64) {
        let noise = sigma * sigma + self.noise_since(since);
        let measures = Self::measures(since);
        for (axis, h) in measures.iter().enumerate() {
            let at = self.expect(since, sigma).at;
            let off = if axis == 0 { fix.0 - at.0 } else { fix.1 - at.1 };
            let ph = self.times(h);
            let s = (0..N).map(|k| h[k] * ph[k]).sum::<f64>() + noise;
            for row in 0..N {
                self.state[row] += ph[row] / s * off;
                for column in 0..N {
                    self.p[row][column] -= ph[row] * ph[column] / s;
                }
            }
        }
        // Rounding must neither make a variance negative nor the covariance asymmetric.
        for row in 0..N {
            self.p[row][row] = self.p[row][row].max(0.0);
            for column in 0..row {
                let mean = (self.p[row][column] + self.p[column][row]) / 2.0;
                (self.p[row][column], self.p[column][row]) = (mean, mean);
            }
        }
    }
}
