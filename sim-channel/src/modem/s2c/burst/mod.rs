//! Burst data: records in a pool, sent in trains of packets over a connection.
//!
//! ```text
//!   host -> BurstPool -> Sender -> train of packets -> Receiver -> host of the peer
//!                          ^                              |
//!                          +------- acknowledgement ------+      (turns of a Connection)
//! ```

mod connection;
mod establish;
mod pool;
mod turns;

use super::base::{QueuedFrame, ReceiverMode, S2cBase, S2cTask};
use super::input::SendCommand;
use super::messages::Messages;
use connection::{AcousticLink, TurnState};
use pool::{BurstPool, BurstRecord};
use std::time::Duration;

/// The pool of burst data, the connection that carries it, and the back-off while others own the channel.
#[derive(Debug, Default)]
pub(crate) struct BurstService {
    pool: BurstPool,
    link: AcousticLink,
    /// Counts requests and connections, so that old timers have no effect.
    epoch: u32,
    backoff_until: Duration,
}

impl BurstService {
    /// Takes a record of `*SEND`; returns the reply.
    pub(crate) fn submit(&mut self, base: &mut S2cBase, command: SendCommand, now: Duration) -> &'static str {
        if !base.may_address(command.dst, false) {
            return "ERROR WRONG DESTINATION ADDRESS";
        }
        let pid = base.protocol_id(command.pid);
        let record = BurstRecord { count: 0, dst: command.dst, pid, raw: false, data: command.data };
        if self.enqueue(base, record, now) { "OK" } else { "ERROR BUFFER FULL" }
    }

    /// Raw bytes of the data mode, to the remote address; dropped and counted if that is 0 or the pool is full.
    pub(crate) fn submit_raw(&mut self, base: &mut S2cBase, data: &[u8], now: Duration) {
        let dst = base.settings.byte("AR");
        let pid = base.protocol_id(None);
        for piece in data.chunks(pool::MAX_RECORD_BYTES) {
            if dst == 0 || !base.may_address(dst, false) {
                self.pool.count_dropped(piece.len());
                base.notify(format!("DROPCNT,{}", piece.len()), now);
            } else if !self.pool.join(dst, pid, piece, base.settings.pool)
                && !self.enqueue(base, BurstRecord { count: 0, dst, pid, raw: true, data: piece.to_vec() }, now)
            {
                self.pool.count_overflowed(piece.len());
            }
        }
    }

    fn enqueue(&mut self, base: &mut S2cBase, record: BurstRecord, now: Duration) -> bool {
        let fits = self.pool.push(record, base.settings.pool);
        if fits {
            base.board.schedule(now, S2cTask::ServePool);
        }
        fits
    }

    /// Throws away all burst data and ends the connection; returns the bytes dropped.
    pub(crate) fn drop_all(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) -> usize {
        let bytes = self.undelivered();
        self.close(base, messages, now);
        self.pool.clear();
        self.pool.count_dropped(bytes);
        bytes
    }

    /// Bytes not known to have arrived.
    pub(crate) fn undelivered(&self) -> usize {
        self.pool.bytes() + self.link.connection().map_or(0, |connection| connection.sender.bytes())
    }

    /// Bytes of the pool that are free.
    pub(crate) fn free(&self, base: &S2cBase) -> usize {
        base.settings.pool.saturating_sub(self.pool.bytes())
    }

    /// Sends the pending instant message, or lets it wait for a turn of this modem.
    pub(crate) fn offer_air(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        if messages.instant.is_forced() || matches!(self.link, AcousticLink::Listen) {
            messages.instant.transmit(base, false, 0);
            return;
        }
        messages.instant.wait_for_turn();
        if self.link.connection().is_some_and(|connection| connection.turn() == TurnState::Idle) {
            self.begin_turn_after(base, Duration::ZERO, false, now);
        }
    }

    /// Frames between other nodes keep this one silent until `until` at least.
    pub(crate) fn back_off(&mut self, until: Duration) {
        self.backoff_until = self.backoff_until.max(until);
    }

    pub(crate) fn end_backoff(&mut self, now: Duration) {
        self.backoff_until = now;
    }

    /// Whether others own the channel: a connection between other nodes, or ours to another node than `dst`.
    pub(crate) fn in_backoff(&self, dst: u8, now: Duration) -> bool {
        now < self.backoff_until || self.link.peer().is_some_and(|peer| peer != dst)
    }

    pub(crate) fn is_online(&self) -> bool {
        self.link.connection().is_some()
    }

    pub(crate) fn connected_to(&self, peer: u8) -> bool {
        self.link.connection().is_some_and(|connection| connection.peer == peer)
    }

    /// The other end of a connection, up or being established.
    pub(crate) fn peer(&self) -> Option<u8> {
        self.link.peer()
    }

    /// How much longer an acknowledgement may take because the peer's turn comes later.
    pub(crate) fn turn_allowance(&self, base: &S2cBase) -> Duration {
        let train = u64::from(base.settings.get("ZC")) * u64::from(base.settings.get("ZP"));
        if self.is_online() { Duration::from_millis(train + 2000) } else { Duration::ZERO }
    }

    /// Sends an acknowledgement at this modem's next turn.
    pub(crate) fn defer(&mut self, out: QueuedFrame) {
        if let Some(connection) = self.link.connection_mut() {
            connection.deferred.push(out);
        }
    }

    /// The state of the acoustic link in `AT?S`.
    pub(crate) fn state_name(&self, receiver: ReceiverMode, now: Duration) -> &'static str {
        match (&self.link, receiver) {
            (_, ReceiverMode::Noise) => "NOISE",
            (_, ReceiverMode::Deaf) => "DEAF",
            (AcousticLink::Establishing { .. }, _) => "INITIATION ESTABLISH",
            (AcousticLink::Online(_), _) => "ONLINE",
            (AcousticLink::Listen, _) if now < self.backoff_until => "BACKOFF",
            (AcousticLink::Listen, _) => "INITIATION LISTEN",
        }
    }

    /// `@ZD`, `@ZO`: resets a counter; false if there is no such counter.
    pub(crate) fn reset_counter(&mut self, key: &str) -> bool {
        self.pool.reset_counter(key)
    }

    /// The value behind `?` of a counter of the pool.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        self.pool.value(key)
    }
}
