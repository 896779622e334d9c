//! What a vehicle reports beside the pose of the same frame.

use super::status::StatusError;
use super::{EquipmentFaults, Intent, RegistrationReport, Trail};
use crate::bytes::Reader;

/// Faults, intent, registration and trail of the pose in the same frame, which it precedes. A pose without it has none of them.
///
/// ```text
///  0 1 2 3 4 5 6 7
/// +-+-+-+-+-------+----------+----------+----------------+---------+
/// |F|I|R|T|   0   | [faults] | [intent] | [registration] | [trail] |
/// +-+-+-+-+-------+----------+----------+----------------+---------+
/// ```
/// * F, I, R, T: whether each follows, at least one; see [`EquipmentFaults`], [`Intent`], [`RegistrationReport`], [`Trail`].
/// * The other four bits are of later versions, whose parts come last and are skipped.
///
/// Source: vehicle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseDetails {
    /// The faults of the equipment.
    pub faults: EquipmentFaults,
    /// The purpose of the plan.
    pub intent: Option<Intent>,
    /// How the last camera frames were placed on the map.
    pub registration: Option<RegistrationReport>,
    /// The corners of the track before the pose.
    pub trail: Option<Trail>,
}

impl PoseDetails {
    /// Bytes on the wire of faults alone.
    pub(crate) const FAULTS_ALONE: usize = 1 + EquipmentFaults::BYTES;
    const FAULTS: u8 = 0x80;
    const INTENT: u8 = 0x40;
    const REGISTRATION: u8 = 0x20;
    const TRAIL: u8 = 0x10;
    const LATER: u8 = 0x0F;

    /// The bytes on the wire; none if there are no details.
    pub fn encode(&self) -> Vec<u8> {
        let faults = self.faults.is_any().then(|| self.faults.encode().to_vec());
        let intent = self.intent.map(Intent::encode);
        let registration = self.registration.map(|report| report.encode().to_vec());
        let trail = self.trail.as_ref().map(Trail::encode);
        let parts =
            [(Self::FAULTS, faults), (Self::INTENT, intent), (Self::REGISTRATION, registration), (Self::TRAIL, trail)];
        let parts: Vec<(u8, Vec<u8>)> = parts.into_iter().filter_map(|(bit, part)| Some((bit, part?))).collect();
        let head = (!parts.is_empty()).then(|| parts.iter().fold(0, |head, (bit, _)| head | bit));
        head.into_iter().chain(parts.into_iter().flat_map(|(_, bytes)| bytes)).collect()
    }

    /// Reads details; bytes after the known parts are skipped if a bit of a later version is set.
    pub fn decode(bytes: &[u8]) -> Result<Self, StatusError> {
        let mut r = Reader::new(bytes);
        let head = r.u8()?;
        let has = |bit| head & bit != 0;
        let mut read = Self::default();
        if has(Self::FAULTS) {
            read.faults = EquipmentFaults::decode(r.u8()?);
            if !read.faults.is_any() {
                return Err(StatusError::BadField);
            }
        }
        if has(Self::INTENT) {
            read.intent = Some(Intent::read(&mut r)?);
        }
        if has(Self::REGISTRATION) {
            read.registration = Some(RegistrationReport::read(&mut r)?);
        }
        if has(Self::TRAIL) {
            read.trail = Some(Trail::read(&mut r)?);
        }
        let is_whole = has(Self::LATER) || r.rest().is_empty();
        if head != 0 && is_whole { Ok(read) } else { Err(StatusError::Length) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::MapPoint;
    use crate::wire::{FrameTie, TrailCorner};
    use proptest::prelude::*;

    fn everything() -> PoseDetails {
        let corner = |ago_s, x_m, y_m| TrailCorner { ago_s, place: MapPoint::new(x_m, y_m) };
        let tie = FrameTie::EarlierTrack;
        PoseDetails {
            faults: EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..EquipmentFaults::default() },
            intent: Some(Intent::Label(5)),
            registration: Some(RegistrationReport { tie, share: 21.0 / 63.0, sigma_m: 0.1, closed: 258 }),
            trail: Trail::new(MapPoint::new(1.0, -2.0), &[corner(9, 2.4, -3.4), corner(12, -0.6, -3.4)], 99),
        }
    }

    #[test]
    fn golden_bytes_of_details() {
        let all = everything();
        let bytes = [0xF0, 0x88, 2, 5, 0x95, 5, 1, 2, 0x25, 0x09, 0x3B, 0x20, 0xC8, 0x80];
        assert_eq!(all.encode()[..], bytes[..], "{:02X?}", all.encode());
        assert_eq!(PoseDetails::decode(&bytes).unwrap().encode(), bytes);
        let faults = PoseDetails { faults: all.faults, ..PoseDetails::default() };
        assert_eq!(faults.encode(), [0x80, 0x88]);
        assert_eq!(PoseDetails { intent: Some(Intent::Destination), ..PoseDetails::default() }.encode(), [0x40, 3]);
        assert_eq!(PoseDetails::decode(&[0x81, 0x88, 7, 7]), Ok(faults), "a part of a later version is skipped");
        assert_eq!(PoseDetails::default().encode(), []);
        for bytes in
            [&[][..], &[0], &[0, 1], &[0x80], &[0x80, 0], &[0x80, 0x88, 0], &[0x40, 6], &[0x20, 0, 0, 0], &[0x10, 5]]
        {
            assert!(PoseDetails::decode(bytes).is_err(), "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_details_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
            if let Ok(details) = PoseDetails::decode(&bytes) {
                prop_assert!(bytes[0] & 0x0F != 0 || details.encode() == bytes);
            }
        }
    }
}
