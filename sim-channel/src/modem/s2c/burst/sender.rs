//! Cuts burst records into numbered packets and keeps them until they are acknowledged.

use super::pool::BurstRecord;
use std::collections::{BTreeMap, VecDeque};

/// Packets from the first unacknowledged one on that may be under way.
pub(super) const MAX_WINDOW_PACKETS: u32 = 64;
/// Flags (bit 0: last piece of its record), protocol id, length of the piece.
const PIECE_HEADER: usize = 4;

/// One direction of a connection, at its sender.
#[derive(Debug, Default)]
pub(super) struct Sender {
    base: u32,
    next: u32,
    unacked: BTreeMap<u32, Vec<u8>>,
    /// Records that have begun, each with the number of its last packet once that is known.
    begun: VecDeque<(BurstRecord, Option<u32>)>,
    /// Bytes of the last record that are in packets.
    offset: usize,
}

impl Sender {
    pub(super) fn has_unacked(&self) -> bool {
        !self.unacked.is_empty()
    }

    /// At most `count` packets of at most `capacity` bytes: the unacknowledged ones, then new ones with records to `peer`.
    pub(super) fn train(
        &mut self,
        queue: &mut VecDeque<BurstRecord>,
        peer: u8,
        capacity: usize,
        count: usize,
    ) -> Vec<(u32, Vec<u8>)> {
        let mut train: Vec<_> = self.unacked.iter().take(count).map(|(seq, bytes)| (*seq, bytes.clone())).collect();
        while train.len() < count && self.next - self.base < MAX_WINDOW_PACKETS {
            let Some(bytes) = self.new_packet(queue, peer, capacity) else { break };
            train.push((self.next - 1, bytes));
        }
        train
    }

    fn new_packet(&mut self, queue: &mut VecDeque<BurstRecord>, peer: u8, capacity: usize) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        while bytes.len() + PIECE_HEADER < capacity.max(PIECE_HEADER + 1) && self.open_record(queue, peer) {
            let room = capacity.max(PIECE_HEADER + 1) - bytes.len() - PIECE_HEADER;
            let Some((record, end)) = self.begun.back_mut() else { break };
            let rest = record.data.get(self.offset..).unwrap_or_default();
            let piece = rest.get(..room.min(rest.len())).unwrap_or_default();
            let last = piece.len() == rest.len();
            bytes.extend([u8::from(last), record.pid]);
            bytes.extend((piece.len() as u16).to_be_bytes());
            bytes.extend(piece);
            self.offset += piece.len();
            if last {
                *end = Some(self.next);
            }
        }
        if bytes.is_empty() {
            return None;
        }
        self.unacked.insert(self.next, bytes.clone());
        self.next += 1;
        Some(bytes)
    }

    /// Whether there is a record to cut from; begins the next record to `peer` if necessary.
    fn open_record(&mut self, queue: &mut VecDeque<BurstRecord>, peer: u8) -> bool {
        if self.begun.back().is_some_and(|(_, end)| end.is_none()) {
            return true;
        }
        let record = queue.iter().position(|record| record.dst == peer).and_then(|index| queue.remove(index));
        self.offset = 0;
        record.map(|record| self.begun.push_back((record, None))).is_some()
    }

    /// All packets before `base` have arrived, and those behind it that have a bit in `held`.
    ///
    /// Returns the records that are complete at the peer.
    pub(super) fn acknowledge(&mut self, base: u32, held: u64) -> Vec<BurstRecord> {
        if base > self.next || base < self.base {
            return Vec::new();
        }
        self.base = base;
        self.unacked.retain(|seq, _| {
            let beyond = u64::from(*seq).checked_sub(u64::from(base) + 1);
            *seq >= base && !beyond.is_some_and(|bit| bit < 64 && held >> bit & 1 == 1)
        });
        let mut delivered = Vec::new();
        while self.begun.front().is_some_and(|(_, end)| end.is_some_and(|end| end < base)) {
            delivered.extend(self.begun.pop_front().map(|(record, _)| record));
        }
        delivered
    }

    /// The records that are not known to have arrived, in order.
    pub(super) fn into_records(self) -> Vec<BurstRecord> {
        self.begun.into_iter().map(|(record, _)| record).collect()
    }

    /// Bytes of records not known to have arrived.
    pub(super) fn bytes(&self) -> usize {
        self.begun.iter().map(|(record, _)| record.data.len()).sum()
    }
}
