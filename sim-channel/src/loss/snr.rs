//! Loss from the signal-to-noise ratio at the receiver.

use super::{FrameContext, FrameFate, LinkLoss};
use crate::acoustics::{frame_error_rate, transmission_loss_db, wenz_db, wind_of_sea_state};
use crate::random::RandomStream;
use std::time::Duration;

/// The sonar equation, slow fading and uncorrelated bit errors.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::loss::Snr;
///
/// let modem = Snr { wind_m_s: 12.0, ..Snr::default() };
/// let loss = |range_m| modem.loss_rate(range_m, 64, Duration::from_millis(860));
/// assert!(loss(500.0) < 0.01 && loss(12_000.0) > 0.9);
/// ```
///
/// * Signal: source level - spreading - Thorp absorption + fading.
/// * Noise: Wenz over the band.
/// * Energy per bit: the energy of the airtime divided by the bits of the frame, less `implementation_loss_db`.
/// * Fading: a normal variable in dB with an exponential autocorrelation (lognormal shadowing, as measured by
///   P. Qarabaqi and M. Stojanovic 2013).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Snr {
    /// Source level, dB re 1 uPa at 1 m; 160..=190 for modems.
    pub source_level_db: f64,
    /// Centre frequency, kHz; Thorp's formula holds up to about 50.
    pub frequency_khz: f64,
    /// Bandwidth of the receiver, kHz, greater than 0.
    pub bandwidth_khz: f64,
    /// Spreading exponent, 1 (cylindrical)..=2 (spherical).
    pub spreading: f64,
    /// Wind speed at the surface, m/s; see [`wind_of_sea_state`].
    pub wind_m_s: f64,
    /// Density of shipping, 0 (none)..=1 (heavy).
    pub shipping: f64,
    /// Noise above the ambient level (own ship, thrusters, snapping shrimp), dB.
    pub extra_noise_db: f64,
    /// Loss by multipath and by a real receiver, minus the coding gain, dB.
    pub implementation_loss_db: f64,
    /// Signal-to-noise ratio in the band below which the preamble is not detected, dB.
    pub detection_snr_db: f64,
    /// Standard deviation of the fading, dB; 0 for none.
    pub fading_std_db: f64,
    /// Time after which the autocorrelation of the fading has fallen to 1/e.
    pub fading_coherence: Duration,
}

impl Default for Snr {
    /// An 18-34 kHz modem at moderate level in sea state 2; the values are assumed, in the range of data sheets.
    fn default() -> Self {
        Self {
            source_level_db: 178.0,
            frequency_khz: 26.0,
            bandwidth_khz: 16.0,
            spreading: 1.5,
            wind_m_s: wind_of_sea_state(2),
            shipping: 0.5,
            extra_noise_db: 0.0,
            implementation_loss_db: 6.0,
            detection_snr_db: -5.0,
            fading_std_db: 3.0,
            fading_coherence: Duration::from_secs(10),
        }
    }
}

impl Snr {
    /// Mean signal-to-noise ratio in the receiver's band at `range_m`, dB.
    #[must_use]
    pub fn snr_db(&self, range_m: f64) -> f64 {
        let loss = transmission_loss_db(range_m, self.frequency_khz, self.spreading);
        let density = wenz_db(self.frequency_khz, self.wind_m_s, self.shipping) + self.extra_noise_db;
        self.source_level_db - loss - density - 10.0 * (self.bandwidth_khz * 1000.0).log10()
    }

    /// Probability 0..=1 that a frame of `bytes` over `airtime` is lost at the ratio `snr_db`; 1 if it is not detected.
    #[must_use]
    pub fn frame_loss(&self, snr_db: f64, bytes: usize, airtime: Duration) -> f64 {
        if snr_db < self.detection_snr_db {
            return 1.0;
        }
        let hertz_seconds_per_bit = self.bandwidth_khz * 1000.0 * airtime.as_secs_f64() / (8.0 * bytes.max(1) as f64);
        let eb_n0_db = snr_db + 10.0 * hertz_seconds_per_bit.log10() - self.implementation_loss_db;
        frame_error_rate(eb_n0_db, bytes)
    }

