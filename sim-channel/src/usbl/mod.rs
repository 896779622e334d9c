//! Ultra-short baseline positioning: a head measures range and direction to a node from its acoustic reply.

use crate::nodes::NodePosition;
use crate::random::RandomStream;
use std::f64::consts::TAU;
use std::time::Duration;

/// The accuracy of a USBL head.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UsblConfig {
    /// Standard deviation of the slant range, m. Default 0.1, of the order of data sheets.
    pub range_std_m: f64,
    /// Standard deviation of bearing and elevation each, rad. Default 0.0175 (1 degree).
    pub angle_std_rad: f64,
    /// Probability 0..=1 that the angles are those of an echo, in any direction. Default 0.02.
    pub outlier_probability: f64,
    /// Probability 0..=1 of a fix with a range but no direction. Default 0.02.
    pub range_only_probability: f64,
    /// Time from the end of the reply to the fix. Default 0.45 s, as between the two times of a logged `USBLLONG`.
    pub latency: Duration,
}

impl Default for UsblConfig {
    fn default() -> Self {
        Self {
            range_std_m: 0.1,
            angle_std_rad: 1f64.to_radians(),
            outlier_probability: 0.02,
            range_only_probability: 0.02,
            latency: Duration::from_millis(450),
        }
    }
}

/// One measurement, in the frame of a head that is level and faces north.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UsblFix {
    /// Arrival of the reply at the head.
    pub measured_at: Duration,
    /// Time at which the head reports the fix.
    pub ready_at: Duration,
    /// Slant range, m; >= 0.
    pub range_m: f64,
    /// Bearing clockwise from north, rad, 0..2 pi.
    pub bearing_rad: f64,
    /// Elevation above the horizontal, rad; negative for a deeper target.
    pub elevation_rad: f64,
    /// Expected error of the position, m; equal to the range if only the range is good.
    pub accuracy_m: f64,
}

impl UsblFix {
    /// East, north and up of the target relative to the head, m.
    #[must_use]
    pub fn east_north_up_m(&self) -> [f64; 3] {
        let flat = self.range_m * self.elevation_rad.cos();
        [flat * self.bearing_rad.sin(), flat * self.bearing_rad.cos(), self.range_m * self.elevation_rad.sin()]
    }
}

/// A USBL head with its own random stream.
///
/// ```
/// use sim_channel::usbl::{UsblConfig, UsblHead};
/// use sim_channel::{Duration, NodePosition};
///
/// let mut head = UsblHead::new(UsblConfig::default(), 42);
/// let (ship, vehicle) = (NodePosition::new(0.0, 0.0, 2.0), NodePosition::new(300.0, 400.0, 52.0));
/// let fix = head.measure(&ship, &vehicle, Duration::from_secs(5));
/// assert!((fix.range_m - ship.range_m(&vehicle)).abs() < 1.0);
/// assert_eq!(fix.ready_at, Duration::from_millis(5450));
/// ```
#[derive(Debug)]
pub struct UsblHead {
    config: UsblConfig,
    rng: RandomStream,
}

impl UsblHead {
    /// A head that draws its errors from `seed`.
    #[must_use]
    pub fn new(config: UsblConfig, seed: u64) -> Self {
        const PURPOSE: u64 = 0x05b1;
        Self { config, rng: RandomStream::new(seed, &[PURPOSE]) }
    }

    /// The fix from a reply of `target` that a head at `head` received at `received_at`.
    ///
    /// Each call takes the same number of draws.
    pub fn measure(&mut self, head: &NodePosition, target: &NodePosition, received_at: Duration) -> UsblFix {
        let config = self.config;
        let [range_noise, bearing_noise, elevation_noise] = [(); 3].map(|()| self.rng.normal());
        let outlier = self.rng.bernoulli(config.outlier_probability);
        let range_only = self.rng.bernoulli(config.range_only_probability);
        let (stray_bearing, stray_elevation) = (self.rng.uniform(), self.rng.uniform());
        let (range, bearing, elevation) = polar(head, target);
        let range_m = (range + config.range_std_m * range_noise).max(0.0);
        let stray = outlier || range_only;
        UsblFix {
            measured_at: received_at,
            ready_at: received_at.saturating_add(config.latency),
            range_m,
            bearing_rad: if stray { stray_bearing * TAU } else { bearing + config.angle_std_rad * bearing_noise }
                .rem_euclid(TAU),
            elevation_rad: if stray {
                (2.0 * stray_elevation - 1.0).asin()
            } else {
                elevation + config.angle_std_rad * elevation_noise
            },
            accuracy_m: if range_only { range_m } else { config.range_std_m + range_m * config.angle_std_rad },
        }
    }
}

