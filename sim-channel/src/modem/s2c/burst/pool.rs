//! The pool: burst records that wait for a connection to their destination, cut into numbered packets, and put together again.

use std::collections::{BTreeMap, VecDeque};

/// The data of one `*SEND`, or of one line in data mode.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct BurstRecord {
    /// The packet counter in `DELIVERED`.
    pub count: u16,
    pub dst: u8,
    pub pid: u8,
    /// Written in data mode: more bytes may join it while it waits.
    pub raw: bool,
    pub data: Vec<u8>,
}

pub(super) const MAX_RECORD_BYTES: usize = 1024;

#[derive(Debug, Default)]
pub(super) struct BurstPool {
    pub(super) queue: VecDeque<BurstRecord>,
    last_count: u16,
    /// Bytes given up, bytes that did not fit, bytes acknowledged.
    dropped: u64,
    overflowed: u64,
    delivered: u64,
}

impl BurstPool {
    /// Bytes that wait and are not yet being sent.
    pub(super) fn bytes(&self) -> usize {
        self.queue.iter().map(|record| record.data.len()).sum()
    }

    pub(super) fn holds_record_to(&self, dst: u8) -> bool {
        self.queue.iter().any(|record| record.dst == dst)
    }

    /// Numbers a record and takes it; false if it does not fit into `limit` bytes.
    pub(super) fn push(&mut self, record: BurstRecord, limit: usize) -> bool {
        if self.bytes() + record.data.len() > limit {
            return false;
        }
        self.last_count = self.last_count.wrapping_add(1);
        self.queue.push_back(BurstRecord { count: self.last_count, ..record });
        true
    }

    /// Adds raw bytes to the last record if that still waits and has room, so that a line of the host is one record in
    /// however many pieces it comes.
    pub(super) fn join(&mut self, dst: u8, pid: u8, piece: &[u8], limit: usize) -> bool {
        let room = limit.saturating_sub(self.bytes());
        let joins = |last: &&mut BurstRecord| {
            last.raw && (last.dst, last.pid) == (dst, pid) && last.data.len() + piece.len() <= MAX_RECORD_BYTES
        };
        let last = self.queue.back_mut().filter(joins).filter(|_| piece.len() <= room);
        last.map(|last| last.data.extend_from_slice(piece)).is_some()
    }

    /// Takes out all records to `peer`, in order.
    pub(super) fn take_records_to(&mut self, peer: u8) -> Vec<BurstRecord> {
        let (to_peer, others): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.queue).into_iter().partition(|record| record.dst == peer);
        self.queue = others.into();
        to_peer
    }

    /// Puts records back to the front, in order.
    pub(super) fn put_back(&mut self, records: Vec<BurstRecord>) {
        records.into_iter().rev().for_each(|record| self.queue.push_front(record));
    }

    pub(super) fn clear(&mut self) {
        self.queue.clear();
    }

    pub(super) fn count_dropped(&mut self, bytes: usize) {
        self.dropped += bytes as u64;
    }

    pub(super) fn count_overflowed(&mut self, bytes: usize) {
        self.overflowed += bytes as u64;
    }

    pub(super) fn count_delivered(&mut self, bytes: usize) {
        self.delivered += bytes as u64;
    }

    pub(super) fn reset_counter(&mut self, key: &str) -> bool {
        match key {
            "ZD" => self.dropped = 0,
            "ZO" => self.overflowed = 0,
            _ => return false,
        }
        true
    }

    pub(super) fn value(&self, key: &str) -> Option<String> {
        Some(match key {
            "PC" => self.last_count.to_string(),
            "ZD" => self.dropped.to_string(),
            "ZO" => self.overflowed.to_string(),
            "ZE" => self.delivered.to_string(),
            _ => return None,
        })
    }
}

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

/// A longer record contains a corrupted piece that no check has found.
const MAX_RECEIVED_BYTES: usize = 4096;

