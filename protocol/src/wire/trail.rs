//! What a vehicle reports with a pose: the track before it, how its last camera frames were placed, the purpose of its plan.

use super::StatusError;
use crate::bytes::{BitReader, BitWriter, DecimetreStep, Reader, Truncated, decimetres, width_of};
use crate::coordinates::MapPoint;
use crate::map::MAX_LABEL;

/// A corner of the track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrailCorner {
    /// Whole seconds before the pose.
    pub ago_s: u8,
    /// The place, in the map frame.
    pub place: MapPoint,
}

/// The corners between the last poses, so that the surface knows the track and not only single positions of it.
///
/// ```text
///   4     4     for each corner, the latest first      0 to 7
/// +----+-----+-----------------------------------------+-------
/// | n  | w-1 |  8 bits: age   2w bits: dx, dy          | zeros
/// +----+-----+-----------------------------------------+-------
/// ```
/// * n: 1 to 15 corners.
/// * w: bits of a difference, 1 to 16, two's complement, decimetres, the fewest that hold all.
/// * age: seconds before the pose, 0 to 255, not less than that of the later corner.
/// * dx, dy: from the later corner, the first from the position of the pose; never both 0.
///
/// Source: vehicle, among the [`super::PoseDetails`]. Between two corners the vehicle went straight, within
/// some decimetres.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Trail(Vec<(u8, DecimetreStep)>);

impl Trail {
    /// The most corners in a trail.
    pub const MAX_CORNERS: usize = 15;
    /// The widest difference, bits: 3.2 km.
    const MAX_WIDTH: u32 = 16;

    /// The trail to `position` over corners, the latest first. It ends before a corner that has no room, is one too many or too far
    /// away; `None` if no corner is left.
    pub fn new(position: MapPoint, corners: &[TrailCorner], room: usize) -> Option<Self> {
        let mut later = step_to(position);
        let mut steps = Vec::new();
        for corner in corners {
            let step = step_to(corner.place).since(later);
            if width_of([step]) > Self::MAX_WIDTH {
                break;
            }
            if step != DecimetreStep::default() {
                steps.push((corner.ago_s, step));
                later = later.plus(step);
            }
        }
        steps.truncate(Self::MAX_CORNERS);
        let mut trail = Self(steps);
        while trail.encode().len() > room {
            trail.0.pop();
        }
        (!trail.0.is_empty()).then_some(trail)
    }

    /// The number of corners.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// The bytes on the wire.
    pub fn encode(&self) -> Vec<u8> {
        let mut bits = BitWriter::default();
        if self.0.is_empty() {
            return bits.into_bytes();
        }
        let width = width_of(self.0.iter().map(|&(_, step)| step));
        bits.put(self.0.len() as u64, 4);
        bits.put(u64::from(width - 1), 4);
        for &(ago_s, step) in &self.0 {
            bits.put(u64::from(ago_s), 8);
            step.put(&mut bits, width);
        }
        bits.into_bytes()
    }

    /// Reads a trail, of which each has exactly one encoding; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, StatusError> {
        let &head = r.rest().first().ok_or(StatusError::Length)?;
        let (n, width) = (usize::from(head >> 4), u32::from(head & 15) + 1);
        let bytes = r.take((8 + n * (8 + 2 * width as usize)).div_ceil(8))?;
        let mut bits = BitReader::new(bytes.get(1..).unwrap_or_default());
        let mut corner = || Some((bits.take(8)? as u8, DecimetreStep::take(&mut bits, width)?));
        let corners = (0..n).map(|_| corner()).collect::<Option<Vec<_>>>().ok_or(StatusError::Length)?;
        let is_ordered = corners.is_sorted_by_key(|&(ago_s, _)| ago_s);
        let moves = corners.iter().all(|&(_, step)| step != DecimetreStep::default());
        let read = Self(corners);
        let is_sound = n > 0 && is_ordered && moves && read.encode() == bytes;
        is_sound.then_some(read).ok_or(StatusError::BadField)
    }

    /// The corners of the trail to `position`, the latest first.
    pub fn corners(&self, position: MapPoint) -> Vec<TrailCorner> {
        let mut at = step_to(position);
        let mut corner = |&(ago_s, step): &(u8, DecimetreStep)| {
            at = at.plus(step);
            TrailCorner { ago_s, place: MapPoint { x_m: f64::from(at.x_dm) / 10.0, y_m: f64::from(at.y_dm) / 10.0 } }
        };
        self.0.iter().map(&mut corner).collect()
    }
}

fn step_to(point: MapPoint) -> DecimetreStep {
    DecimetreStep { x_dm: decimetres(point.x_m), y_dm: decimetres(point.y_m) }
}