/// Time that one two-way exchange occupies the channel: airtime of query and reply, turn-around, two ways of travel.
#[must_use]
pub fn exchange_time(query: Duration, turn_around: Duration, reply: Duration, one_way: Duration) -> Duration {
    query + turn_around + reply + 2 * one_way
}

/// Slant range in m, bearing clockwise from north and elevation above the horizontal in rad.
fn polar(head: &NodePosition, target: &NodePosition) -> (f64, f64, f64) {
    let (east, north, down) = (target.x_m - head.x_m, target.y_m - head.y_m, target.z_m - head.z_m);
    (head.range_m(target), east.atan2(north), (0.0 - down).atan2(east.hypot(north)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: NodePosition = NodePosition::new(10.0, 20.0, 2.0);
    const TARGET: NodePosition = NodePosition::new(310.0, 420.0, 52.0);

    fn clean() -> UsblConfig {
        UsblConfig {
            range_std_m: 0.0,
            angle_std_rad: 0.0,
            outlier_probability: 0.0,
            range_only_probability: 0.0,
            ..Default::default()
        }
    }

    #[test]
    fn without_noise_the_fix_is_the_target() {
        let fix = UsblHead::new(clean(), 1).measure(&HEAD, &TARGET, Duration::from_secs(5));
        assert_eq!((fix.measured_at, fix.ready_at), (Duration::from_secs(5), Duration::from_millis(5450)));
        for (found, true_value) in fix.east_north_up_m().into_iter().zip([300.0, 400.0, -50.0]) {
            assert!((found - true_value).abs() < 1e-9);
        }
    }

    #[test]
    fn noise_has_the_stated_spread() {
        let config = UsblConfig { range_std_m: 0.5, angle_std_rad: 0.02, ..clean() };
        let mut head = UsblHead::new(config, 1);
        let (range, bearing, elevation) = polar(&HEAD, &TARGET);
        let fixes: Vec<_> = (0..20_000).map(|_| head.measure(&HEAD, &TARGET, Duration::ZERO)).collect();
        let spread = |error: &dyn Fn(&UsblFix) -> f64| {
            (fixes.iter().map(|fix| error(fix).powi(2)).sum::<f64>() / fixes.len() as f64).sqrt()
        };
        assert!((spread(&|fix| fix.range_m - range) - 0.5).abs() < 0.01);
        assert!((spread(&|fix| fix.bearing_rad - bearing) - 0.02).abs() < 0.001);
        assert!((spread(&|fix| fix.elevation_rad - elevation) - 0.02).abs() < 0.001);
    }

    #[test]
    fn outliers_come_as_often_as_stated_and_keep_their_range() {
        let mut head = UsblHead::new(UsblConfig { outlier_probability: 0.1, ..clean() }, 1);
        let bearing = polar(&HEAD, &TARGET).1;
        let fixes: Vec<_> = (0..20_000).map(|_| head.measure(&HEAD, &TARGET, Duration::ZERO)).collect();
        let wild = fixes.iter().filter(|fix| (fix.bearing_rad - bearing).abs() > 1e-9).count();
        assert!((wild as f64 / 20_000.0 - 0.1).abs() < 0.01);
        assert!(fixes.iter().all(|fix| (fix.range_m - HEAD.range_m(&TARGET)).abs() < 1e-9));
    }

    #[test]
    fn range_only_fix_has_the_range_as_accuracy() {
        let config = UsblConfig { range_only_probability: 1.0, ..clean() };
        let fix = UsblHead::new(config, 1).measure(&HEAD, &TARGET, Duration::ZERO);
        assert_eq!(fix.accuracy_m, fix.range_m);
    }

    #[test]
    fn exchange_time_adds_both_ways_and_the_turn_around() {
        let ms = Duration::from_millis;
        assert_eq!(exchange_time(ms(182), ms(90), ms(139), ms(667)), ms(1745));
    }
}
