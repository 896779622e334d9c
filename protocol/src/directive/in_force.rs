//! The content of slots that is in force at a vehicle, by digest and in parts.

use super::{Slot, SlotId};
use crate::bytes::{Reader, Truncated};
use crate::map::TextPart;
use std::collections::BTreeMap;

/// The slots of which a vehicle reports the content in force.
pub const REPORTED_SLOTS: [SlotId; 7] = [
    SlotId::Utility,
    SlotId::Settings,
    SlotId::Budget,
    SlotId::Limits,
    SlotId::Fence,
    SlotId::Destination,
    SlotId::Areas,
];

/// The place of a slot among [`REPORTED_SLOTS`], which stands for it in summaries and parts.
fn place_of(id: SlotId) -> Option<u8> {
    REPORTED_SLOTS.iter().position(|&reported| reported == id).map(|place| place as u8)
}

/// A value for each of [`REPORTED_SLOTS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerSlot<T>([T; REPORTED_SLOTS.len()]);

impl<T> PerSlot<T> {
    /// The value of a slot; `None` if its content is not reported.
    pub fn get(&self, id: SlotId) -> Option<&T> {
        REPORTED_SLOTS.iter().zip(&self.0).find(|(reported, _)| **reported == id).map(|(_, value)| value)
    }

    /// The value of a slot, to be changed.
    pub fn get_mut(&mut self, id: SlotId) -> Option<&mut T> {
        REPORTED_SLOTS.iter().zip(&mut self.0).find(|(reported, _)| **reported == id).map(|(_, value)| value)
    }

    /// Each slot with its value.
    pub fn iter(&self) -> impl Iterator<Item = (SlotId, &T)> {
        REPORTED_SLOTS.into_iter().zip(&self.0)
    }

    /// A value for each slot.
    pub fn from_fn(of: impl Fn(SlotId) -> T) -> Self {
        Self(REPORTED_SLOTS.map(of))
    }
}

impl Slot {
    /// The payload in the form in which it is in force; `None` if this order leaves no content in force: limits without
    /// a limit, a fence without an outline and a return point, settings that are all as configured, no destination, no area.
    pub fn in_force(self) -> Option<Self> {
        let is_empty = match &self {
            Self::Limits(limits) => *limits == Default::default(),
            Self::Fence(fence) => *fence == Default::default(),
            Self::Settings(settings) => settings.to_bytes() == [0, 0],
            Self::Destination(destination) => destination.place.is_none(),
            Self::Areas(areas) => areas.0.is_empty(),
            Self::Utility(_) | Self::Budget(_) => false,
            Self::Constraints(_) | Self::Requests(_) | Self::Fix(_) => true,
        };
        (!is_empty).then_some(self)
    }

    /// The bytes of the payload without slot and version.
    pub(crate) fn payload(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.encode_payload(&mut out);
        out
    }

    /// Reads the bytes of [`Self::payload`].
    pub(crate) fn from_payload(id: SlotId, bytes: &[u8]) -> Option<Self> {
        let mut r = Reader::new(bytes);
        Self::decode_payload(id, &mut r).ok().filter(|_| r.rest().is_empty())
    }
}

/// The digest of the content in force of each slot; 0 where there is none.
pub type InForceDigests = PerSlot<u16>;

impl InForceDigests {
    /// The digests of these contents.
    pub fn of(contents: &PerSlot<Option<Slot>>) -> Self {
        Self::from_fn(|id| {
            contents.get(id).and_then(Option::as_ref).map_or(0, |slot| TextPart::digest_of(&slot.payload()))
        })
    }

    /// The summary that a report carries.
    pub fn summary(&self) -> InForceSummary {
        let slots = (0..).zip(&self.0).fold(0, |bits, (place, digest)| bits | u8::from(*digest != 0) << (7 - place));
        InForceSummary { slots, digest: TextPart::digest_of(&self.encode()) }
    }

