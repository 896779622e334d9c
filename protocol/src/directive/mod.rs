//! The directive: the operator's orders to a vehicle, as independent versioned slots.

mod choices;
mod fence;
mod in_force;
mod limits;
mod orders;
mod outbox;
mod polygon;
mod progress;
mod settings;

pub use choices::{AtEnd, CellBand, Change, PlannerKind, Registration, ShortDecimal};
pub use fence::{Fence, FenceFault};
pub(crate) use in_force::InForceAssembly;
pub use in_force::{InForceDigests, InForcePart, InForceSummary, PerSlot, REPORTED_SLOTS};
pub use limits::{Band, Limits, LimitsFault, Reaction};
pub use orders::{Budget, Constraints, Destination, ExemplarRequest, ExemplarRequests, Fix, Utility};
pub(crate) use outbox::{PendingSlot, SlotOutbox, WaitingStop};
pub use polygon::{Areas, AreasFault, Polygon, PolygonFault, WeightedArea};
pub use progress::{OrderStatus, Series, SlotProgress, SlotReport, SlotState, Withdrawal};
pub use settings::{Settings, SettingsFault};

use crate::bytes::{Reader, Truncated};
use crate::schedule::Class;

/// The number of slots of the directive.
pub const SLOTS: usize = 10;

/// A slot of the directive; a newer version supersedes the older one of the same slot only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SlotId {
    /// The weight of each label.
    Utility,
    /// Orders that take effect at once: hold and abort.
    Constraints,
    /// How the vehicle builds its map.
    Settings,
    /// The vehicle's bit budget and its shares.
    Budget,
    /// Exemplars that the operator requests.
    Requests,
    /// The vehicle's position, measured from the surface.
    Fix,
    /// Limits of depth, altitude, distance and time, and the reactions to a breach.
    Limits,
    /// The outline of the survey area, and keep-outs.
    Fence,
    /// The place to which the vehicle goes at once.
    Destination,
    /// Outlines in which cells have a weight in addition to that of their label.
    Areas,
}

impl SlotId {
    /// Every slot, in the order of the numbers on the wire.
    pub const ALL: [Self; SLOTS] = [
        Self::Utility,
        Self::Constraints,
        Self::Settings,
        Self::Budget,
        Self::Requests,
        Self::Fix,
        Self::Limits,
        Self::Fence,
        Self::Destination,
        Self::Areas,
    ];

    /// The index in [`Self::ALL`], which is the number on the wire.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The first byte of the slot on the wire: the low three bits of its number, then the high five.
    fn to_head(self) -> u8 {
        (self as u8).rotate_right(3)
    }

    fn of_head(head: u8) -> Option<Self> {
        Self::ALL.get(usize::from(head.rotate_left(3))).copied()
    }

    /// The class that its bytes count as.
    pub fn class(self) -> Class {
        if self == Self::Fix { Class::Fix } else { Class::Directive }
    }

    /// Whether a vehicle that applies it plans its path again.
    pub fn steers(self) -> bool {
        !matches!(self, Self::Budget | Self::Requests | Self::Fix)
    }

    /// The name for people and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Utility => "utility",
            Self::Constraints => "constraints",
            Self::Settings => "settings",
            Self::Budget => "budget",
            Self::Requests => "requests",
            Self::Fix => "fix",
            Self::Limits => "limits",
            Self::Fence => "fence",
            Self::Destination => "destination",
            Self::Areas => "areas",
        }
    }
}

/// Why a vehicle refuses a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RefusalReason {
    /// The payload has another layout.
    Malformed,
    /// It refers to labels of another epoch.
    OtherEpoch,
    /// It names a label that the map does not have.
    UnknownLabel,
    /// A value lies outside the range that the vehicle accepts.
    OutOfRange,
    /// It contradicts itself or a constraint in force.
    Contradiction,
    /// It came too late to be of use.
    TooOld,
    /// The vehicle is outside of the area or band that it allows.
    Outside,
    /// The vehicle is not able to obey it.
    Unable,
    /// The vehicle's disk does not keep it.
    Disk,
    /// The vehicle has lost its record of the orders that it applied, and this series may contain one of them.
    Forgotten,
    /// Another surface has given a newer order of this kind.
    Overtaken,
}

impl RefusalReason {
    const ALL: [Self; 11] = [
        Self::Malformed,
        Self::OtherEpoch,
        Self::UnknownLabel,
        Self::OutOfRange,
        Self::Contradiction,
        Self::TooOld,
        Self::Outside,
        Self::Unable,
        Self::Disk,
        Self::Forgotten,
        Self::Overtaken,
    ];