/// The purpose of the plan that a pose has.
///
/// ```text
/// byte  bits  field   range
///  0    8     kind    0 unseen floor, 1 curiosity, 2 label, 3 destination, 4 weighted area,
///                     5 label that was seen before
///  1    8     number  of the label, 1..254, after kinds 2 and 5; of the area, 1..4, after kind 4
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], while it surveys by an adaptive planner or goes to a destination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intent {
    /// Floor that the camera has not seen yet.
    Unseen,
    /// Cells that the scene model finds unusual.
    Curiosity,
    /// More of a label, where it is seen or expected.
    Label(u8),
    /// Another look at a label, where it was seen before.
    LabelAgain(u8),
    /// The place to which the operator has ordered the vehicle.
    Destination,
    /// The weighted area with this number, from 1.
    Area(u8),
}

impl Intent {
    /// The bytes on the wire.
    pub fn encode(self) -> Vec<u8> {
        match self {
            Self::Unseen => vec![0],
            Self::Curiosity => vec![1],
            Self::Label(label) => vec![2, label],
            Self::Destination => vec![3],
            Self::Area(number) => vec![4, number],
            Self::LabelAgain(label) => vec![5, label],
        }
    }

    /// Reads an intent; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, StatusError> {
        let kind = r.u8()?;
        let mut number = |most: u8| Some(r.u8()?).filter(|n| (1..=most).contains(n)).ok_or(StatusError::BadField);
        match kind {
            0 => Ok(Self::Unseen),
            1 => Ok(Self::Curiosity),
            2 => number(MAX_LABEL).map(Self::Label),
            3 => Ok(Self::Destination),
            4 => number(4).map(Self::Area),
            5 => number(MAX_LABEL).map(Self::LabelAgain),
            _ => Err(StatusError::BadField),
        }
    }
}

/// What places the last camera frame on the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrameTie {
    /// Odometry and compass alone: its image shows no overlap with an earlier one.
    #[default]
    Odometry,
    /// Its overlap with the frame before.
    FrameBefore,
    /// Its overlap with a frame of an earlier track, which closes a loop.
    EarlierTrack,
    /// Odometry and compass alone: the registration of frames is off.
    Off,
}

impl FrameTie {
    const ALL: [Self; 4] = [Self::Odometry, Self::FrameBefore, Self::EarlierTrack, Self::Off];
}

/// How the last camera frames were placed on the map.
///
/// ```text
/// byte  bits  field                        unit, range
///  0    2     tie of the last frame        0 odometry, 1 frame before, 2 earlier track, 3 registration is off
///  0    6     recent frames that images    1/63 of the last 32 frames, rounded down
///             placed
///  1    8     standard deviation of the    2 cm, rounded up; 255 = 5.1 m or more
///             last frame's place against
///             earlier parts of the map
///  2-3  16    frames that closed a loop    65535 = that or more
///             since the mission's start
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], where frames are or were registered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RegistrationReport {
    /// What places the last frame.
    pub tie: FrameTie,
    /// The part of the last 32 frames that images placed, 0..=1.
    pub share: f64,
    /// Standard deviation of the last frame's place against earlier parts of the map, metres, at most 5.1.
    pub sigma_m: f64,
    /// Frames that closed a loop since the mission's start.
    pub closed: u16,
}

/// Metres for each unit of the standard deviation.
const SIGMA_UNIT_M: f64 = 0.02;
/// Units of a whole share.
const WHOLE: f64 = 63.0;

impl RegistrationReport {
    /// Bytes on the wire, of which the last two are the closed loops.
    pub const BYTES: usize = 4;

