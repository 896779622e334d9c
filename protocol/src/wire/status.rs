//! The vehicle's status.

use super::StatusError;
use super::details::{Backlog, DiskReport, EquipmentFaults};
use super::path::{Placement, PlannedPath};
use super::trail::{Intent, RegistrationReport, TrailCorner};
use crate::bytes::{Reader, Truncated, decimetres, put24};
use crate::coordinates::MapPoint;
use crate::directive::{InForceSummary, SLOTS, SlotId, SlotReport, SlotState};

/// The activity of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VehicleMode {
    /// The survey is in progress.
    #[default]
    Survey,
    /// The vehicle stays at its position.
    Hold,
    /// The vehicle is on its return path.
    Return,
    /// The vehicle rises to the water surface.
    Surface,
    /// An abort has stopped the vehicle.
    Abort,
    /// The survey is complete, and the vehicle stays.
    Done,
}

impl VehicleMode {
    const ALL: [Self; 6] = [Self::Survey, Self::Hold, Self::Return, Self::Surface, Self::Abort, Self::Done];

    /// The mode as a word for people, such as "surveying".
    pub fn name(self) -> &'static str {
        match self {
            Self::Survey => "surveying",
            Self::Hold => "holding",
            Self::Return => "returning",
            Self::Surface => "surfacing",
            Self::Abort => "aborted",
            Self::Done => "done",
        }
    }

    /// The mode with this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }

    fn code(self) -> u8 {
        Self::ALL.iter().position(|&m| m == self).unwrap_or_default() as u8
    }
}

/// The reason for the vehicle's mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ModeReason {
    /// The survey's plan; there is no fault. A vehicle that holds for this reason has arrived at the end of its plan.
    #[default]
    Survey,
    /// An order of the operator.
    Order,
    /// The vehicle is outside the fence or in a keep-out.
    Fence,
    /// The rest of the allowed distance is needed for the return path.
    Distance,
    /// The rest of the allowed time is needed for the return path.
    Time,
    /// The surface was silent for longer than allowed.
    Silence,
    /// The vehicle is outside the depth band or the altitude band.
    Band,
    /// There is no allowed path to any goal.
    NoPath,
}

impl ModeReason {
    const ALL: [Self; 8] =
        [Self::Survey, Self::Order, Self::Fence, Self::Distance, Self::Time, Self::Silence, Self::Band, Self::NoPath];

    /// The reason with this number on the wire; `None` for the survey and for unknown numbers.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied().filter(|r| *r != Self::Survey)
    }

    /// The name for people; `None` for the survey.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Survey => None,
            Self::Order => Some("order"),
            Self::Fence => Some("fence"),
            Self::Distance => Some("distance"),
            Self::Time => Some("time"),
            Self::Silence => Some("silence"),
            Self::Band => Some("depth or altitude"),
            Self::NoPath => Some("no path"),
        }
    }
}

