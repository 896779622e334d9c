//! Distortion models of ROS 2 (`sensor_msgs/distortion_models.hpp`, REP 104), by the formulas of OpenCV's calib3d.

/// The distortion of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Lens {
    None,
    /// k1, k2, p1, p2, k3, k4, k5, k6 of Brown's model with a rational factor; those of plumb_bob end at k3.
    Rational([f64; 8]),
    /// k1 to k4 of an equidistant lens (Kannala and Brandt 2006).
    Fisheye([f64; 4]),
}

/// A distortion that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LensError {
    #[error(
        "the distortion model {0:?} is not supported; allowed are plumb_bob, rational_polynomial, equidistant and fisheye"
    )]
    Model(String),
    #[error("{model} has {count} distortion coefficients; expected {expected}")]
    Count { model: String, count: usize, expected: &'static str },
    #[error("a distortion coefficient is not a finite number")]
    NotFinite,
}

/// The largest coefficient that is taken for one.
const MAX: f64 = 1e6;

impl Lens {
    pub(crate) fn new(model: &str, d: &[f64]) -> Result<Self, LensError> {
        if !d.iter().all(|number| number.abs() <= MAX) {
            return Err(LensError::NotFinite);
        }
        if d.iter().all(|&number| number == 0.0) && (d.is_empty() || model.is_empty()) {
            return Ok(Self::None);
        }
        let is_straight = d.iter().all(|&number| number == 0.0);
        let rational = || {
            let mut coefficients = [0.0; 8];
            coefficients.iter_mut().zip(d).for_each(|(to, from)| *to = *from);
            if is_straight { Self::None } else { Self::Rational(coefficients) }
        };
        let wrong = |expected| LensError::Count { model: model.to_owned(), count: d.len(), expected };
        match (model, d.len()) {
            ("plumb_bob", 4 | 5) | ("rational_polynomial", 8) => Ok(rational()),
            // OpenCV may add coefficients of thin prisms and a tilted sensor, which are 0.
            ("rational_polynomial", 12 | 14) if d[8..].iter().all(|&number| number == 0.0) => Ok(rational()),
            ("equidistant" | "fisheye", 4) => Ok(Self::Fisheye([d[0], d[1], d[2], d[3]])),
            ("plumb_bob", _) => Err(wrong("5")),
            ("rational_polynomial", _) => Err(wrong("8, or zeros behind them")),
            ("equidistant" | "fisheye", _) => Err(wrong("4")),
            _ => Err(LensError::Model(model.chars().take(40).collect())),
        }
    }

    /// The distorted place of a point at a distance of 1 along the optical axis.
    pub(crate) fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        match self {
            Self::None => (x, y),
            Self::Rational([k1, k2, p1, p2, k3, k4, k5, k6]) => {
                let factor = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
                (
                    x * factor + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                    y * factor + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
                )
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let r = r2.sqrt();
                let angle = r.atan();
                let a2 = angle * angle;
                let bent = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
                let factor = if r > 0.0 { bent / r } else { 1.0 };
                (x * factor, y * factor)
            }
        }
    }
}
