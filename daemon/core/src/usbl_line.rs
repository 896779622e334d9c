//! A position as an ultra-short baseline (USBL) head reports it.

/// Address of a modem in the water, as its make counts them.
pub type ModemAddress = u8;

/// The position of another modem as a USBL head measured it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsblLine {
    pub remote: ModemAddress,
    pub range_m: Option<f64>,
    /// Clockwise from north, rad, -pi..=pi, and above the horizontal, rad; `None` if only the range is good.
    pub direction_rad: Option<(f64, f64)>,
    /// Expected error of the position, metres; of directions alone, rad.
    pub accuracy: f64,
    /// How long ago it was measured, seconds.
    pub age_s: f64,
}
