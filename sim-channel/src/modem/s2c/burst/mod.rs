//! Burst data: records in a pool, sent in trains of packets over a connection.

pub(super) mod connection;
mod establish;
mod receiver;
mod sender;
mod turns;

use super::S2c;
use super::send_command::SendCommand;
use crate::Duration;
use connection::Link;
use std::collections::VecDeque;

/// What one `*SEND`, or one piece of raw data, asked to be carried.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Record {
    /// The packet counter that `DELIVERED` tells.
    pub count: u16,
    pub dst: u8,
    pub pid: u8,
    /// Of the data mode: more may join it while it waits.
    pub raw: bool,
    pub data: Vec<u8>,
}

/// Most bytes of a record.
const RECORD_BYTES: usize = 1024;

/// The pool and the connection.
#[derive(Debug, Default)]
pub(super) struct Burst {
    pub queue: VecDeque<Record>,
    pub last_count: u16,
    pub link: Link,
    pub epoch: u32,
    pub backoff_until: Duration,
    pub dropped: u64,
    pub overflowed: u64,
    pub delivered: u64,
}

impl Burst {
    /// Bytes in the pool: those that are not yet being sent.
    pub(super) fn waiting(&self) -> usize {
        self.queue.iter().map(|record| record.data.len()).sum()
    }

    /// Bytes not known to have arrived.
    pub(super) fn bytes(&self) -> usize {
        self.waiting() + self.link.connection().map_or(0, |connection| connection.sender.bytes())
    }
}

impl S2c {
    pub(super) fn send_burst(&mut self, command: SendCommand, now: Duration) -> &'static str {
        if !self.may_address(command.dst, false) {
            return "ERROR WRONG DESTINATION ADDRESS";
        }
        let pid = command.pid.unwrap_or_else(|| self.settings.byte("ZS"));
        let record = Record { count: 0, dst: command.dst, pid, raw: false, data: command.data };
        if self.enqueue(record, now) { "OK" } else { "ERROR BUFFER FULL" }
    }

    /// Raw bytes of the data mode, to the remote address; dropped and counted if that is 0 or the pool is full.
    pub(super) fn send_raw(&mut self, data: &[u8], now: Duration) {
        let dst = self.settings.byte("AR");
        let pid = self.settings.byte("ZS");
        for piece in data.chunks(RECORD_BYTES) {
            if dst == 0 || !self.may_address(dst, false) {
                self.burst.dropped += piece.len() as u64;
                self.notify(format!("DROPCNT,{}", piece.len()), now);
            } else if !self.join(dst, pid, piece)
                && !self.enqueue(Record { count: 0, dst, pid, raw: true, data: piece.to_vec() }, now)
            {
                self.burst.overflowed += piece.len() as u64;
            }
        }
    }

    /// Adds raw bytes to the last record, if that still waits and has room: a host's line is one record, however it comes.
    fn join(&mut self, dst: u8, pid: u8, piece: &[u8]) -> bool {
        let room = self.settings.pool.saturating_sub(self.burst.waiting());
        let joins = |last: &&mut Record| {
            last.raw && (last.dst, last.pid) == (dst, pid) && last.data.len() + piece.len() <= RECORD_BYTES
        };
        let last = self.burst.queue.back_mut().filter(joins).filter(|_| piece.len() <= room);
        last.map(|last| last.data.extend_from_slice(piece)).is_some()
    }

    fn enqueue(&mut self, record: Record, now: Duration) -> bool {
        if self.burst.waiting() + record.data.len() > self.settings.pool {
            return false;
        }
        self.burst.last_count = self.burst.last_count.wrapping_add(1);
        self.burst.queue.push_back(Record { count: self.burst.last_count, ..record });
        self.board.plan(now, super::Event::Kick);
        true
    }

    /// Throws away all burst data and ends the connection; returns the bytes dropped.
    pub(super) fn drop_bursts(&mut self, now: Duration) -> usize {
        let bytes = self.burst.bytes();
        self.close_connection(now);
        self.burst.queue.clear();
        self.burst.dropped += bytes as u64;
        bytes
    }
}