/// The vehicle's status, in two chunks that each fit a small frame.
///
/// ```text
/// pose
/// byte  bits  field                 unit, range
///  0    3     mode                  0 survey, 1 hold, 2 return, 3 surface, 4 abort, 5 done
///  0    1     a waypoint follows
///  0    1     the autopilot does not answer, so the mode is not carried out
///  0    3     reason                0 by the survey, 1 order, 2 fence, 3 distance, 4 time, 5 silence, 6 depth or
///                                   altitude, 7 no path
///  1-3  24    x east                decimetres, signed, +-838 km
///  4-6  24    y north               decimetres, signed
///  7-8  16    depth                 decimetres below the surface, 0..6553.5 m
///  9    8     heading               1/256 of a turn, clockwise from north
/// 10    8     position sigma        quarter metres, 255 = 63.75 m or more
/// 11    8     age of the last fix   seconds, 254 = that or more, 255 = no fix yet
/// 12-14 24    explored cells
/// 15-20 48    [waypoint x, y]       decimetres, signed
/// 21..        [planned path, see `PlannedPath`]; only after a waypoint
///
/// report
///  0    8     label epoch
///  1    8     labels on the map     0..254
///  2-3  16    digest of the map that the surface is known to hold (the base of this frame)
///  4-5  16    budget in force       bits a second: 12 bits of value, then 4 bits by how many it is shifted left
///  6    8     frames refused for want of authenticity, 255 = that or more
///  7-8  16    backlog, see `Backlog`
///  9-10 10    slots in this report, a bit each, the first slot in the highest bit
/// 10    3     reserved, 0
/// 10    3     a summary follows, a placement, the state of a disk
/// 11..  8     version of each of them, low 8 bits
/// then  4     decision about each of them: 1 applied, 2..11 refusal reason, 15 pending; any other value is refused; after an odd number,
///             4 bits 0
/// 3 bytes     [summary of the content in force, see `InForceSummary`]
/// 7 bytes     [placement of the map, see `Placement`]; left out while it has not moved
/// 1 byte      [state of the disk, see `DiskReport`]; left out by a vehicle without files
/// ```
///
/// ```
/// use scenecast_protocol::coordinates::MapPoint;
/// use scenecast_protocol::wire::VehicleStatus;
///
/// let status = VehicleStatus { position: MapPoint::new(12.5, -3.0), depth_m: 8.0, ..VehicleStatus::default() };
/// let pose = status.encode_pose(64);
/// let mut shown = VehicleStatus::default();
/// shown.read_pose(&pose).unwrap();
/// assert_eq!((pose.len(), shown.position, shown.depth_m), (15, status.position, 8.0));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VehicleStatus {
    /// The activity of the vehicle at present.
    pub mode: VehicleMode,
    /// Whether the autopilot does not answer, so that the mode is not carried out.
    pub autopilot_silent: bool,
    /// The reason for the mode.
    pub reason: ModeReason,
    /// The estimated position in the map frame.
    pub position: MapPoint,
    /// Depth below the water surface in metres.
    pub depth_m: f64,
    /// Heading clockwise from north in degrees, 0..360.
    pub heading_deg: f64,
    /// Standard deviation of the position estimate in metres.
    pub sigma_m: f64,
    /// Seconds since the last fix that was used; `None` before the first.
    pub fix_age_s: Option<f64>,
    /// The next goal of the vehicle, in the map frame.
    pub waypoint: Option<MapPoint>,
    /// The planned path after the waypoint; it is sent only with a waypoint.
    pub path: PlannedPath,
    /// The purpose of the plan, among the [`super::PoseDetails`]; `None` if no adaptive planner steers.
    pub intent: Option<Intent>,
    /// How the last camera frames were placed on the map; `None` where frames were never registered.
    pub registration: Option<RegistrationReport>,
    /// The faults of the equipment, among the [`super::PoseDetails`] while there are any.
    pub faults: EquipmentFaults,
    /// The corners of the track before the position, the latest first, among the [`super::PoseDetails`].
    pub trail: Vec<TrailCorner>,
    /// Number of explored cells on the map.
    pub explored_cells: u32,
    /// The epoch of the label ids.
    pub epoch: u8,
    /// Number of labels on the map, 0..=254.
    pub labels: u8,
    /// Digest of the map that the surface is known to hold.
    pub base_digest: u16,
    /// The bit budget in bit/s; the wire keeps its 12 leading bits.
    pub budget_bps: u32,
    /// Frames refused because they were not authentic, at most 255.
    pub refused_frames: u8,
    /// The content that still waits to be sent.
    pub backlog: Backlog,
    /// Decisions about the slots of the directive, by slot.
    pub slots: [SlotReport; SLOTS],
    /// The summary of the content in force; `None` if the report has none.
    pub in_force: Option<InForceSummary>,
    /// The placement of the map; `None` while no fix has moved it.
    pub placement: Option<Placement>,
    /// The state of the vehicle's disk; `None` if no report has had it.
    pub disk: Option<DiskReport>,
}

fn take_point(r: &mut Reader<'_>) -> Result<MapPoint, Truncated> {
    Ok(MapPoint { x_m: f64::from(r.i24()?) / 10.0, y_m: f64::from(r.i24()?) / 10.0 })
}

/// A rate in bit/s as 12 bits of value and 4 bits of shift, rounded down.
fn code_rate(bits_per_s: u32) -> u16 {
    let shift = (32 - bits_per_s.leading_zeros()).saturating_sub(12).min(15);
    ((bits_per_s >> shift).min(0xFFF) << 4 | shift) as u16
}

fn decode_rate(code: u16) -> u32 {
    u32::from(code >> 4) << (code & 15)
}

/// The bit of the first slot in a report.
const FIRST_SLOT: u16 = 0x8000;
/// The bits of all slots.
const SLOT_BITS: u16 = !0 << (u16::BITS as usize - SLOTS);
/// The bits of the parts that follow the slots.
const HAS_SUMMARY: u16 = 4;
const HAS_PLACEMENT: u16 = 2;
const HAS_DISK: u16 = 1;
const RESERVED: u16 = !(SLOT_BITS | HAS_SUMMARY | HAS_PLACEMENT | HAS_DISK);