/// One direction of a connection, at its receiver.
#[derive(Debug, Default)]
pub(super) struct Receiver {
    next: u32,
    held: BTreeMap<u32, Vec<u8>>,
    partial: Vec<u8>,
}

impl Receiver {
    /// The first missing packet, and a bit for each packet held behind it.
    pub(super) fn state(&self) -> (u32, u64) {
        let bit = |seq: &u32| u64::from(*seq) - u64::from(self.next) - 1;
        (self.next, self.held.keys().map(bit).filter(|bit| *bit < 64).fold(0, |map, bit| map | 1 << bit))
    }

    /// Takes a packet; returns the records that it completes, in order, each with its protocol id.
    pub(super) fn accept(&mut self, seq: u32, bytes: Vec<u8>) -> Vec<(u8, Vec<u8>)> {
        if (self.next..self.next.saturating_add(MAX_WINDOW_PACKETS)).contains(&seq) {
            self.held.insert(seq, bytes);
        }
        let mut records = Vec::new();
        while let Some(bytes) = self.held.remove(&self.next) {
            self.next += 1;
            self.unpack(&bytes, &mut records);
        }
        records
    }

    fn unpack(&mut self, mut bytes: &[u8], records: &mut Vec<(u8, Vec<u8>)>) {
        while let [flags, pid, l1, l0, rest @ ..] = bytes {
            let length = usize::from(u16::from_be_bytes([*l1, *l0]));
            let Some((piece, rest)) = rest.split_at_checked(length) else { return };
            self.partial.extend(piece);
            if flags & 1 == 1 {
                records.push((*pid, std::mem::take(&mut self.partial)));
            }
            if self.partial.len() > MAX_RECEIVED_BYTES {
                self.partial.clear();
            }
            bytes = rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    fn records() -> VecDeque<BurstRecord> {
        let record = |count: u16| BurstRecord {
            count,
            dst: 2,
            pid: 0,
            raw: false,
            data: vec![count as u8; 100 * usize::from(count)],
        };
        (1..=30).map(record).collect()
    }

    #[test]
    fn records_survive_lost_packets_in_order_and_once() {
        let (mut sender, mut receiver) = (Sender::default(), Receiver::default());
        let mut queue = records();
        let (mut arrived, mut delivered) = (Vec::new(), Vec::new());
        for turn in 0..200usize {
            for (n, (seq, bytes)) in sender.train(&mut queue, 2, 700, 10).into_iter().enumerate() {
                if (turn + n) % 3 != 0 {
                    arrived.extend(receiver.accept(seq, bytes));
                }
            }
            let (next, held) = receiver.state();
            delivered.extend(sender.acknowledge(next, held));
        }
        let sent: Vec<_> = records().into_iter().map(|record| (record.pid, record.data)).collect();
        assert_eq!(arrived, sent);
        assert_eq!(delivered, Vec::from(records()));
        assert!(!sender.has_unacked() && sender.bytes() == 0);
    }

    #[test]
    fn packets_are_full_and_hold_one_peer_only() {
        let mut queue = records();
        queue.push_front(BurstRecord { count: 0, dst: 9, pid: 0, raw: false, data: vec![0; 10] });
        let train = Sender::default().train(&mut queue, 2, 700, 3);
        assert!(train.iter().all(|(_, bytes)| bytes.len() > 690 && bytes.len() <= 700));
        assert_eq!(queue.front().map(|record| record.dst), Some(9));
    }

    #[test]
    fn malformed_packets_are_ignored() {
        let mut receiver = Receiver::default();
        assert!(receiver.accept(0, vec![1, 0, 255, 255, 1]).is_empty());
        assert!(receiver.accept(u32::MAX, vec![1, 0, 0, 1, 1]).is_empty());
        let mut sender = Sender::default();
        assert!(sender.acknowledge(77, u64::MAX).is_empty());
    }
}
