//! Sound in water: absorption, spreading, ambient noise, sound speed, and the frame errors at a signal-to-noise ratio.
//!
//! Every function states its source, its units and the range in which it holds.

mod absorption;
mod frame_error;
mod noise;
mod sound_speed;
mod spreading;

pub use absorption::thorp_db_per_km;
pub use frame_error::{bit_error_rate, frame_error_rate};
pub use noise::{wenz_db, wind_of_sea_state};
pub use sound_speed::mackenzie_m_s;
pub use spreading::transmission_loss_db;

/// The sum of the powers of uncorrelated sources; all levels in decibels.
pub(crate) fn sum_db(levels: &[f64]) -> f64 {
    10.0 * levels.iter().map(|level| 10f64.powf(level / 10.0)).sum::<f64>().log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equal_levels_add_three_decibels() {
        assert!((sum_db(&[40.0, 40.0]) - 43.0103).abs() < 1e-4);
    }
}
