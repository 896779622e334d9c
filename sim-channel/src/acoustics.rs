//! Sound in water: absorption, spreading, ambient noise, sound speed, and the bit and frame errors at a signal-to-noise ratio.
//!
//! Every function states its source, its units and the range in which it holds.

/// The sum of the powers of uncorrelated sources; all levels in decibels.
pub(crate) fn sum_db(levels: &[f64]) -> f64 {
    10.0 * levels.iter().map(|level| 10f64.powf(level / 10.0)).sum::<f64>().log10()
}

/// Absorption in dB/km at `frequency_khz`, valid from a few hundred Hz to about 50 kHz.
///
/// ```
/// assert!((sim_channel::acoustics::thorp_db_per_km(26.0) - 6.53).abs() < 0.01);
/// ```
///
/// Source: W. H. Thorp 1967, in the form of Brekhovskikh and Lysanov, "Fundamentals of Ocean Acoustics"; for 4 degrees
/// Celsius and 35 ppt near the surface.
#[must_use]
pub fn thorp_db_per_km(frequency_khz: f64) -> f64 {
    let f2 = frequency_khz * frequency_khz;
    0.11 * f2 / (1.0 + f2) + 44.0 * f2 / (4100.0 + f2) + 2.75e-4 * f2 + 0.003
}

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

/// Ambient noise level in dB re 1 uPa^2/Hz at `frequency_khz` (0.001..=100).
///
/// `wind_m_s` is the wind speed at the surface, `shipping` 0 (none)..=1 (heavy). Turbulence, shipping, waves and thermal
/// noise add as powers.
///
/// Source: G. M. Wenz 1962, in the empirical form of R. Coates, "Underwater Acoustic Systems", as M.
/// Stojanovic used it in 2007.
#[must_use]
pub fn wenz_db(frequency_khz: f64, wind_m_s: f64, shipping: f64) -> f64 {
    let f = frequency_khz.max(1e-3);
    let turbulence = 17.0 - 30.0 * f.log10();
    let ships = 40.0 + 20.0 * (shipping - 0.5) + 26.0 * f.log10() - 60.0 * (f + 0.03).log10();
    let waves = 50.0 + 7.5 * wind_m_s.max(0.0).sqrt() + 20.0 * f.log10() - 40.0 * (f + 0.4).log10();
    let thermal = -15.0 + 20.0 * f.log10();
    sum_db(&[turbulence, ships, waves, thermal])
}

/// Typical wind speed in m/s at a sea state 0..=6; higher states give the speed of 6.
///
/// Source: middle of the wind ranges in knots given with the noise curves of Wenz and of Knudsen (Urick).
#[must_use]
pub fn wind_of_sea_state(sea_state: u8) -> f64 {
    const KNOTS: [f64; 7] = [0.5, 5.0, 8.5, 13.5, 19.0, 24.5, 37.5];
    const M_S_PER_KNOT: f64 = 0.514_444;
    KNOTS[usize::from(sea_state).min(KNOTS.len() - 1)] * M_S_PER_KNOT
}

/// Speed of sound in sea water, m/s, at `celsius` (2..=30), `salinity` in ppt (25..=40) and `depth_m` (0..=8000).
///
/// Source: K. V. Mackenzie, "Nine-term equation for sound speed in the oceans", 1981. Fresh and freezing water lie
/// outside its range; the error there is a few m/s.
#[must_use]
pub fn mackenzie_m_s(celsius: f64, salinity: f64, depth_m: f64) -> f64 {
    let (t, s, d) = (celsius, salinity - 35.0, depth_m);
    1448.96 + 4.591 * t - 5.304e-2 * t.powi(2) + 2.374e-4 * t.powi(3) + 1.340 * s + 1.630e-2 * d + 1.675e-7 * d.powi(2)
        - 1.025e-2 * t * s
        - 7.139e-13 * t * d.powi(3)
}

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
    fn two_equal_levels_add_three_decibels() {
        assert!((sum_db(&[40.0, 40.0]) - 43.0103).abs() < 1e-4);
    }

    #[test]
    fn absorption_at_26_khz_is_6_5_db_per_km() {
        // The four terms computed by hand: 0.10984 + 6.22781 + 0.18590 + 0.003.
        assert!((thorp_db_per_km(26.0) - 6.5266).abs() < 1e-3);
    }

    #[test]
    fn absorption_at_10_khz_is_1_2_db_per_km() {
        assert!((thorp_db_per_km(10.0) - 1.1870).abs() < 1e-3);
    }

    #[test]
    fn absorption_grows_with_frequency() {
        let all: Vec<_> = (1..50).map(|khz| thorp_db_per_km(f64::from(khz))).collect();
        assert!(all.windows(2).all(|w| w[0] < w[1]));
    }

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

    #[test]
    fn waves_dominate_the_noise_at_26_khz() {
        let waves = 50.0 + 7.5 * 10f64.sqrt() + 20.0 * 26f64.log10() - 40.0 * 26.4f64.log10();
        assert!((wenz_db(26.0, 10.0, 0.5) - waves).abs() < 0.1);
    }

    #[test]
    fn shipping_dominates_the_noise_at_100_hz() {
        let noise = wenz_db(0.1, 0.0, 1.0);
        let ships = 40.0 + 10.0 + 26.0 * 0.1f64.log10() - 60.0 * 0.13f64.log10();
        assert!((noise - ships).abs() < 0.1);
    }

    #[test]
    fn thermal_noise_dominates_a_calm_sea_at_100_khz() {
        assert!((wenz_db(100.0, 0.0, 0.0) - 25.0).abs() < 1.5);
    }

    #[test]
    fn a_rougher_sea_is_louder() {
        let levels: Vec<_> = (0..=6).map(|state| wenz_db(26.0, wind_of_sea_state(state), 0.3)).collect();
        assert!(levels.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(wind_of_sea_state(9), wind_of_sea_state(6));
    }

    #[test]
    fn meets_the_check_value_of_the_paper() {
        assert!((mackenzie_m_s(25.0, 35.0, 1000.0) - 1550.744).abs() < 1e-3);
    }

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