    /// The number on the wire, 2 to 12.
    pub fn code(self) -> u8 {
        self as u8 + 2
    }

    /// The reason with this number on the wire.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|r| r.code() == code)
    }

    /// An explanation for the operator, one clause.
    pub fn explain(self) -> &'static str {
        match self {
            Self::Malformed => "the vehicle could not read it",
            Self::OtherEpoch => "the vehicle has renumbered its labels since: set the weights again",
            Self::UnknownLabel => "it names a label that is not on the vehicle's map",
            Self::OutOfRange => "a value is outside what the vehicle accepts",
            Self::Contradiction => "it contradicts itself or a constraint in force",
            Self::TooOld => "it came too late to be of use",
            Self::Outside => "the vehicle is outside of it, so it keeps to what was in force before",
            Self::Unable => "the vehicle flies at an altitude or depth that it does not allow",
            Self::Disk => "the vehicle's disk does not keep it: until it does, the vehicle obeys only hold and abort",
            Self::Forgotten => "the vehicle has lost its journal and may have applied it before: give the order again",
            Self::Overtaken => "another surface has given a newer order of this kind",
        }
    }
}

/// The payload of a slot.
#[derive(Debug, Clone, PartialEq)]
pub enum Slot {
    /// Weights of labels, exploration and curiosity.
    Utility(Utility),
    /// Orders to hold or to abort.
    Constraints(Constraints),
    /// Settings of the scene model, of the map that is sent, and of the planner.
    Settings(Settings),
    /// Bit budget, shares and background streams.
    Budget(Budget),
    /// The exemplars that the operator requests.
    Requests(ExemplarRequests),
    /// A position that the surface has measured.
    Fix(Fix),
    /// Limits, and reactions to their breach.
    Limits(Limits),
    /// Fence, keep-outs and return point.
    Fence(Fence),
    /// A place to go to at once.
    Destination(Destination),
    /// Outlines in which cells have a weight in addition to that of their label.
    Areas(Areas),
}

impl Slot {
    /// Whether it stops the vehicle: a hold or an abort.
    pub fn stops(&self) -> bool {
        matches!(self, Self::Constraints(constraints) if constraints.stops())
    }

    /// The slot that this payload belongs to.
    pub fn id(&self) -> SlotId {
        match self {
            Self::Utility(_) => SlotId::Utility,
            Self::Constraints(_) => SlotId::Constraints,
            Self::Settings(_) => SlotId::Settings,
            Self::Budget(_) => SlotId::Budget,
            Self::Requests(_) => SlotId::Requests,
            Self::Fix(_) => SlotId::Fix,
            Self::Limits(_) => SlotId::Limits,
            Self::Fence(_) => SlotId::Fence,
            Self::Destination(_) => SlotId::Destination,
            Self::Areas(_) => SlotId::Areas,
        }
    }

    fn encode_payload(&self, out: &mut Vec<u8>) {
        match self {
            Self::Utility(v) => v.encode(out),
            Self::Constraints(v) => v.encode(out),
            Self::Settings(v) => out.extend(v.to_bytes()),
            Self::Budget(v) => v.encode(out),
            Self::Requests(v) => v.encode(out),
            Self::Fix(v) => v.encode(out),
            Self::Limits(v) => out.extend(v.to_bytes()),
            Self::Fence(v) => out.extend(v.to_bytes()),
            Self::Destination(v) => v.encode(out),
            Self::Areas(v) => out.extend(v.to_bytes()),
        }
    }

    fn decode_payload(id: SlotId, r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(match id {
            SlotId::Utility => Self::Utility(Utility::decode(r)?),
            SlotId::Constraints => Self::Constraints(Constraints::decode(r)?),
            SlotId::Settings => Self::Settings(Settings::decode(r)?),
            SlotId::Budget => Self::Budget(Budget::decode(r)?),
            SlotId::Requests => Self::Requests(ExemplarRequests::decode(r)?),
            SlotId::Fix => Self::Fix(Fix::decode(r)?),
            SlotId::Limits => Self::Limits(Limits::from_bytes(r.take(r.rest().len())?).ok_or(Truncated)?),
            SlotId::Fence => Self::Fence(Fence::from_bytes(r.take(r.rest().len())?).ok_or(Truncated)?),
            SlotId::Destination => Self::Destination(Destination::decode(r)?),
            SlotId::Areas => Self::Areas(Areas::from_bytes(r.take(r.rest().len())?).ok_or(Truncated)?),
        })
    }
}

