//! What a vehicle reports beside the pose of the same frame: backlog, disk, faults of its equipment.

use super::{Intent, RegistrationReport, StatusError, Trail};
use crate::bytes::{Reader, Truncated};

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

/// Whether the vehicle's files can be written, and the free space of its disk.
///
/// ```text
/// bits  field                      range
///  1    reserved                   0
///  1    the journal is refused     the vehicle keeps no new order and no new label
///  1    the checkpoint is refused  a restart loses the latest part of the scene model
///  5    free space                 0 unknown, 1 less than 1 MB, n at least 2^(n - 2) MB of 2^20 bytes
/// ```
///
/// Source: vehicle, in the last byte of a report. A vehicle without files has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DiskReport {
    /// Whether the last state was not written to the journal.
    pub journal_refused: bool,
    /// Whether the last checkpoint of the scene model was not written.
    pub checkpoint_refused: bool,
    /// Free space in bytes; `None` if it is unknown. On the wire it is rounded down to a power of two of at least 2^20
    /// bytes, or to 0.
    pub free_bytes: Option<u64>,
}

impl DiskReport {
    const RESERVED: u8 = 0x80;
    const JOURNAL: u8 = 0x40;
    const CHECKPOINT: u8 = 0x20;
    /// The free space, and its largest value.
    const FREE: u8 = 0x1F;

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        let flag = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
        let free = self.free_bytes.map_or(0, |bytes| match (bytes >> 20).checked_ilog2() {
            Some(log) => (log + 2).min(u32::from(Self::FREE)) as u8,
            None => 1,
        });
        out.push(flag(self.journal_refused, Self::JOURNAL) | flag(self.checkpoint_refused, Self::CHECKPOINT) | free);
    }

    /// `None` stands for a reserved bit, which no vehicle sets.
    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let byte = r.u8()?;
        let free_bytes = match byte & Self::FREE {
            0 => None,
            1 => Some(0),
            n => Some(1 << (18 + n)),
        };
        let (journal_refused, checkpoint_refused) = (byte & Self::JOURNAL != 0, byte & Self::CHECKPOINT != 0);
        Ok((byte & Self::RESERVED == 0).then_some(Self { journal_refused, checkpoint_refused, free_bytes }))
    }
}

/// The approximate number of bytes that the vehicle still has to send.
///
/// ```text
/// byte  bits  field                 unit, range
///  0    4     labels of the map     value v
///  0    4                           shift s: v x 2^s bytes, rounded up, at most 491 520
///  1    8     all else              layers and images, in the same way
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Backlog {
    /// Bytes of labels of the map.
    pub map_bytes: u32,
    /// Bytes of layers and images.
    pub other_bytes: u32,
}

impl Backlog {
    /// Length on the wire in bytes.
    pub const BYTES: usize = 2;

    pub(super) fn encode(self) -> [u8; Self::BYTES] {
        [self.map_bytes, self.other_bytes].map(code)
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self { map_bytes: value(r.u8()?), other_bytes: value(r.u8()?) })
    }
}

/// A value of four bits, rounded up, and the number of doublings.
fn code(bytes: u32) -> u8 {
    let shift = (0..16u32).find(|&shift| bytes.div_ceil(1 << shift) < 16);
    shift.map_or(u8::MAX, |shift| (bytes.div_ceil(1 << shift) << 4 | shift) as u8)
}

fn value(code: u8) -> u32 {
    u32::from(code >> 4) << (code & 15)
}

/// The equipment of the vehicle that fails at the time of the pose of the same frame.
///
/// ```text
/// bit  field               1 means
///  0   camera silent       no image comes in: the camera is lost or stalled
///  1   images dropped      an image that could not be used was dropped within the last 10 s
///  2   poses missing       no pose comes in from the navigation source, so the vehicle holds its position
///  3   poses faulty        within the last 10 s, the navigation source gave a pose that could not be used
///  4   autopilot refuses   it answers and does not follow: it is disarmed, in a mode of the pilot's, or has another target
///  5   labels refused      within the last 10 s, an input of labels or bands was refused; or the folder of a source is
///                          missing, or its topic cannot be opened
///  6   images unusable     images come in, and for 10 s or more none of them could be mapped
///  7   depth missing       within the last 10 s, an image had no distances that could be used, where they are configured
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], while there is a fault. The first bit is the highest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EquipmentFaults {
    /// No image comes in: the camera is lost or stalled.
    pub camera_silent: bool,
    /// An image that could not be used was dropped within the last 10 s.
    pub images_dropped: bool,
    /// No pose comes in from the navigation source.
    pub poses_missing: bool,
    /// Within the last 10 s, the navigation source gave a pose that could not be used.
    pub poses_faulty: bool,
    /// The autopilot answers and does not follow the vehicle's waypoints.
    pub autopilot_refuses: bool,
    /// Within the last 10 s, an input of labels or bands was refused; or the folder of a source is missing, or its topic
    /// cannot be opened.
    pub labels_refused: bool,
    /// Images come in, and for 10 s or more none of them could be mapped.
    pub images_unusable: bool,
    /// Within the last 10 s, an image had no distances that could be used, where they are configured.
    pub depth_missing: bool,
}

