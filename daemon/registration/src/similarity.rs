//! Similarities of the plane: turn, scale and shift.

use nalgebra::Vector2;

/// Maps a point by a turn and a scale about the origin, and then by a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similarity {
    /// Cosine and sine of the turn, each times the scale.
    turned: Vector2<f64>,
    shift: Vector2<f64>,
}

impl Similarity {
    /// A turn against the clock in radians, a scale and a shift.
    pub(crate) fn new(turn_rad: f64, scale: f64, shift: Vector2<f64>) -> Self {
        let (sin, cos) = turn_rad.sin_cos();
        Self { turned: Vector2::new(scale * cos, scale * sin), shift }
    }

    pub(crate) fn turn_rad(&self) -> f64 {
        self.turned.y.atan2(self.turned.x)
    }

    pub(crate) fn scale(&self) -> f64 {
        self.turned.norm()
    }

    pub(crate) fn shift(&self) -> Vector2<f64> {
        self.shift
    }

    /// Cosine and sine of the turn, each times the scale.
    pub(crate) fn turned(&self) -> Vector2<f64> {
        self.turned
    }

    pub(crate) fn apply(&self, at: Vector2<f64>) -> Vector2<f64> {
        turn_by(self.turned, at) + self.shift
    }

    pub(crate) fn inverse(&self) -> Self {
        let square = self.turned.norm_squared();
        let turned = Vector2::new(self.turned.x, -self.turned.y) / square;
        Self { turned, shift: -turn_by(turned, self.shift) }
    }

    /// The similarity that applies `first`, then this one.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self { turned: turn_by(self.turned, first.turned), shift: self.apply(first.shift) }
    }

    /// The shift that maps `from` to `to`, with the turn and scale as they are.
    pub(crate) fn through(&self, from: Vector2<f64>, to: Vector2<f64>) -> Self {
        Self { turned: self.turned, shift: to - turn_by(self.turned, from) }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.turned.iter().chain(&self.shift).all(|value| value.is_finite())
    }
}

/// The product of two complex numbers.
fn turn_by(turned: Vector2<f64>, at: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(turned.x * at.x - turned.y * at.y, turned.y * at.x + turned.x * at.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_similarity_and_its_inverse_cancel(
            turn in -3.0..3.0f64, scale in 0.5..2.0f64, x in -9.0..9.0f64, y in -9.0..9.0f64,
        ) {
            let forth = Similarity::new(turn, scale, Vector2::new(x, y));
            let at = Vector2::new(y, 2.0 - x);
            prop_assert!((forth.inverse().apply(forth.apply(at)) - at).norm() < 1e-9);
            prop_assert!((forth.after(&forth.inverse()).apply(at) - at).norm() < 1e-9);
            prop_assert!((forth.turn_rad() - turn).abs() < 1e-9 && (forth.scale() - scale).abs() < 1e-9);
            prop_assert!((forth.through(at, Vector2::zeros()).apply(at)).norm() < 1e-9);
        }
    }
}
