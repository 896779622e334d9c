//! Absorption of sound in sea water.

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
