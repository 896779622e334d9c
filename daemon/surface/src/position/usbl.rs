//! The conversion of a USBL measurement into a position of the vehicle.

use super::filter::Estimate;
use scenecast_core::BodyOffset;

/// A measurement of the vehicle relative to the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsblSighting {
    pub range_m: f64,
    /// Bearing clockwise, radians: from true north if the head has its own compass, otherwise from the bow.
    pub bearing_rad: f64,
    /// Angle above the horizontal, radians; negative for a target below the head.
    pub elevation_rad: f64,
    /// Expected error of the position, metres. About the range or more: only the range is valid.
    /// Negative: none of it is.
    pub accuracy_m: f64,
    /// Age of the measurement, seconds.
    pub age_s: f64,
}

/// The mounting of the head, and the speed of sound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// Offset of the head from the GPS antenna.
    pub lever: BodyOffset,
    /// Depth of the head, metres.
    pub depth_m: f64,
    /// Whether bearings are relative to the bow.
    pub from_bow: bool,
    /// Rotation of the head against the bow, clockwise, radians.
    pub turn_rad: f64,
    /// The true speed of sound, divided by the one that the head assumes.
    pub sound_ratio: f64,
}

impl Default for Mounting {
    fn default() -> Self {
        Self { lever: BodyOffset::default(), depth_m: 1.0, from_bow: false, turn_rad: 0.0, sound_ratio: 1.0 }
    }
}

/// The reason why a measurement gives no position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum UsblFault {
    /// A number is not finite or out of range.
    Unreadable,
    /// Only the range is valid.
    RangeOnly,
    /// The reported depth contradicts the measurement: it is below the range, or the elevation gives another depth.
    Depth,
    /// The bearing is relative to the bow, and the heading is unknown.
    NoHeading,
}

impl UsblFault {
    pub fn name(self) -> &'static str {
        match self {
            Self::Unreadable => "malformed",
            Self::RangeOnly => "range_only",
            Self::Depth => "depth",
            Self::NoHeading => "no_heading",
        }
    }
}

/// The maximum range of any head, metres.
const MAX_M: f64 = 20_000.0;
/// The ratio of accuracy and range beyond which only the range is valid.
const RANGE_ONLY: f64 = 0.5;
/// Standard deviation of a reported depth, metres.
const DEPTH_SIGMA_M: f64 = 0.5;

/// The offset of the vehicle from the GPS antenna in the plane, with its covariance.
///
/// A known `depth_m` of the vehicle gives a better horizontal range than the elevation, and exposes echoes.
pub fn offset(
    sighting: &UsblSighting,
    mounting: &Mounting,
    heading_rad: Option<f64>,
    depth_m: Option<f64>,
) -> Result<Estimate, UsblFault> {
    let s = sighting;
    let numbers = [s.range_m, s.bearing_rad, s.elevation_rad, s.accuracy_m, s.age_s];
    let is_readable = numbers.iter().all(|n| n.is_finite())
        && (0.0..=MAX_M).contains(&s.range_m)
        && s.bearing_rad.abs() <= 7.0
        && s.elevation_rad.abs() <= std::f64::consts::FRAC_PI_2 + 1e-6
        && s.accuracy_m >= 0.0;
    if !is_readable {
        return Err(UsblFault::Unreadable);
    }
    let range = s.range_m * mounting.sound_ratio;
    let sigma = s.accuracy_m.max(0.05 + 0.001 * range);
    if sigma > RANGE_ONLY * range.max(1.0) {
        return Err(UsblFault::RangeOnly);
    }
    let by_elevation = range * s.elevation_rad.cos();
    let (flat, flat_sigma) = match depth_m.filter(|d| d.is_finite()) {
        None => (by_elevation, sigma),
        // Directly below the head the range has no information on the horizontal position; the elevation has.
        Some(depth) => {
            let known = by_depth(range, depth - mounting.depth_m, s.elevation_rad, sigma)?;
            if known.1 < sigma { known } else { (by_elevation, sigma) }
        }
    };
    let needs_heading = mounting.from_bow || mounting.lever != BodyOffset::default();
    let heading = if needs_heading { heading_rad.ok_or(UsblFault::NoHeading)? } else { 0.0 };
    let base = if mounting.from_bow { heading + mounting.turn_rad } else { mounting.turn_rad };
    let (sin, cos) = (base + s.bearing_rad).sin_cos();
    let (bow_sin, bow_cos) = heading.sin_cos();
    let BodyOffset { forward_m: forward, starboard_m: starboard, .. } = mounting.lever;
    // The error across the line of sight is that of the angle, the one along it that of the range.
    let (along, across) = (flat_sigma.powi(2), sigma.powi(2));
    Ok(Estimate {
        x_m: flat * sin + forward * bow_sin + starboard * bow_cos,
        y_m: flat * cos + forward * bow_cos - starboard * bow_sin,
        cov_m2: [
            along * sin * sin + across * cos * cos,
            (along - across) * sin * cos,
            along * cos * cos + across * sin * sin,
        ],
    })
}

