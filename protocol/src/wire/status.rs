//! The vehicle's status.

use super::backlog::Backlog;
use super::cursor::{Reader, Truncated};
use super::path::PlannedPath;
use super::placement::Placement;
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

/// Why the vehicle does what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ModeReason {
    /// Nothing is amiss.
    #[default]
    Survey,
    /// The operator ordered it.
    Order,
    /// It is outside the fence or in a keep-out.
    Fence,
    /// The distance that it may go is used up but for the way back.
    Distance,
    /// The time that it may take is used up but for the way back.
    Time,
    /// The surface was silent for longer than allowed.
    Silence,
    /// It is outside the depth band or the altitude band.
    Band,
    /// There is nowhere that it may go.
    NoWay,
}

impl ModeReason {
    const ALL: [Self; 8] =
        [Self::Survey, Self::Order, Self::Fence, Self::Distance, Self::Time, Self::Silence, Self::Band, Self::NoWay];

    /// The reason of a number on the wire; `None` for no reason and for what is no number of one.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied().filter(|r| *r != Self::Survey)
    }

    /// Name for people; `None` if nothing is amiss.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Survey => None,
            Self::Order => Some("order"),
            Self::Fence => Some("fence"),
            Self::Distance => Some("distance"),
            Self::Time => Some("time"),
            Self::Silence => Some("silence"),
            Self::Band => Some("depth or altitude"),
            Self::NoWay => Some("no path"),
        }
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

