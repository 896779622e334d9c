//! Ambient noise of the sea.

use super::sum_db;

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
