//! The vehicle's status.

use super::cursor::{Reader, Truncated};
use crate::directive::{RefusalReason, SLOTS, SlotId};

/// What the vehicle is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VehicleMode {
    /// Flying its survey.
    #[default]
    Survey,
    /// Staying where it is.
    Hold,
    /// On its way to the return point.
    Return,
    /// On its way up.
    Surface,
    /// Stopped by an abort.
    Abort,
    /// The survey is over.
    Done,
}

impl VehicleMode {
    const ALL: [Self; 6] = [Self::Survey, Self::Hold, Self::Return, Self::Surface, Self::Abort, Self::Done];

    fn code(self) -> u8 {
        Self::ALL.iter().position(|&m| m == self).unwrap_or_default() as u8
    }
}

/// What became of a slot of the directive at the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlotState {
    /// Never received in this session of the surface.
    #[default]
    Unknown,
    /// In force.
    Applied,
    /// Refused; the vehicle keeps what it had.
    Refused(RefusalReason),
}

/// The latest version of a slot that the vehicle decided about, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SlotReport {
    /// Low 8 bits of the version.
    pub version_low: u8,
    /// The decision.
    pub state: SlotState,
}

/// What the vehicle says of itself.
///
/// ```text
/// byte  bits  field                 unit, range
///  0    3     mode                  0 survey, 1 hold, 2 return, 3 surface, 4 abort, 5 done
///  0    1     a waypoint follows
///  0    4     reserved, 0
///  1-3  24    x east                decimetres, signed, +-838 km
///  4-6  24    y north               decimetres, signed
///  7-8  16    depth                 decimetres below the surface, 0..6553.5 m
///  9    8     heading               1/256 of a turn, clockwise from north
/// 10    8     position sigma        quarter metres, 255 = 63.75 m or more
/// 11    8     age of the last fix   seconds, 254 = that or more, 255 = no fix yet
/// 12    8     label epoch
/// 13    8     labels on the map     0..254
/// 14-16 24    explored cells
/// 17-18 16    digest of the map that the surface is known to hold (the base of this frame)
/// 19-24 48    six slot reports: version, low 8 bits
/// 25-27 24    six slot reports: 4 bits each: 0 unknown, 1 applied, 2..15 refusal reason
/// 28-33 48    [waypoint x, y]       decimetres, signed
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VehicleStatus {
    /// What it is doing.
    pub mode: VehicleMode,
    /// East of the origin, metres.
    pub x_m: f64,
    /// North of the origin, metres.
    pub y_m: f64,
    /// Depth below the surface, metres.
    pub depth_m: f64,
    /// Heading clockwise from north, degrees in 0..360.
    pub heading_deg: f64,
    /// Standard deviation of its position estimate, metres.
    pub sigma_m: f64,
    /// Seconds since the last position fix that it used; `None` if there was none.
    pub fix_age_s: Option<f64>,
    /// Where it is going, metres east and north.
    pub waypoint: Option<(f64, f64)>,
    /// Epoch of its label ids.
    pub epoch: u8,
    /// Labels on its map.
    pub labels: u8,
    /// Explored cells on its map.
    pub explored_cells: u32,
    /// Digest of the map that it knows the surface to hold.
    pub base_digest: u16,
    /// Decisions about the slots of the directive, by slot.
    pub slots: [SlotReport; SLOTS],
}

/// Why bytes are no status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StatusError {
    /// Too short or too long.
    #[error("the status has another length")]
    Length,
    /// A field has a value that no vehicle writes.
    #[error("the status has a field out of range")]
    BadField,
}

impl From<Truncated> for StatusError {
    fn from(_: Truncated) -> Self {
        Self::Length
    }
}

fn decimetres(metres: f64) -> i32 {
    (metres * 10.0).round().clamp(-8_388_608.0, 8_388_607.0) as i32
}

fn put24(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(value.to_be_bytes().get(1..).unwrap_or_default());
}

impl VehicleStatus {
    /// Bytes that a status takes at most.
    pub const MAX_BYTES: usize = 34;

