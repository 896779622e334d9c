//! Bit and frame errors as a function of the signal-to-noise ratio.

/// Bit error rate of coherent QPSK or BPSK at `eb_n0_db`: erfc(sqrt(Eb/N0)) / 2.
///
/// Source: J. G. Proakis, "Digital Communications".
#[must_use]
pub fn bit_error_rate(eb_n0_db: f64) -> f64 {
    erfc(10f64.powf(eb_n0_db / 10.0).sqrt()) / 2.0
}

/// Probability 0..=1 that at least one bit of `bytes` bytes is wrong at `eb_n0_db`, with independent bit errors.
#[must_use]
pub fn frame_error_rate(eb_n0_db: f64, bytes: usize) -> f64 {
    let bits = 8.0 * bytes as f64;
    -(bits * (-bit_error_rate(eb_n0_db)).ln_1p()).exp_m1()
}

/// The complementary error function for x >= 0, relative error below 1.2e-7.
///
/// Source: the Chebyshev fit of Press et al., "Numerical Recipes", `erfcc`.
fn erfc(x: f64) -> f64 {
    const FIT: [f64; 10] = [
        -1.26551223,
        1.00002368,
        0.37409196,
        0.09678418,
        -0.18628806,
        0.27886807,
        -1.13520398,
        1.48851587,
        -0.82215223,
        0.17087277,
    ];
    let t = 1.0 / (1.0 + 0.5 * x);
    let polynomial = FIT.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient);
    t * (-x * x + polynomial).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bit_errors_match_the_textbook() {
        // Values of the classical BPSK curve.
        assert!((bit_error_rate(0.0) / 0.078_650 - 1.0).abs() < 1e-4);
        assert!((bit_error_rate(6.0) / 2.388e-3 - 1.0).abs() < 1e-3);
        assert!((bit_error_rate(9.6) / 9.7e-6 - 1.0).abs() < 2e-2);
    }

    #[test]
    fn frame_errors_follow_from_bit_errors() {
        let ber = bit_error_rate(6.0);
        assert!((frame_error_rate(6.0, 64) - (1.0 - (1.0 - ber).powi(512))).abs() < 1e-12);
        assert_eq!(frame_error_rate(6.0, 0), 0.0);
        assert!(frame_error_rate(-20.0, 1000) > 0.999_999);
        assert!(frame_error_rate(20.0, 1000) < 1e-12);
    }
}