impl VehicleStatus {
    /// Length of a report without slots in bytes.
    const REPORT_HEAD: usize = 9 + Backlog::BYTES;
    /// Length of a pose without a waypoint in bytes.
    pub(crate) const SHORT_POSE: usize = 15;
    /// Length of a pose with a waypoint, without a path, in bytes.
    pub(crate) const POSE: usize = 21;

    /// The places of its plan, the nearest first.
    pub fn ahead(&self) -> impl Iterator<Item = MapPoint> + '_ {
        self.waypoint.into_iter().chain(self.path.points.iter().copied())
    }

    /// Whether the vehicle holds because it has reached the end of its survey's plan.
    pub fn has_arrived(&self) -> bool {
        (self.mode, self.reason) == (VehicleMode::Hold, ModeReason::Survey)
    }

    /// Encodes the pose; values out of range are clamped. If `room` is too small, the waypoint or the end of
    /// the path is left out.
    pub fn encode_pose(&self, room: usize) -> Vec<u8> {
        let waypoint = self.waypoint.filter(|_| room >= Self::POSE);
        let flags = u8::from(waypoint.is_some()) << 4 | u8::from(self.autopilot_silent) << 3;
        let mut out = vec![self.mode.code() << 5 | flags | self.reason as u8];
        put24(&mut out, decimetres(self.position.x_m) as u32);
        put24(&mut out, decimetres(self.position.y_m) as u32);
        out.extend_from_slice(&((self.depth_m * 10.0).round().clamp(0.0, 65_535.0) as u16).to_be_bytes());
        out.push(((self.heading_deg / 360.0 * 256.0).round() as i64 & 255) as u8);
        out.push((self.sigma_m * 4.0).round().clamp(0.0, 255.0) as u8);
        out.push(self.fix_age_s.map_or(255, |age| age.round().clamp(0.0, 254.0) as u8));
        put24(&mut out, self.explored_cells.min(0xFF_FFFF));
        if let Some(at) = waypoint {
            put24(&mut out, decimetres(at.x_m) as u32);
            put24(&mut out, decimetres(at.y_m) as u32);
            out.extend(self.path.encode(at, room - Self::POSE));
        }
        out
    }

    /// Encodes a report of at most `room` bytes on the decided slots from `first` on, on the content in force (item
    /// [`SLOTS`]), on the placement and on the disk (the items after it). Also returns the item with which the next report
    /// must begin, 0 if this one is complete. `None` means that not even one slot fits.
    pub fn encode_report(&self, room: usize, first: usize) -> Option<(Vec<u8>, usize)> {
        let known = |&(_, s): &(usize, &SlotReport)| s.state != SlotState::Unknown;
        let decided: Vec<(usize, &SlotReport)> = self.slots.iter().enumerate().skip(first).filter(known).collect();
        // A slot takes one and a half bytes.
        let fitting = room.saturating_sub(Self::REPORT_HEAD) * 2 / 3;
        let (told, left) = decided.split_at(fitting.min(decided.len()));
        if told.is_empty() && !left.is_empty() {
            return None;
        }
        let bytes = Self::REPORT_HEAD + told.len() + told.len().div_ceil(2);
        let (parts, tail, next) = match left.first() {
            Some(&(slot, _)) => (0, Vec::new(), slot),
            None => self.encode_tail(room.saturating_sub(bytes), first, told.is_empty()),
        };
        let mut out = vec![self.epoch, self.labels];
        out.extend_from_slice(&self.base_digest.to_be_bytes());
        out.extend_from_slice(&code_rate(self.budget_bps).to_be_bytes());
        out.push(self.refused_frames);
        out.extend(self.backlog.encode());
        out.extend(told.iter().fold(parts, |bits, (slot, _)| bits | FIRST_SLOT >> slot).to_be_bytes());
        out.extend(told.iter().map(|(_, s)| s.version_low));
        let code = |of: Option<&(usize, &SlotReport)>| of.map_or(0, |(_, s)| s.state.code());
        out.extend(told.chunks(2).map(|pair| code(pair.first()) << 4 | code(pair.get(1))));
        out.extend(tail);
        Some((out, next))
    }

    /// The parts after the slots of a report, from item `first` on, that take at most `room` bytes: their bits, their bytes, and the
    /// item with which the next report must begin. An item that does not fit waits for the next report, unless `is_alone`: it would not
    /// fit there either.
    fn encode_tail(&self, room: usize, first: usize, mut is_alone: bool) -> (u16, Vec<u8>, usize) {
        let mut items = [(HAS_SUMMARY, Vec::new()), (HAS_PLACEMENT, Vec::new()), (HAS_DISK, Vec::new())];
        let [(_, in_force), (_, placement), (_, disk)] = &mut items;
        self.in_force.iter().for_each(|summary| summary.encode(in_force));
        self.placement.iter().for_each(|moved| moved.encode(placement));
        self.disk.iter().for_each(|state| state.encode(disk));
        let (mut bits, mut tail) = (0, Vec::new());
        for (item, (bit, bytes)) in (SLOTS..).zip(items).filter(|(item, (_, b))| *item >= first && !b.is_empty()) {
            if tail.len() + bytes.len() <= room {
                (bits, is_alone) = (bits | bit, false);
                tail.extend(bytes);
            } else if !is_alone {
                return (bits, tail, item);
            }
        }
        (bits, tail, 0)
    }

    /// Decodes a pose into `self`, without a trail, an intent, a registration and faults; the fields of the report stay unchanged.
    pub fn read_pose(&mut self, bytes: &[u8]) -> Result<(), StatusError> {
        let mut r = Reader::new(bytes);
        let head = r.u8()?;
        let mode = VehicleMode::ALL.get(usize::from(head >> 5)).copied().ok_or(StatusError::BadField)?;
        let reason = ModeReason::ALL.get(usize::from(head & 7)).copied().ok_or(StatusError::BadField)?;
        let mut read = Self { mode, reason, position: take_point(&mut r)?, ..self.clone() };
        read.depth_m = f64::from(r.u16()?) / 10.0;
        read.heading_deg = f64::from(r.u8()?) / 256.0 * 360.0;
        read.sigma_m = f64::from(r.u8()?) / 4.0;
        read.fix_age_s = Some(r.u8()?).filter(|&age| age != 255).map(f64::from);
        read.explored_cells = r.u24()?;
        (read.waypoint, read.path) = (None, PlannedPath::default());
        (read.trail, read.intent, read.registration) = (Vec::new(), None, None);
        read.faults = EquipmentFaults::default();
        read.autopilot_silent = head & 0b1000 != 0;
        if head & 0b1_0000 != 0 {
            let waypoint = take_point(&mut r)?;
            read.waypoint = Some(waypoint);
            if !r.rest().is_empty() {
                let path = r.take(r.rest().len())?;
                read.path = PlannedPath::decode(path, waypoint).ok_or(StatusError::BadField)?;
            }
        }
        if !r.rest().is_empty() {
            return Err(StatusError::Length);
        }
        *self = read;
        Ok(())
    }

    /// Decodes a report into `self`; other fields, and slots, placement and disk that it does not have, stay unchanged.
    pub fn read_report(&mut self, bytes: &[u8]) -> Result<(), StatusError> {
        let mut r = Reader::new(bytes);
        let mut read = Self { epoch: r.u8()?, labels: r.u8()?, base_digest: r.u16()?, ..self.clone() };
        read.budget_bps = decode_rate(r.u16()?);
        read.refused_frames = r.u8()?;
        read.backlog = Backlog::decode(&mut r)?;
        let told = r.u16()?;
        if told & RESERVED != 0 {
            return Err(StatusError::BadField);
        }
        let count = (told & SLOT_BITS).count_ones() as usize;
        let versions = r.take(count)?;
        let mut codes = r.take(count.div_ceil(2))?.iter().flat_map(|b| [b >> 4, b & 15]);
        let slots = read.slots.iter_mut().enumerate().filter(|(slot, _)| told & FIRST_SLOT >> slot != 0);
        for ((_, slot), &version_low) in slots.zip(versions) {
            let state = codes.next().and_then(SlotState::from_code).filter(|&s| s != SlotState::Unknown);
            *slot = SlotReport { version_low, state: state.ok_or(StatusError::BadField)? };
        }
        if codes.next().is_some_and(|padding| padding != 0) {
            return Err(StatusError::BadField);
        }
        if told & HAS_SUMMARY != 0 {
            read.in_force = Some(InForceSummary::decode(&mut r)?.ok_or(StatusError::BadField)?);
        }
        if told & HAS_PLACEMENT != 0 {
            read.placement = Some(Placement::decode(&mut r)?.ok_or(StatusError::BadField)?);
        }
        if told & HAS_DISK != 0 {
            read.disk = Some(DiskReport::decode(&mut r)?.ok_or(StatusError::BadField)?);
        }
        if !r.rest().is_empty() {
            return Err(StatusError::Length);
        }
        *self = read;
        Ok(())
    }

    /// The decision about one slot.
    pub fn slot(&self, id: SlotId) -> SlotReport {
        self.slots.get(id.index()).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
