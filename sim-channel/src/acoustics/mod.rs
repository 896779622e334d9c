//! Sound in water: absorption, spreading, ambient noise, and what a signal to noise ratio costs in frames.

pub mod absorption;
pub mod frame_error;
pub mod noise;
pub mod sound_speed;
pub mod spreading;

/// The sum of levels in decibels, as of uncorrelated powers.
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