    /// The payload of an inquiry.
    ///
    /// ```text
    /// 2 bytes each: the digest of the content that the surface holds of utility, settings, budget, limits, fence,
    ///               destination, areas; 0: it holds none
    /// after them:   reserved for later versions; skipped
    /// ```
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        self.0.iter().flat_map(|digest| digest.to_be_bytes()).collect()
    }

    /// Reads the payload of an inquiry.
    pub fn decode(bytes: &[u8]) -> Result<Self, Truncated> {
        let mut r = Reader::new(bytes);
        let mut read = Self::default();
        for digest in &mut read.0 {
            *digest = r.u16()?;
        }
        Ok(read)
    }
}

/// The summary of the content in force, three bytes of a report.
///
/// ```text
/// byte  bits  field
///  0    7     slots with content in force, a bit each: utility, settings, budget, limits, fence, destination, areas
///  0    1     reserved, 0
///  1-2  16    [`TextPart::digest_of`] of the digests of these seven slots in this order, 2 bytes each, 0 for no content
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InForceSummary {
    slots: u8,
    digest: u16,
}

impl InForceSummary {
    /// The digest of the content in force of all slots.
    pub fn digest(self) -> u16 {
        self.digest
    }

    /// Whether a slot has content in force.
    pub fn has(self, id: SlotId) -> bool {
        place_of(id).is_some_and(|place| self.slots & 0x80 >> place != 0)
    }

    pub(crate) fn encode(self, out: &mut Vec<u8>) {
        out.push(self.slots);
        out.extend_from_slice(&self.digest.to_be_bytes());
    }

    /// `None` stands for a reserved bit that is set.
    pub(crate) fn decode(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let read = Self { slots: r.u8()?, digest: r.u16()? };
        Ok((read.slots & 1 == 0).then_some(read))
    }
}

/// A part of the content in force of a slot, in answer to an inquiry. It is no order.
///
/// ```text
/// byte 0   number of the slot, one of utility, settings, budget, limits, fence, destination, areas
/// then     a part of the content ([`TextPart`]), which has at most 2048 bytes and is the payload of the slot
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InForcePart<'a> {
    /// The slot of the content.
    pub id: SlotId,
    /// A piece of the encoded content, with its place in it.
    pub part: TextPart<'a>,
}

impl<'a> InForcePart<'a> {
    /// Most bytes before the part of the content.
    pub(crate) const HEAD: usize = 1 + TextPart::LONG_HEAD;
    /// The longest content in bytes.
    pub(crate) const MAX_CONTENT: usize = 2048;

    /// The bytes of the payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        [&[self.id.index() as u8], &self.part.encode()[..]].concat()
    }

    /// Reads the payload of a chunk; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&slot, part) = bytes.split_first()?;
        let id = REPORTED_SLOTS.into_iter().find(|id| id.index() == usize::from(slot))?;
        let part = TextPart::decode(part)?;
        (usize::from(part.first) + part.bytes.len() <= Self::MAX_CONTENT).then_some(Self { id, part })
    }
}

/// The parts of one content that have come in.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct InForceAssembly {
    digest: u16,
    length: Option<usize>,
    parts: BTreeMap<u16, Vec<u8>>,
}

impl InForceAssembly {
    /// The most bytes of parts, which may overlap if the sender has cut the content anew.
    const MAX_HELD: usize = 2 * InForcePart::MAX_CONTENT;

