//! Speed of sound in sea water.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meets_the_check_value_of_the_paper() {
        assert!((mackenzie_m_s(25.0, 35.0, 1000.0) - 1550.744).abs() < 1e-3);
    }
}