    /// The bytes on the wire.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let tie = FrameTie::ALL.iter().position(|tie| *tie == self.tie).unwrap_or_default() as u8;
        let share = (self.share * WHOLE + 1e-9).clamp(0.0, WHOLE) as u8;
        let sigma = (self.sigma_m / SIGMA_UNIT_M - 1e-9).ceil().clamp(0.0, 255.0) as u8;
        let [high, low] = self.closed.to_be_bytes();
        [tie << 6 | share, sigma, high, low]
    }

    /// Reads a report; each has exactly one encoding.
    pub fn decode(bytes: [u8; Self::BYTES]) -> Self {
        let [head, sigma, high, low] = bytes;
        Self {
            tie: FrameTie::ALL.get(usize::from(head >> 6)).copied().unwrap_or_default(),
            share: f64::from(head & 63) / WHOLE,
            sigma_m: f64::from(sigma) * SIGMA_UNIT_M,
            closed: u16::from_be_bytes([high, low]),
        }
    }

    /// Reads a report; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self::decode([r.u8()?, r.u8()?, r.u8()?, r.u8()?]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HERE: MapPoint = MapPoint::new(1.0, -2.0);

    fn decode(bytes: &[u8]) -> Result<Trail, StatusError> {
        let mut r = Reader::new(bytes);
        Trail::read(&mut r).and_then(|trail| r.rest().is_empty().then_some(trail).ok_or(StatusError::Length))
    }

    fn corner(ago_s: u8, x_m: f64, y_m: f64) -> TrailCorner {
        TrailCorner { ago_s, place: MapPoint::new(x_m, y_m) }
    }

    #[test]
    fn golden_bytes_of_a_trail() {
        // 0010 0101, then 9, 14, -14 and 12, -30, 0.
        let corners = [corner(9, 2.4, -3.4), corner(12, -0.6, -3.4)];
        let trail = Trail::new(HERE, &corners, 99).unwrap();
        let bytes = [0x25, 0x09, 0x3B, 0x20, 0xC8, 0x80];
        assert_eq!(trail.encode()[..], bytes[..], "{:02X?}", trail.encode());
        assert_eq!(decode(&bytes).unwrap().corners(HERE), corners);
        assert_eq!(Trail::new(HERE, &corners, 5).unwrap().corners(HERE), corners[..1], "room for one");
        assert_eq!(Trail::new(HERE, &corners, 2), None);
        assert_eq!(Trail::new(HERE, &[corner(3, 1.0, -2.0)], 99), None, "the vehicle has not moved");
    }

    #[test]
    fn unusual_encodings_of_a_trail_are_refused() {
        for bytes in [&[][..], &[0x05], &[0x25, 0x09], &[0x25, 0x0C, 0x3B, 0x20, 0x98, 0x80], &[0x12, 0x09, 0x00]] {
            assert!(decode(bytes).is_err(), "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Ok(trail) = decode(&bytes) {
                prop_assert_eq!(trail.encode(), bytes);
                prop_assert!(trail.corners(HERE).len() <= Trail::MAX_CORNERS);
            }
        }

        #[test]
        fn the_latest_corners_that_fit_are_sent(
            steps in proptest::collection::vec((0u8..30, -3000i32..3000, -300i32..300), 0..12), room in 0usize..60,
        ) {
            let (mut at, mut ago_s, mut corners) = (HERE, 0u8, Vec::new());
            for (later, x, y) in steps.into_iter().filter(|&(_, x, y)| (x, y) != (0, 0)) {
                ago_s = ago_s.saturating_add(later);
                at = MapPoint::new(at.x_m + f64::from(x) / 10.0, at.y_m + f64::from(y) / 10.0);
                corners.push(TrailCorner { ago_s, place: at });
            }
            let Some(trail) = Trail::new(HERE, &corners, room) else {
                prop_assert!(corners.is_empty() || room < 8);
                return Ok(());
            };
            let bytes = trail.encode();
            prop_assert!(bytes.len() <= room);
            let read = decode(&bytes).unwrap().corners(HERE);
            for (read, sent) in read.iter().zip(&corners) {
                prop_assert_eq!(read.ago_s, sent.ago_s);
                prop_assert!((read.place.x_m - sent.place.x_m).hypot(read.place.y_m - sent.place.y_m) < 0.01);
            }
        }
    }

    #[test]
    fn golden_bytes_of_an_intent() {
        for (intent, bytes) in [
            (Intent::Unseen, &[0][..]),
            (Intent::Curiosity, &[1]),
            (Intent::Label(1), &[2, 1]),
            (Intent::Label(254), &[2, 254]),
            (Intent::Destination, &[3]),
            (Intent::Area(4), &[4, 4]),
            (Intent::LabelAgain(7), &[5, 7]),
        ] {
            assert_eq!(intent.encode(), bytes);
            let mut r = Reader::new(bytes);
            assert_eq!((Intent::read(&mut r), r.rest()), (Ok(intent), &[][..]));
        }
        for bytes in [&[][..], &[2], &[4], &[5], &[6], &[5, 0], &[5, 255], &[4, 0], &[4, 5], &[2, 0], &[2, 255]] {
            assert!(Intent::read(&mut Reader::new(bytes)).is_err(), "{bytes:?}");
        }
    }

    #[test]
    fn golden_bytes_of_a_registration_report() {
        let report = |tie, share, sigma_m, closed| RegistrationReport { tie, share, sigma_m, closed };
        for (report, bytes) in [
            (RegistrationReport::default(), [0x00, 0, 0, 0]),
            (report(FrameTie::FrameBefore, 1.0, 0.02, 1), [0x7f, 1, 0, 1]),
            (report(FrameTie::EarlierTrack, 21.0 / 63.0, 0.1, 258), [0x95, 5, 1, 2]),
            (report(FrameTie::Off, 0.0, 5.1, u16::MAX), [0xc0, 255, 255, 255]),
        ] {
            assert_eq!(report.encode(), bytes);
            assert_eq!(RegistrationReport::decode(bytes).encode(), bytes);
        }
        let beyond = report(FrameTie::Odometry, 2.0, 80.0, 0);
        assert_eq!(beyond.encode(), [0x3f, 255, 0, 0]);
    }
}