    /// Long-run share of frames lost at `range_m`.
    ///
    /// It is [`frame_loss`](Self::frame_loss) averaged over the fading by the trapezoid rule.
    #[must_use]
    pub fn loss_rate(&self, range_m: f64, bytes: usize, airtime: Duration) -> f64 {
        let mean = self.snr_db(range_m);
        let (mut sum, mut weight) = (0.0, 0.0);
        for step in -600..=600 {
            let z = f64::from(step) / 100.0;
            let density = (-z * z / 2.0).exp();
            sum += density * self.frame_loss(mean + self.fading_std_db * z, bytes, airtime);
            weight += density;
        }
        sum / weight
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(SnrLink { model: *self, fading: None })
    }
}

#[derive(Debug)]
struct SnrLink {
    model: Snr,
    /// Time and value of the last draw, in standard deviations.
    fading: Option<(Duration, f64)>,
}

impl SnrLink {
    /// The next value of an Ornstein-Uhlenbeck process, exact for any step.
    fn fade(&mut self, at: Duration, rng: &mut RandomStream) -> f64 {
        let innovation = rng.normal();
        let value = match self.fading {
            None => innovation,
            Some((then, value)) => {
                let coherence_s = self.model.fading_coherence.as_secs_f64().max(1e-9);
                let kept = (-at.saturating_sub(then).as_secs_f64() / coherence_s).exp();
                kept * value + (1.0 - kept * kept).sqrt() * innovation
            }
        };
        self.fading = Some((at, value));
        value
    }
}

impl LinkLoss for SnrLink {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        let fading_db = self.model.fading_std_db * self.fade(frame.at, rng);
        let snr_db = self.model.snr_db(frame.range_m) + fading_db;
        let lost = rng.bernoulli(self.model.frame_loss(snr_db, frame.bytes, frame.airtime));
        if snr_db < self.model.detection_snr_db { FrameFate::OutOfRange } else { FrameFate::lost_if(lost) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::tests::{losses, share};

    const SPACING: Duration = Duration::from_millis(100);

    #[test]
    fn snr_is_the_sonar_equation() {
        let model = Snr { wind_m_s: 10.0, shipping: 0.5, ..Snr::default() };
        // 178 - (45 + 6.520) - 46.86 (waves at 10 m/s: 50 + 23.717 + 28.299 - 56.864) - 42.041
        let density = wenz_db(26.0, 10.0, 0.5);
        assert!((model.snr_db(1000.0) - (178.0 - 51.520 - density - 42.0412)).abs() < 1e-2);
        assert!((density - 45.2).abs() < 0.2);
    }

    #[test]
    fn without_fading_the_loss_is_the_frame_error() {
        let mut model = Snr { fading_std_db: 0.0, detection_snr_db: -60.0, ..Snr::default() };
        model.extra_noise_db = model.snr_db(1000.0) - 6.0 + 10.0 * (16_000.0 * 0.05 / 512.0f64).log10();
        model.implementation_loss_db = 0.0;
        let expected = frame_error_rate(6.0, 64);
        assert!((model.loss_rate(1000.0, 64, SPACING / 2) - expected).abs() < 1e-6);
        assert!((share(&losses(&model.into(), SPACING, 100_000)) - expected).abs() < 0.01);
    }

    #[test]
    fn with_fading_the_loss_is_its_average() {
        let mut model = Snr { fading_std_db: 4.0, fading_coherence: Duration::from_secs(1), ..Snr::default() };
        model.extra_noise_db = model.snr_db(1000.0) - 10.0;
        let expected = model.loss_rate(1000.0, 64, SPACING / 2);
        assert!((0.05..0.95).contains(&expected), "{expected}");
        assert!((share(&losses(&model.into(), SPACING, 400_000)) - expected).abs() < 0.01);
    }

    #[test]
    fn loss_grows_with_range_and_with_bytes() {
        let model = Snr::default();
        let over_range: Vec<_> =
            (1..12).map(|km| model.loss_rate(1000.0 * f64::from(km), 64, Duration::from_millis(860))).collect();
        assert!(over_range.windows(2).all(|w| w[0] <= w[1] + 1e-9));
        assert!(over_range[0] < 0.01 && over_range[10] > 0.99, "{over_range:?}");
    }

    #[test]
    fn too_faint_is_out_of_range() {
        let model = Snr { fading_std_db: 0.0, ..Snr::default() };
        let mut rng = RandomStream::new(1, &[]);
        let frame = FrameContext { at: Duration::ZERO, airtime: SPACING, bytes: 8, range_m: 50_000.0 };
        assert_eq!(model.instance().draw_fate(&frame, &mut rng), FrameFate::OutOfRange);
    }
}
