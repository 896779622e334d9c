//! Turns within a connection: acknowledgement, waiting message, train of packets; then the peer's turn.

use super::connection::{Connection, Turn};
use crate::Duration;
use crate::modem::s2c::air::After;
use crate::modem::s2c::frame::{Frame, Kind};
use crate::modem::s2c::reception::Signal;
use crate::modem::s2c::{Event, S2c, timing};

/// What an answer to a train may take beyond two ways of travel: turn-round, an instant message, the answer, a margin.
const ANSWER_ALLOWANCE: Duration = Duration::from_millis(1600);

impl S2c {
    /// Plans this modem's turn; `owes` an acknowledgement if the peer has sent packets.
    pub(in super::super) fn begin_turn_after(&mut self, delay: Duration, owes: bool, now: Duration) {
        if let Some(connection) = self.burst.link.connection_mut() {
            connection.turn = Turn::Talking;
            connection.number += 1;
            self.board.plan(now + delay, Event::Turn { number: connection.number, owes });
        }
    }

    /// It is this modem's turn.
    pub(in super::super) fn on_turn(&mut self, number: u64, owes: bool, now: Duration) {
        let trains = self.settings.get("ZC") as usize;
        if self.burst.link.connection().is_some_and(|connection| connection.number == number) {
            self.take_turn(owes, trains, now);
        }
    }

    fn take_turn(&mut self, owes: bool, packets: usize, now: Duration) {
        let packet_ms = self.settings.get("ZP");
        let capacity = timing::packet_capacity(self.config.bit_rate, packet_ms);
        let Some(connection) = self.burst.link.connection_mut() else { return };
        let train = connection.sender.train(&mut self.burst.queue, connection.peer, capacity, packets);
        let (peer, session, number) = (connection.peer, connection.session, connection.number);
        let (next, held) = connection.receiver.state();
        let deferred = std::mem::take(&mut connection.deferred);
        let (follow, last) = (train.len() as u8, train.len().checked_sub(1));
        let opens_with_message = self.message_waits_for(peer);
        let speaks = owes || opens_with_message || !deferred.is_empty();
        self.air.queue.extend(deferred);
        if opens_with_message {
            self.put_instant(true, follow);
        }
        if speaks {
            let mut frame = self.frame(Kind::Turn, peer);
            (frame.tag, frame.follow, frame.seq, frame.held) = (session, follow, next, held);
            let frame = self.with_piggyback(frame);
            let then = match last {
                Some(_) => After::Nothing,
                None if opens_with_message => After::Train(number),
                None => After::Acknowledged(number),
            };
            self.send(frame, timing::ACK, "ack", then);
        }
        for (index, (seq, payload)) in train.into_iter().enumerate() {
            let mut frame = self.frame(Kind::Packet, peer);
            (frame.tag, frame.follow, frame.seq, frame.held) =
                (session, follow - 1 - index as u8, seq, u64::from(next));
            let airtime = timing::packet(payload.len(), capacity, packet_ms);
            frame.payload = payload;
            self.send(frame, airtime, "data", if Some(index) == last { After::Train(number) } else { After::Nothing });
        }
        if last.is_none() && !speaks {
            self.rest(now);
        }
    }

    /// Our acknowledgement has been sent, with nothing after it: the peer may go on, else both rest.
    pub(in super::super) fn on_acknowledgement_sent(&mut self, number: u64, now: Duration) {
        if let Some(connection) = self.burst.link.connection_mut().filter(|connection| connection.number == number) {
            connection.turn = Turn::Listening;
            connection.number += 1;
            let patience = 2 * connection.travel + Duration::from_secs(1);
            self.board.plan(now + patience, Event::Rest { number: connection.number });
        }
    }

    /// The peer did not go on.
    pub(in super::super) fn on_rest(&mut self, number: u64, now: Duration) {
        if self.burst.link.connection().is_some_and(|connection| connection.number == number) {
            self.rest(now);
        }
    }

    fn message_waits_for(&self, peer: u8) -> bool {
        self.instant.waits_for_turn && self.instant.pending.as_ref().is_some_and(|pending| pending.dst == peer)
    }

    /// Nobody owes anything: wait for data, or for the idle time to pass.
    fn rest(&mut self, now: Duration) {
        let idle = Duration::from_secs(u64::from(self.settings.get("ZI")));
        if let Some(connection) = self.burst.link.connection_mut() {
            connection.turn = Turn::Idle;
            connection.number += 1;
            let patience = if connection.initiator { Duration::ZERO } else { Duration::from_secs(10) };
            self.board.plan(now + idle + patience, Event::Idle { number: connection.number });
        }
        self.board.plan(now, Event::Kick);
    }

