//! The content in force at the vehicle: reported by digest, and sent to a surface that does not hold it.

use crate::directive::{InForceDigests, InForcePart, PerSlot, Slot, SlotId};
use crate::map::TextPart;
use crate::time::Instant;
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

/// A part of a content in a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SentPart {
    id: SlotId,
    digest: u16,
    range: Range<usize>,
}

/// A content that the surface has inquired for.
#[derive(Debug)]
struct Answer {
    digest: u16,
    content: Vec<u8>,
    /// The parts that are to be sent.
    waiting: VecDeque<Range<usize>>,
    /// The number of parts of unknown fate.
    in_flight: usize,
}

/// The content in force of each slot, and the answers to the surface's last inquiries.
#[derive(Debug, Default)]
pub(super) struct InForceSender {
    contents: PerSlot<Option<Slot>>,
    answers: PerSlot<Option<Answer>>,
    /// When an answer arrived as a whole, with its digest.
    answered: PerSlot<Option<(u16, Instant)>>,
}

impl InForceSender {
    /// Time in which a content is not sent again that has arrived, so that nobody can have the vehicle repeat it.
    const PAUSE: Duration = Duration::from_secs(60);

    /// Puts the content of a slot in force; returns whether it is another one.
    pub(super) fn set(&mut self, id: SlotId, content: Option<Slot>) -> bool {
        let Some(held) = self.contents.get_mut(id).filter(|held| **held != content) else { return false };
        *held = content;
        let digest = self.digests().get(id).copied().unwrap_or_default();
        // The surface has inquired for the content in force, whichever it is.
        if let Some(answer) = self.answers.get_mut(id)
            && answer.take().is_some()
        {
            *answer = self.contents.get(id).and_then(Option::as_ref).map(|slot| Answer::new(slot, digest));
        }
        true
    }

    pub(super) fn get(&self, id: SlotId) -> Option<&Slot> {
        self.contents.get(id)?.as_ref()
    }

    pub(super) fn digests(&self) -> InForceDigests {
        InForceDigests::of(&self.contents)
    }

    /// The surface holds the contents with these digests, and inquires for the others. Returns whether it lacks any.
    pub(super) fn handle_inquiry(&mut self, held: &InForceDigests, now: Instant) -> bool {
        let mut lacks_any = false;
        for (id, &digest) in self.digests().iter() {
            let content = self.contents.get(id).and_then(Option::as_ref);
            let Some(slot) = content.filter(|_| held.get(id) != Some(&digest)) else { continue };
            lacks_any = true;
            let arrived = self.answered.get(id).copied().flatten();
            let is_recent = arrived.is_some_and(|(which, at)| which == digest && now.since(at) < Self::PAUSE);
            if let Some(answer) = self.answers.get_mut(id).filter(|answer| answer.is_none() && !is_recent) {
                *answer = Some(Answer::new(slot, digest));
            }
        }
        lacks_any
    }

    /// The surface has begun a new run: it inquires again if it must.
    pub(super) fn handle_peer_restart(&mut self) {
        (self.answers, self.answered) = (PerSlot::default(), PerSlot::default());
    }

    /// Bytes of answers that wait, with their heads.
    pub(super) fn backlog_bytes(&self) -> usize {
        let waiting = self.answers.iter().filter_map(|(_, answer)| answer.as_ref()).flat_map(|a| &a.waiting);
        waiting.map(|range| InForcePart::HEAD + range.len()).sum()
    }

    /// The next part of an answer, of at most `room` bytes, and its payload.
    pub(super) fn next_part(&mut self, room: usize) -> Option<(SentPart, Vec<u8>)> {
        let room = room.checked_sub(InForcePart::HEAD).filter(|&room| room > 0)?;
        let (id, answer) = self.answers.iter().find(|(_, a)| a.as_ref().is_some_and(|a| !a.waiting.is_empty()))?;
        let answer = answer.as_ref()?;
        let whole = answer.waiting.front()?;
        let range = whole.start..whole.end.min(whole.start + room);
        let bytes = answer.content.get(range.clone())?;
        let (first, is_last) = (u16::try_from(range.start).ok()?, range.end == answer.content.len());
        let payload = InForcePart { id, part: TextPart { digest: answer.digest, first, is_last, bytes } }.encode();
        Some((SentPart { id, digest: answer.digest, range }, payload))
    }