impl EquipmentFaults {
    /// Bytes on the wire: one bit for each fault.
    pub const BYTES: usize = 1;

    /// Whether there is a fault.
    pub fn is_any(self) -> bool {
        self != Self::default()
    }

    /// The faults for people, the gravest first, and whether the survey does not proceed with it as planned.
    pub fn iter(self) -> impl Iterator<Item = (&'static str, bool)> {
        [
            (self.autopilot_refuses, "the autopilot does not follow", true),
            (self.poses_missing, "no pose comes in", true),
            (self.camera_silent, "no image comes in", true),
            (self.images_unusable, "no image can be used", true),
            (self.poses_faulty, "poses cannot be used", false),
            (self.images_dropped, "images are dropped", false),
            (self.depth_missing, "distances are missing or cannot be used", false),
            (self.labels_refused, "labels or bands of other programs are refused or missing", false),
        ]
        .into_iter()
        .filter_map(|(is_set, text, is_grave)| is_set.then_some((text, is_grave)))
    }

    /// Only the faults with which the survey does not proceed as planned.
    #[must_use]
    pub fn grave(self) -> Self {
        Self { images_dropped: false, poses_faulty: false, labels_refused: false, depth_missing: false, ..self }
    }

    /// The byte on the wire.
    pub fn encode(self) -> [u8; Self::BYTES] {
        let bits = [
            self.camera_silent,
            self.images_dropped,
            self.poses_missing,
            self.poses_faulty,
            self.autopilot_refuses,
            self.labels_refused,
            self.images_unusable,
            self.depth_missing,
        ];
        [bits.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit))]
    }

    /// Reads the byte of the wire.
    pub fn decode(byte: u8) -> Self {
        let bit = |index: u8| byte & 0x80 >> index != 0;
        Self {
            camera_silent: bit(0),
            images_dropped: bit(1),
            poses_missing: bit(2),
            poses_faulty: bit(3),
            autopilot_refuses: bit(4),
            labels_refused: bit(5),
            images_unusable: bit(6),
            depth_missing: bit(7),
        }
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
        assert!(PoseDetails::default().encode().is_empty());
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

    fn coded(disk: DiskReport) -> u8 {
        let mut bytes = Vec::new();
        disk.encode(&mut bytes);
        bytes[0]
    }

    #[test]
    fn golden_bytes_of_a_disk() {
        let disk = |journal_refused, checkpoint_refused, free_bytes| {
            coded(DiskReport { journal_refused, checkpoint_refused, free_bytes })
        };
        assert_eq!(disk(false, false, None), 0);
        assert_eq!(disk(true, false, Some(0)), 0x41);
        assert_eq!(disk(false, true, Some((1 << 20) - 1)), 0x21);
        assert_eq!(disk(true, true, Some(1 << 20)), 0x62);
        assert_eq!(disk(false, false, Some(40_000_000_000)), 0x11);
        assert_eq!(disk(false, false, Some(u64::MAX)), 0x1F);
    }

    #[test]
    fn every_byte_without_the_reserved_bit_is_a_state_of_a_disk() {
        for byte in 0..=255 {
            let read = DiskReport::decode(&mut Reader::new(&[byte])).unwrap();
            assert_eq!(read.map(coded), (byte < 0x80).then_some(byte));
        }
        let space = |byte: u8| DiskReport::decode(&mut Reader::new(&[byte])).unwrap().unwrap().free_bytes;
        assert_eq!([0, 1, 2, 11, 31].map(space), [None, Some(0), Some(1 << 20), Some(512 << 20), Some(1 << 49)]);
    }

    #[test]
    fn golden_bytes_of_a_backlog() {
        let coded = |map_bytes, other_bytes| Backlog { map_bytes, other_bytes }.encode();
        assert_eq!(coded(0, 1), [0x00, 0x10]);
        assert_eq!(coded(15, 16), [0xF0, 0x81]);
        assert_eq!(coded(500, u32::MAX), [0x86, 0xFF]);
    }

    proptest! {
        #[test]
        fn a_backlog_is_rounded_up_by_at_most_an_eighth(bytes in 0u32..=491_520) {
            let back = value(code(bytes));
            prop_assert!(back >= bytes && back - bytes <= bytes / 8, "{bytes} became {back}");
        }
    }

    #[test]
    fn golden_bytes_of_faults() {
        let faults = EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..EquipmentFaults::default() };
        assert_eq!(faults.encode(), [0b1000_1000]);
        assert_eq!(EquipmentFaults::decode(0b1000_1000), faults);
        let minor = EquipmentFaults {
            images_dropped: true,
            poses_faulty: true,
            labels_refused: true,
            depth_missing: true,
            ..faults
        };
        assert_eq!(minor.grave(), faults);
        assert!(
            faults.iter().all(|(_, is_grave)| is_grave) && minor.iter().filter(|(_, is_grave)| !is_grave).count() == 4
        );
        assert!(faults.is_any() && !EquipmentFaults::default().is_any());
    }

    #[test]
    fn each_byte_is_read_back() {
        for byte in 0..=255_u8 {
            let faults = EquipmentFaults::decode(byte);
            assert_eq!((faults.encode(), faults.iter().count() as u32), ([byte], byte.count_ones()));
        }
    }
}
