//! Puts numbered packets in order and records together again.

use super::sender::MAX_WINDOW_PACKETS;
use std::collections::BTreeMap;

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
    use super::super::pool::BurstRecord;
    use super::super::sender::Sender;
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