    /// A part was put into a frame.
    pub(super) fn mark_in_flight(&mut self, part: &SentPart) {
        let Some(answer) = self.answer_of(part) else { return };
        if let Some(whole) = answer.waiting.pop_front() {
            answer.in_flight += 1;
            if part.range.end < whole.end {
                answer.waiting.push_front(part.range.end..whole.end);
            }
        }
    }

    /// The fate of a part is known.
    pub(super) fn handle_fate(&mut self, part: &SentPart, delivered: bool, now: Instant) {
        let Some(answer) = self.answer_of(part) else { return };
        answer.in_flight = answer.in_flight.saturating_sub(1);
        if !delivered {
            return answer.waiting.push_front(part.range.clone());
        }
        if answer.in_flight == 0 && answer.waiting.is_empty() {
            self.answers.get_mut(part.id).map(Option::take);
            if let Some(answered) = self.answered.get_mut(part.id) {
                *answered = Some((part.digest, now));
            }
        }
    }

    fn answer_of(&mut self, part: &SentPart) -> Option<&mut Answer> {
        self.answers.get_mut(part.id)?.as_mut().filter(|answer| answer.digest == part.digest)
    }
}

impl Answer {
    fn new(slot: &Slot, digest: u16) -> Self {
        let mut content = slot.payload();
        content.truncate(InForcePart::MAX_CONTENT);
        let mut waiting = VecDeque::new();
        waiting.push_back(0..content.len());
        Self { digest, content, waiting, in_flight: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directive::{InForceAssembly, Utility};

    fn utility(labels: u8) -> Slot {
        Slot::Utility(Utility { weights: (1..=labels).map(|l| (l, 50)).collect(), ..Utility::default() })
    }

    #[test]
    fn lost_parts_of_an_answer_are_sent_again_in_other_sizes() {
        let (mut sender, mut assembly, now) = (InForceSender::default(), InForceAssembly::default(), Instant::ZERO);
        assert!(sender.set(SlotId::Utility, Some(utility(40))) && !sender.set(SlotId::Utility, Some(utility(40))));
        assert!(sender.handle_inquiry(&InForceDigests::default(), now));
        let mut received = Vec::new();
        for (step, room) in [20, 14, 30, 25, 60, 90, 90].into_iter().enumerate() {
            let Some((part, payload)) = sender.next_part(room) else { break };
            assert!(payload.len() <= room);
            sender.mark_in_flight(&part);
            let delivered = step % 3 != 1;
            if delivered {
                received.extend(assembly.take(&InForcePart::decode(&payload).unwrap()));
            }
            sender.handle_fate(&part, delivered, now);
        }
        assert_eq!((received, sender.backlog_bytes()), (vec![utility(40)], 0));
        assert!(sender.handle_inquiry(&InForceDigests::default(), now) && sender.backlog_bytes() == 0, "just answered");
        assert!(!sender.handle_inquiry(&sender.digests(), now), "the surface holds it");
    }

    #[test]
    fn an_answer_follows_a_change_of_the_content() {
        let mut sender = InForceSender::default();
        sender.set(SlotId::Utility, Some(utility(3)));
        sender.handle_inquiry(&InForceDigests::default(), Instant::ZERO);
        let (old, _) = sender.next_part(6).unwrap();
        sender.mark_in_flight(&old);
        sender.set(SlotId::Utility, Some(utility(4)));
        sender.handle_fate(&old, false, Instant::ZERO);
        let (_, payload) = sender.next_part(99).unwrap();
        assert_eq!(InForceAssembly::default().take(&InForcePart::decode(&payload).unwrap()), Some(utility(4)));
        sender.set(SlotId::Utility, None);
        assert!(sender.next_part(99).is_none());
    }
}