/// A version of a slot on the wire.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-----+---------+-------------------------------+---------------
/// | low | high    | version                       | payload ...
/// +-----+---------+-------------------------------+---------------
/// ```
/// The number of the slot is `8 high + low`, 0 to 9; a slot with another number belongs to a later version of the wire, and
/// is skipped. The version counts in the series of the surface ([`Series`]), which its hello names.
///
/// ```
/// use scenecast_protocol::directive::{Constraints, Slot, VersionedSlot};
///
/// let hold = Slot::Constraints(Constraints { hold: true, abort: false });
/// let bytes = VersionedSlot::encode(1, &hold);
/// assert_eq!(bytes, [0x20, 0, 1, 0x80]);
/// assert_eq!(VersionedSlot::decode(&bytes).unwrap().content, Some(hold));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct VersionedSlot {
    /// The slot, also where the payload is unreadable.
    pub id: SlotId,
    /// The version within the series; wraps.
    pub version: u16,
    /// The payload; `None` if it is unreadable.
    pub content: Option<Slot>,
}

impl VersionedSlot {
    /// The bytes of `slot` at `version`.
    #[must_use]
    pub fn encode(version: u16, slot: &Slot) -> Vec<u8> {
        let mut out = vec![slot.id().to_head()];
        out.extend_from_slice(&version.to_be_bytes());
        slot.encode_payload(&mut out);
        out
    }

    /// Decodes a slot. An unreadable payload still yields its id and version, so that it can be refused by name.
    pub fn decode(bytes: &[u8]) -> Result<Self, Truncated> {
        let mut r = Reader::new(bytes);
        let head = r.u8()?;
        let id = SlotId::of_head(head).ok_or(Truncated)?;
        let version = r.u16()?;
        let content = Slot::decode_payload(id, &mut r).ok().filter(|_| r.rest().is_empty());
        Ok(Self { id, version, content })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::LayerMask;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
            let _ = VersionedSlot::decode(&bytes);
        }

        #[test]
        fn utilities_round_trip(
            weights in proptest::collection::btree_map(1u8..=254, -100i8..=100, 0..60),
            exploration in -100i8..=100, epoch: u8, version: u16,
        ) {
            let slot = Slot::Utility(Utility { epoch, exploration, curiosity: 5, weights });
            let bytes = VersionedSlot::encode(version, &slot);
            let back = VersionedSlot { id: SlotId::Utility, version, content: Some(slot) };
            prop_assert_eq!(VersionedSlot::decode(&bytes), Ok(back));
        }
    }

    #[test]
    fn twelve_weights_fit_a_frame_of_64_bytes() {
        let weights = (1..=12).map(|l| (l, 50)).collect();
        let bytes = VersionedSlot::encode(1, &Slot::Utility(Utility { weights, ..Utility::default() }));
        assert!(bytes.len() <= 49, "{} bytes", bytes.len());
    }

    #[test]
    fn all_settings_at_once_fit_a_frame_of_48_bytes() {
        let figure = Change::To(ShortDecimal::new(0.01).unwrap());
        let settings = Settings {
            planner: Change::To(PlannerKind::Greedy),
            at_end: Change::To(AtEnd::Hold),
            registration: Change::To(Registration::Off),
            cells: Change::To(CellBand::CoarseToFine),
            layers: Change::To(LayerMask(u16::MAX)),
            alpha: figure,
            beta: figure,
            gamma: figure,
            refine_words_per_s: figure,
            frames_per_s: figure,
            labels: Change::To(32),
        };
        let bytes = VersionedSlot::encode(1, &Slot::Settings(settings));
        assert_eq!(bytes.len(), 18);
        let back = VersionedSlot::decode(&bytes).map(|slot| slot.content);
        assert_eq!(back, Ok(Some(Slot::Settings(settings))));
    }

    #[test]
    fn golden_bytes_of_a_utility() {
        let weights = [(3, 80), (5, -20)].into_iter().collect();
        let utility = Utility { epoch: 1, exploration: 20, curiosity: 0, weights };
        assert_eq!(VersionedSlot::encode(4, &Slot::Utility(utility)), [0x00, 0, 4, 1, 20, 0, 3, 80, 5, 0xEC]);
    }
}
