//! A position fix.

use crate::bytes::{Reader, Truncated, decimetres, put24};
use crate::coordinates::WorldPoint;

/// A measured position of the vehicle in the world frame, from GPS and USBL at the surface.
///
/// ```text
/// byte  field
///  0-2  x east, decimetres, signed
///  3-5  y north, decimetres, signed
///  6    standard deviation, quarter metres, 255 = 63.75 m or more
///  7-8  age when this frame left the surface, hundredths of a second, 65535 = 655 s or more
/// ```
///
/// The age is written at the moment of transmission, so the clocks of the two ends need not agree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fix {
    /// The measured position, in steps of a decimetre.
    pub position: WorldPoint,
    /// Standard deviation in metres, in steps of 0.25 m.
    pub sigma_m: f64,
    /// Age at transmission in seconds.
    pub age_s: f64,
}

impl Fix {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        put24(out, decimetres(self.position.east_m) as u32);
        put24(out, decimetres(self.position.north_m) as u32);
        out.push((self.sigma_m * 4.0).round().clamp(0.0, 255.0) as u8);
        out.extend_from_slice(&((self.age_s * 100.0).round().clamp(0.0, 65_535.0) as u16).to_be_bytes());
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self {
            position: WorldPoint { east_m: f64::from(r.i24()?) / 10.0, north_m: f64::from(r.i24()?) / 10.0 },
            sigma_m: f64::from(r.u8()?) / 4.0,
            age_s: f64::from(r.u16()?) / 100.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fix_takes_nine_bytes_and_comes_back() {
        let fix = Fix { position: WorldPoint::new(-12.3, 400.0), sigma_m: 1.5, age_s: 0.82 };
        let mut bytes = Vec::new();
        fix.encode(&mut bytes);
        assert_eq!(bytes, [0xFF, 0xFF, 0x85, 0, 0x0F, 0xA0, 6, 0, 82]);
        assert_eq!(Fix::decode(&mut Reader::new(&bytes)), Ok(fix));
    }
}