    /// The bytes on the wire; values out of range are clamped to it.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(Self::MAX_BYTES);
        out.push(self.mode.code() << 5 | u8::from(self.waypoint.is_some()) << 4);
        put24(&mut out, decimetres(self.x_m) as u32);
        put24(&mut out, decimetres(self.y_m) as u32);
        out.extend_from_slice(&((self.depth_m * 10.0).round().clamp(0.0, 65_535.0) as u16).to_be_bytes());
        out.push(((self.heading_deg / 360.0 * 256.0).round() as i64 & 255) as u8);
        out.push((self.sigma_m * 4.0).round().clamp(0.0, 255.0) as u8);
        out.push(self.fix_age_s.map_or(255, |age| age.round().clamp(0.0, 254.0) as u8));
        out.extend_from_slice(&[self.epoch, self.labels]);
        put24(&mut out, self.explored_cells.min(0xFF_FFFF));
        out.extend_from_slice(&self.base_digest.to_be_bytes());
        out.extend(self.slots.iter().map(|s| s.version_low));
        out.extend(self.slots.chunks(2).map(|pair| pair.iter().fold(0, |acc, s| acc << 4 | s.state.code())));
        if let Some((x, y)) = self.waypoint {
            put24(&mut out, decimetres(x) as u32);
            put24(&mut out, decimetres(y) as u32);
        }
        out
    }

    /// Reads a status.
    pub fn decode(bytes: &[u8]) -> Result<Self, StatusError> {
        let mut r = Reader::new(bytes);
        let head = r.u8()?;
        let mode = VehicleMode::ALL.get(usize::from(head >> 5)).copied().ok_or(StatusError::BadField)?;
        let metres = |dm: i32| f64::from(dm) / 10.0;
        let mut status = Self { mode, x_m: metres(r.i24()?), y_m: metres(r.i24()?), ..Self::default() };
        status.depth_m = f64::from(r.u16()?) / 10.0;
        status.heading_deg = f64::from(r.u8()?) / 256.0 * 360.0;
        status.sigma_m = f64::from(r.u8()?) / 4.0;
        status.fix_age_s = Some(r.u8()?).filter(|&age| age != 255).map(f64::from);
        status.epoch = r.u8()?;
        status.labels = r.u8()?;
        status.explored_cells = r.u24()?;
        status.base_digest = r.u16()?;
        let versions = r.take(SLOTS)?;
        let states = r.take(SLOTS.div_ceil(2))?.iter().flat_map(|b| [b >> 4, b & 15]);
        for ((slot, &version_low), code) in status.slots.iter_mut().zip(versions).zip(states) {
            *slot = SlotReport { version_low, state: SlotState::from_code(code).ok_or(StatusError::BadField)? };
        }
        if head & 0b1_0000 != 0 {
            status.waypoint = Some((metres(r.i24()?), metres(r.i24()?)));
        }
        if head & 15 != 0 || !r.rest().is_empty() {
            return Err(StatusError::Length);
        }
        Ok(status)
    }

    /// The report about one slot.
    pub fn slot(&self, id: SlotId) -> SlotReport {
        self.slots.get(id.index()).copied().unwrap_or_default()
    }
}

impl SlotState {
    /// The number on the wire: 0 unknown, 1 applied, 2..=15 a reason of refusal.
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Unknown => 0,
            Self::Applied => 1,
            Self::Refused(reason) => reason.code(),
        }
    }

    pub(crate) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Unknown),
            1 => Some(Self::Applied),
            code => RefusalReason::from_code(code).map(Self::Refused),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_a_status() {
        let mut slots = [SlotReport::default(); SLOTS];
        slots[0] = SlotReport { version_low: 7, state: SlotState::Applied };
        slots[5] = SlotReport { version_low: 2, state: SlotState::Refused(RefusalReason::Malformed) };
        let status = VehicleStatus {
            mode: VehicleMode::Hold,
            x_m: 1.5,
            y_m: -0.1,
            depth_m: 18.0,
            heading_deg: 90.0,
            sigma_m: 1.25,
            fix_age_s: Some(8.0),
            waypoint: None,
            epoch: 1,
            labels: 9,
            explored_cells: 4000,
            base_digest: 0xBEEF,
            slots,
        };
        let bytes = status.encode();
        let expected: [u8; 28] = [
            0x20, 0, 0, 15, 0xFF, 0xFF, 0xFF, 0, 180, 64, 5, 8, 1, 9, 0, 0x0F, 0xA0, 0xBE, 0xEF, 7, 0, 0, 0, 0, 2,
            0x10, 0, 0x02,
        ];
        assert_eq!(bytes, expected);
        assert_eq!(VehicleStatus::decode(&bytes), Ok(status));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
            if let Ok(status) = VehicleStatus::decode(&bytes) {
                prop_assert_eq!(status.encode(), bytes);
            }
        }
    }
}
