//! The pool: burst records that wait for a connection to their destination, and the counters of burst data.

use std::collections::VecDeque;

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