/// What the vehicle says of itself, in two chunks that each fit a small frame.
///
/// ```text
/// pose
/// byte  bits  field                 unit, range
///  0    3     mode                  0 survey, 1 hold, 2 return, 3 surface, 4 abort, 5 done
///  0    1     a waypoint follows
///  0    1     the autopilot does not answer: nobody carries out what the mode says
///  0    3     why                   0 by the survey, 1 order, 2 fence, 3 distance, 4 time, 5 silence, 6 depth or
///                                   altitude, 7 no way
///  1-3  24    x east                decimetres, signed, +-838 km
///  4-6  24    y north               decimetres, signed
///  7-8  16    depth                 decimetres below the surface, 0..6553.5 m
///  9    8     heading               1/256 of a turn, clockwise from north
/// 10    8     position sigma        quarter metres, 255 = 63.75 m or more
/// 11    8     age of the last fix   seconds, 254 = that or more, 255 = no fix yet
/// 12-14 24    explored cells
/// 15-20 48    [waypoint x, y]       decimetres, signed
/// 21..        [what is planned after it, see `PlannedPath`]; only after a waypoint
///
/// report
///  0    8     label epoch
///  1    8     labels on the map     0..254
///  2-3  16    digest of the map that the surface is known to hold (the base of this frame)
///  4-5  16    budget in force       bits a second: 12 bits of value, then 4 bits by how many it is shifted left
///  6    8     frames refused for want of authenticity, 255 = that or more
///  7-8  16    what waits to be sent, see `Backlog`
///  9    8     slots that are reported of, a bit each, the first slot in the highest bit
/// 10..  8     version of each of them, low 8 bits
/// then  4     what became of each of them: 1 applied, 2..9 refusal reason; the rest is refused; 4 bits 0 after an odd number
/// 7 more      [where the map lies in the world, see `Placement`]; left out while it has not moved
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VehicleStatus {
    /// What it is doing.
    pub mode: VehicleMode,
    /// Whether its autopilot does not answer, so that nobody carries out what the mode says.
    pub autopilot_silent: bool,
    /// And why.
    pub reason: ModeReason,
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
    /// Where it plans to go from there; told only with a waypoint.
    pub path: PlannedPath,
    /// Explored cells on its map.
    pub explored_cells: u32,
    /// Epoch of its label ids.
    pub epoch: u8,
    /// Labels on its map.
    pub labels: u8,
    /// Digest of the map that it knows the surface to hold.
    pub base_digest: u16,
    /// Bits a second that it may send, with 12 bits of precision.
    pub budget_bps: u32,
    /// Frames that it refused because they were not authentic.
    pub refused_frames: u8,
    /// What it has still to send.
    pub backlog: Backlog,
    /// Decisions about the slots of the directive, by slot.
    pub slots: [SlotReport; SLOTS],
    /// Where the map lies in the world; `None` while no fix has moved it.
    pub placement: Option<Placement>,
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

pub(super) fn decimetres(metres: f64) -> i32 {
    (metres * 10.0).round().clamp(-8_388_608.0, 8_388_607.0) as i32
}

pub(super) fn put24(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(value.to_be_bytes().get(1..).unwrap_or_default());
}

/// Bits a second as 12 bits of value and 4 bits of shift, rounded down.
fn code_rate(bits_per_s: u32) -> u16 {
    let shift = (32 - bits_per_s.leading_zeros()).saturating_sub(12).min(15);
    ((bits_per_s >> shift).min(0xFFF) << 4 | shift) as u16
}

fn decode_rate(code: u16) -> u32 {
    u32::from(code >> 4) << (code & 15)
}

impl VehicleStatus {
    /// Bytes of a report without slots.
    const REPORT_HEAD: usize = 8 + Backlog::BYTES;
    /// Bytes of a pose with a waypoint, without a path.
    pub(crate) const POSE: usize = 21;

    /// The pose chunk; values out of range are clamped to it. The waypoint is left out if `room` is too small for it, and of
    /// the path what does not fit.
    pub fn encode_pose(&self, room: usize) -> Vec<u8> {
        let waypoint = self.waypoint.filter(|_| room >= Self::POSE);
        let flags = u8::from(waypoint.is_some()) << 4 | u8::from(self.autopilot_silent) << 3;
        let mut out = vec![self.mode.code() << 5 | flags | self.reason as u8];
        put24(&mut out, decimetres(self.x_m) as u32);
        put24(&mut out, decimetres(self.y_m) as u32);
        out.extend_from_slice(&((self.depth_m * 10.0).round().clamp(0.0, 65_535.0) as u16).to_be_bytes());
        out.push(((self.heading_deg / 360.0 * 256.0).round() as i64 & 255) as u8);
        out.push((self.sigma_m * 4.0).round().clamp(0.0, 255.0) as u8);
        out.push(self.fix_age_s.map_or(255, |age| age.round().clamp(0.0, 254.0) as u8));
        put24(&mut out, self.explored_cells.min(0xFF_FFFF));
        if let Some((x, y)) = waypoint {
            put24(&mut out, decimetres(x) as u32);
            put24(&mut out, decimetres(y) as u32);
            out.extend(self.path.encode((x, y), room - Self::POSE));
        }
        out
    }

    /// A report chunk of at most `room` bytes about the slots from `first` on and the placement, and the slot that the next
    /// one has to begin with, 0 if all is said; `None` if not one slot fits that was decided about.
    pub fn encode_report(&self, room: usize, first: usize) -> Option<(Vec<u8>, usize)> {
        let known = |&(_, s): &(usize, &SlotReport)| s.state != SlotState::Unknown;
        let decided: Vec<(usize, &SlotReport)> = self.slots.iter().enumerate().skip(first).filter(known).collect();
        // A slot takes a byte and a half.
        let fitting = room.saturating_sub(Self::REPORT_HEAD) * 2 / 3;
        let (told, left) = decided.split_at(fitting.min(decided.len()));
        if told.is_empty() && !left.is_empty() {
            return None;
        }
        let mut out = vec![self.epoch, self.labels];
        out.extend_from_slice(&self.base_digest.to_be_bytes());
        out.extend_from_slice(&code_rate(self.budget_bps).to_be_bytes());
        out.push(self.refused_frames);
        out.extend(self.backlog.encode());
        out.push(told.iter().fold(0, |bits, (slot, _)| bits | 0x80 >> slot));
        out.extend(told.iter().map(|(_, s)| s.version_low));
        let code = |of: Option<&(usize, &SlotReport)>| of.map_or(0, |(_, s)| s.state.code());
        out.extend(told.chunks(2).map(|pair| code(pair.first()) << 4 | code(pair.get(1))));
        let Some(placement) = self.placement.filter(|_| left.is_empty()) else {
            return Some((out, left.first().map_or(0, |&(slot, _)| slot)));
        };
        let has_room = room >= out.len() + Placement::BYTES;
        if has_room {
            placement.encode(&mut out);
        }
        let next = if has_room || told.is_empty() { 0 } else { SLOTS };
        Some((out, next))
    }

    /// Reads a pose; the rest stays as it is.
    pub fn read_pose(&mut self, bytes: &[u8]) -> Result<(), StatusError> {
        let mut r = Reader::new(bytes);
        let head = r.u8()?;
        let mode = VehicleMode::ALL.get(usize::from(head >> 5)).copied().ok_or(StatusError::BadField)?;
        let reason = ModeReason::ALL.get(usize::from(head & 7)).copied().ok_or(StatusError::BadField)?;
        let metres = |dm: i32| f64::from(dm) / 10.0;
        let mut read = Self { mode, reason, x_m: metres(r.i24()?), y_m: metres(r.i24()?), ..self.clone() };
        read.depth_m = f64::from(r.u16()?) / 10.0;
        read.heading_deg = f64::from(r.u8()?) / 256.0 * 360.0;
        read.sigma_m = f64::from(r.u8()?) / 4.0;
        read.fix_age_s = Some(r.u8()?).filter(|&age| age != 255).map(f64::from);
        read.explored_cells = r.u24()?;
        (read.waypoint, read.path) = (None, PlannedPath::default());
        read.autopilot_silent = head & 0b1000 != 0;
        if head & 0b1_0000 != 0 {
            let waypoint = (metres(r.i24()?), metres(r.i24()?));
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

    /// Reads a report; the rest stays as it is, and so do slots and the placement where it says nothing of them.
    pub fn read_report(&mut self, bytes: &[u8]) -> Result<(), StatusError> {
        let mut r = Reader::new(bytes);
        let mut read = Self { epoch: r.u8()?, labels: r.u8()?, base_digest: r.u16()?, ..self.clone() };
        read.budget_bps = decode_rate(r.u16()?);
        read.refused_frames = r.u8()?;
        read.backlog = Backlog::decode(&mut r)?;
        let told = r.u8()?;
        let count = told.count_ones() as usize;
        let versions = r.take(count)?;
        let mut codes = r.take(count.div_ceil(2))?.iter().flat_map(|b| [b >> 4, b & 15]);
        let slots = read.slots.iter_mut().enumerate().filter(|(slot, _)| told & 0x80 >> slot != 0);
        for ((_, slot), &version_low) in slots.zip(versions) {
            let state = codes.next().and_then(SlotState::from_code).filter(|&s| s != SlotState::Unknown);
            *slot = SlotReport { version_low, state: state.ok_or(StatusError::BadField)? };
        }
        if codes.next().is_some_and(|padding| padding != 0) {
            return Err(StatusError::BadField);
        }
        if !r.rest().is_empty() {
            read.placement = Some(Placement::decode(&mut r)?.ok_or(StatusError::BadField)?);
        }
        if !r.rest().is_empty() {
            return Err(StatusError::Length);
        }
        *self = read;
        Ok(())
    }

    /// The report about one slot.
    pub fn slot(&self, id: SlotId) -> SlotReport {
        self.slots.get(id.index()).copied().unwrap_or_default()
    }
}

impl SlotState {
    /// The number on the wire: 0 unknown, 1 applied, 2..=9 a reason of refusal.
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
mod tests;
