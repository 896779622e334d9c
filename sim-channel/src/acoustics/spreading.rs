//! Transmission loss over a distance.

use super::absorption::thorp_db_per_km;

/// Transmission loss in dB over `range_m` metres at `frequency_khz`: `exponent` x 10 log10(range) plus Thorp absorption.
///
/// `exponent` is 1 for cylindrical and 2 for spherical spreading; 1.5 is usual in practice. Within a metre the loss is 0.
///
/// Source: R. J. Urick, "Principles of Underwater Sound".
#[must_use]
pub fn transmission_loss_db(range_m: f64, frequency_khz: f64, exponent: f64) -> f64 {
    let range_m = range_m.max(1.0);
    exponent * 10.0 * range_m.log10() + thorp_db_per_km(frequency_khz) * (range_m - 1.0) / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loss_over_a_kilometre_matches_the_formula() {
        assert!((transmission_loss_db(1000.0, 26.0, 2.0) - (60.0 + 6.5266 * 0.999)).abs() < 1e-2);
        assert!((transmission_loss_db(1000.0, 26.0, 1.5) - (45.0 + 6.5266 * 0.999)).abs() < 1e-2);
    }

    #[test]
    fn loss_is_zero_at_zero_range() {
        assert_eq!(transmission_loss_db(0.0, 26.0, 2.0), 0.0);
    }
}
