//! Least squares over many unknowns of which each equation has few.

/// The normal equations of a problem: a symmetric, positive definite matrix by its diagonal and its entries above it, and
/// the right side.
pub(crate) struct NormalEquations {
    diagonal: Vec<f64>,
    above: Vec<(u32, u32, f64)>,
    right: Vec<f64>,
}

impl NormalEquations {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { diagonal: vec![0.0; unknowns], above: Vec::new(), right: vec![0.0; unknowns] }
    }

    /// Adds to the entry of two unknowns, on both sides of the diagonal.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        if i == j {
            self.diagonal[i] += value;
        } else {
            self.above.push((i as u32, j as u32, value));
        }
    }

    pub(crate) fn add_right(&mut self, i: usize, value: f64) {
        self.right[i] += value;
    }

    /// A measurement of an unknown with a weight.
    pub(crate) fn measure(&mut self, i: usize, value: f64, weight: f64) {
        self.add(i, i, weight);
        self.add_right(i, weight * value);
    }

    /// A measurement of the difference of two unknowns, `i` less `j`, with a weight.
    pub(crate) fn measure_difference(&mut self, i: usize, j: usize, value: f64, weight: f64) {
        self.measure(i, value, weight);
        self.measure(j, -value, weight);
        self.add(i, j, -weight);
    }

    fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = self.diagonal.iter().zip(x).map(|(d, x)| d * x).collect();
        for &(i, j, value) in &self.above {
            let (i, j) = (i as usize, j as usize);
            y[i] += value * x[j];
            y[j] += value * x[i];
        }
        y
    }

    /// Solves by conjugate gradients from `start` on, preconditioned by the diagonal (Shewchuk, "An Introduction to the
    /// Conjugate Gradient Method Without the Agonizing Pain", 1994, B3).
    pub(crate) fn solve(&self, start: &[f64]) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let preconditioned =
            |r: &[f64]| r.iter().zip(&self.diagonal).map(|(r, d)| r / d.max(1e-300)).collect::<Vec<f64>>();
        let mut x = start.to_vec();
        let mut residual: Vec<f64> = self.right.iter().zip(self.product(&x)).map(|(b, ax)| b - ax).collect();
        let mut direction = preconditioned(&residual);
        let mut left = dot(&residual, &direction);
        let enough = 1e-18 * dot(&self.right, &preconditioned(&self.right)).max(1e-300);
        for _ in 0..MAX_STEPS.min(20 * x.len() + 20) {
            if left <= enough {
                break;
            }
            let product = self.product(&direction);
            let step = left / dot(&direction, &product).max(1e-300);
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
            residual.iter_mut().zip(&product).for_each(|(r, p)| *r -= step * p);
            let next = preconditioned(&residual);
            let now = dot(&residual, &next);
            direction.iter_mut().zip(&next).for_each(|(d, n)| *d = n + now / left * *d);
            left = now;
        }
        x
    }
}

/// Limit of the steps of one solution.
const MAX_STEPS: usize = 20_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_with_a_loop_shares_its_error() {
        // Nine steps of 1, and a loop that says that the tenth unknown is the first one plus 8.1.
        let mut equations = NormalEquations::new(10);
        equations.measure(0, 5.0, 1.0);
        (1..10).for_each(|i| equations.measure_difference(i, i - 1, 1.0, 1.0));
        equations.measure_difference(9, 0, 8.1, 1.0);
        let x = equations.solve(&[0.0; 10]);
        assert!((x[0] - 5.0).abs() < 1e-6, "{x:?}");
        (1..10).for_each(|i| assert!((x[i] - x[i - 1] - 0.91).abs() < 1e-6, "{x:?}"));
    }
}