    /// The idle time has passed without a turn.
    pub(in super::super) fn on_idle(&mut self, number: u64) {
        let idle = |connection: &&Connection| connection.number == number && connection.turn == Turn::Idle;
        if self.burst.link.connection().filter(idle).is_some() {
            self.say_goodbye();
        }
    }

    /// The train, or a probe, has been sent: the peer owes an acknowledgement.
    pub(in super::super) fn on_train_sent(&mut self, number: u64, now: Duration) {
        let Some(connection) = self.burst.link.connection_mut().filter(|connection| connection.number == number) else {
            return;
        };
        connection.turn = Turn::Waiting;
        connection.number += 1;
        let deadline = now + 2 * connection.travel + ANSWER_ALLOWANCE;
        self.board.plan(deadline, Event::AnswerTimeout { number: connection.number });
    }

    /// The peer did not acknowledge: probe with one packet, or give the connection up.
    pub(in super::super) fn on_answer_timeout(&mut self, number: u64, now: Duration) {
        let patience = self.settings.get("RC").max(1);
        let Some(connection) = self.burst.link.connection_mut().filter(|connection| connection.number == number) else {
            return;
        };
        connection.silent += 1;
        if connection.silent > patience {
            self.lose_connection(now);
        } else {
            connection.turn = Turn::Talking;
            connection.number += 1;
            self.take_turn(false, 1, now);
        }
    }

    /// The peer's turn: its acknowledgement, and how many packets it announces.
    pub(in super::super) fn on_peer_turn(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        if !self.hear_peer(frame, signal) {
            return;
        }
        self.on_acknowledged(frame.seq, frame.held, now);
        if frame.follow > 0 {
            self.guard_turn(self.packet_time(frame.follow) + Duration::from_millis(500), now);
            return;
        }
        let waiting = |connection: &Connection| connection.sender.has_unacked() || !connection.deferred.is_empty();
        let peer_data = self.burst.queue.iter().any(|record| record.dst == frame.src);
        if peer_data || self.burst.link.connection().is_some_and(waiting) || self.message_waits_for(frame.src) {
            self.begin_turn_after(timing::TURN_ROUND.saturating_sub(timing::PROCESSING), false, now);
        } else {
            self.rest(now);
        }
    }

    /// A packet of the peer's train.
    pub(in super::super) fn on_packet(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        if !self.hear_peer(frame, signal) {
            return;
        }
        self.on_acknowledged(u32::try_from(frame.held).unwrap_or_default(), 0, now);
        let Some(connection) = self.burst.link.connection_mut() else { return };
        for (pid, data) in connection.receiver.accept(frame.seq, frame.payload.clone()) {
            self.deliver_record(frame.src, pid, &data, signal, now);
        }
        if frame.follow == 0 {
            self.begin_turn_after(timing::TURN_ROUND.saturating_sub(timing::PROCESSING), true, now);
        } else {
            self.guard_turn(self.packet_time(frame.follow) + Duration::from_millis(100), now);
        }
    }

    /// Whether a frame belongs to the present connection; notes that the peer is there.
    fn hear_peer(&mut self, frame: &Frame, signal: &Signal) -> bool {
        let ours = |connection: &&mut Connection| connection.peer == frame.src && connection.session == frame.tag;
        let Some(connection) = self.burst.link.connection_mut().filter(ours) else { return false };
        connection.silent = 0;
        connection.travel = signal.travel;
        connection.heard_at = signal.heard_at;
        true
    }

    fn on_acknowledged(&mut self, base: u32, held: u64, now: Duration) {
        let Some(connection) = self.burst.link.connection_mut() else { return };
        for record in connection.sender.acknowledge(base, held) {
            self.burst.delivered += record.data.len() as u64;
            self.notify(format!("DELIVERED,{},{}", record.count, record.dst), now);
        }
    }

    /// Listens to the peer for so long at most; then it is this modem's turn, whatever was lost.
    pub(in super::super) fn guard_turn(&mut self, patience: Duration, now: Duration) {
        if let Some(connection) = self.burst.link.connection_mut() {
            connection.turn = Turn::Listening;
            connection.number += 1;
            self.board.plan(now + patience, Event::Turn { number: connection.number, owes: true });
        }
    }

    /// Time that so many full packets take.
    pub(in super::super) fn packet_time(&self, packets: u8) -> Duration {
        Duration::from_millis(u64::from(self.settings.get("ZP"))) * u32::from(packets)
    }
}