/// The horizontal range and its standard deviation, from the slant range and the depth below the head.
fn by_depth(range: f64, below: f64, elevation: f64, sigma: f64) -> Result<(f64, f64), UsblFault> {
    let told_below = -range * elevation.sin();
    let tolerance = 4.0 * sigma.hypot(DEPTH_SIGMA_M) + 1.0;
    if below > range + tolerance || (told_below - below).abs() > tolerance {
        return Err(UsblFault::Depth);
    }
    let flat = (range * range - below * below).max(0.0).sqrt();
    let range_sigma = 0.1 + 0.001 * range;
    Ok((flat, (range * range_sigma).hypot(below * DEPTH_SIGMA_M) / flat.max(1e-6)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sighting(range_m: f64, bearing_deg: f64, elevation_deg: f64) -> UsblSighting {
        UsblSighting {
            range_m,
            bearing_rad: bearing_deg.to_radians(),
            elevation_rad: elevation_deg.to_radians(),
            accuracy_m: 1.0,
            age_s: 0.5,
        }
    }

    fn near(found: Estimate, x: f64, y: f64) -> bool {
        (found.x_m - x).abs() < 0.01 && (found.y_m - y).abs() < 0.01
    }

    #[test]
    fn bearing_elevation_heading_and_lever_arm_give_the_place() {
        let plain = Mounting::default();
        let found = offset(&sighting(100.0, 90.0, -30.0), &plain, None, None).unwrap();
        assert!(near(found, 86.6, 0.0), "{found:?}");
        let mounted = Mounting { from_bow: true, lever: [2.0, 1.0, 0.0].into(), ..plain };
        assert_eq!(offset(&sighting(100.0, 0.0, 0.0), &mounted, None, None), Err(UsblFault::NoHeading));
        // The bow points east: forward is east, starboard is south.
        let heading = Some(90f64.to_radians());
        let found = offset(&sighting(100.0, 0.0, 0.0), &mounted, heading, None).unwrap();
        assert!(near(found, 102.0, -1.0), "{found:?}");
    }

    #[test]
    fn a_known_depth_gives_the_horizontal_range_and_unmasks_echoes() {
        let plain = Mounting { depth_m: 2.0, ..Mounting::default() };
        let by_elevation = offset(&sighting(50.0, 0.0, -36.0), &plain, None, None).unwrap();
        let by_depth = offset(&sighting(50.0, 0.0, -36.0), &plain, None, Some(32.0)).unwrap();
        assert!((by_depth.y_m - 40.0).abs() < 0.01 && (by_elevation.y_m - 40.0).abs() > 0.3);
        assert!(by_depth.cov_m2[2] < by_elevation.cov_m2[2], "along the line of sight it is known better");
        assert_eq!(offset(&sighting(50.0, 0.0, 36.0), &plain, None, Some(32.0)), Err(UsblFault::Depth), "from above");
        assert_eq!(offset(&sighting(50.0, 0.0, -80.0), &plain, None, Some(90.0)), Err(UsblFault::Depth));
    }

    #[test]
    fn a_measurement_of_the_range_only_gives_no_position() {
        let vague = UsblSighting { accuracy_m: 100.0, ..sighting(100.0, 0.0, 0.0) };
        assert_eq!(offset(&vague, &Mounting::default(), None, None), Err(UsblFault::RangeOnly));
        let invalid = UsblSighting { accuracy_m: -1.0, ..vague };
        assert_eq!(offset(&invalid, &Mounting::default(), None, None), Err(UsblFault::Unreadable));
    }

    proptest! {
        #[test]
        fn any_numbers_give_a_finite_place_or_a_fault(
            numbers: [f64; 5], heading in proptest::option::of(any::<f64>()), depth in proptest::option::of(any::<f64>()),
        ) {
            let [range_m, bearing_rad, elevation_rad, accuracy_m, age_s] = numbers;
            let s = UsblSighting { range_m, bearing_rad, elevation_rad, accuracy_m, age_s };
            let heading = heading.filter(|h| h.is_finite());
            if let Ok(found) = offset(&s, &Mounting::default(), heading, depth) {
                prop_assert!(found.is_finite() && found.sigma_m() > 0.0);
            }
        }
    }
}