    /// Takes a part; returns the content once it is whole and has its digest.
    pub(crate) fn take(&mut self, &InForcePart { id, part }: &InForcePart<'_>) -> Option<Slot> {
        let held: usize = self.parts.values().map(Vec::len).sum();
        if self.digest != part.digest || held > Self::MAX_HELD {
            *self = Self { digest: part.digest, ..Self::default() };
        }
        self.parts.insert(part.first, part.bytes.to_vec());
        if part.is_last {
            self.length = Some(usize::from(part.first) + part.bytes.len());
        }
        let mut content = Vec::new();
        for (first, bytes) in &self.parts {
            let overlap = content.len().checked_sub(usize::from(*first))?;
            content.extend_from_slice(bytes.get(overlap..).unwrap_or_default());
        }
        if self.length != Some(content.len()) {
            return None;
        }
        *self = Self::default();
        (TextPart::digest_of(&content) == part.digest).then(|| Slot::from_payload(id, &content)).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directive::{Fence, Limits, Settings, Utility};
    use proptest::prelude::*;

    fn utility(labels: u8) -> Slot {
        Slot::Utility(Utility { weights: (1..=labels).map(|l| (l, 50)).collect(), ..Utility::default() })
    }

    #[test]
    fn golden_bytes_of_content_in_force() {
        let mut contents = PerSlot::<Option<Slot>>::default();
        assert_eq!(InForceDigests::of(&contents).summary(), InForceSummary { slots: 0, digest: 0xA96A });
        *contents.get_mut(SlotId::Utility).unwrap() = Some(utility(2));
        *contents.get_mut(SlotId::Limits).unwrap() =
            Some(Slot::Limits(Limits { time_s: Some(60), ..Limits::default() }));
        let digests = InForceDigests::of(&contents);
        let (mut summary, bytes) = (Vec::new(), digests.encode());
        digests.summary().encode(&mut summary);
        assert_eq!((summary[0], InForceDigests::decode(&bytes)), (0b1001_0000, Ok(digests)));
        let part = TextPart { digest: 0xBEEF, first: 300, is_last: true, bytes: &[7, 8] };
        let part = InForcePart { id: SlotId::Fence, part };
        assert_eq!(part.encode(), [7, 0xBE, 0xEF, 0xC1, 44, 7, 8]);
        assert_eq!(InForcePart::decode(&part.encode()), Some(part));
        for bytes in [&[][..], &[1, 0, 1, 0, 7], &[10, 0, 1, 0, 7], &[7, 0, 1, 0], &[7, 0, 1, 0x48, 0, 7]] {
            assert_eq!(InForcePart::decode(bytes), None, "{bytes:02X?}");
        }
    }

    #[test]
    fn orders_that_lift_leave_no_content_in_force() {
        assert_eq!(Slot::Fence(Fence::default()).in_force(), None);
        assert_eq!(Slot::Limits(Limits::default()).in_force(), None);
        assert_eq!(Slot::Settings(Settings::default()).in_force(), None);
        assert_eq!(utility(0).in_force(), Some(utility(0)));
    }

    proptest! {
        #[test]
        fn parts_in_any_order_make_the_content(labels in 0u8..200, mut cuts in proptest::collection::vec(1usize..80, 1..8)) {
            let slot = utility(labels);
            let content = slot.payload();
            let mut parts = Vec::new();
            let mut at = 0;
            cuts.push(content.len());
            for cut in cuts {
                let end = content.len().min(at + cut);
                if at < end {
                    parts.push((at, end));
                }
                at = end;
            }
            let turns = labels as usize % 3 % parts.len();
            parts.rotate_left(turns);
            let digest = TextPart::digest_of(&content);
            let mut assembly = InForceAssembly::default();
            let mut whole = Vec::new();
            for (first, end) in parts {
                let (is_last, bytes) = (end == content.len(), &content[first..end]);
                let part = TextPart { digest, first: first as u16, is_last, bytes };
                let part = InForcePart { id: SlotId::Utility, part };
                whole.extend(assembly.take(&InForcePart::decode(&part.encode()).unwrap()));
            }
            prop_assert_eq!(whole, [slot]);
        }

        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
            if let Some(part) = InForcePart::decode(&bytes) {
                prop_assert_eq!(part.encode(), bytes.clone());
                let _ = InForceAssembly::default().take(&part);
            }
            let _ = InForceDigests::decode(&bytes);
        }
    }
}
