//! Turns of a connection: an acknowledgement, a waiting message, a train of packets; then it is the peer's turn.

use super::BurstService;
use super::connection::TurnState;
use crate::modem::s2c::base::{AfterSending, FrameKind, ReceivedSignal, S2cBase, S2cFrame, S2cTask, timing};
use crate::modem::s2c::messages::Messages;
use crate::modem::s2c::receiver::notices;
use std::time::Duration;

/// Time for an acknowledgement beyond two ways of travel: turn-around, an instant message, the acknowledgement, a margin.
const ACK_ALLOWANCE: Duration = Duration::from_millis(1600);
/// How much longer the modem that did not request an idle connection keeps it open.
const ACCEPTOR_ALLOWANCE: Duration = Duration::from_secs(10);

impl BurstService {
    /// Plans this modem's turn; it owes an acknowledgement if the peer has sent packets.
    pub(super) fn begin_turn_after(&mut self, base: &mut S2cBase, delay: Duration, owes_ack: bool, now: Duration) {
        if let Some(connection) = self.link.connection_mut() {
            let number = connection.enter(TurnState::Sending);
            base.board.schedule(now + delay, S2cTask::Turn { number, owes_ack });
        }
    }

    /// Listens to the peer for at most `timeout`; then it is this modem's turn, even if frames were lost.
    pub(crate) fn listen_at_most(&mut self, base: &mut S2cBase, timeout: Duration, now: Duration) {
        if let Some(connection) = self.link.connection_mut() {
            let number = connection.enter(TurnState::Receiving);
            base.board.schedule(now + timeout, S2cTask::Turn { number, owes_ack: true });
        }
    }

    pub(crate) fn on_turn(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        number: u64,
        owes_ack: bool,
        now: Duration,
    ) {
        let packets = base.settings.get("ZC") as usize;
        if self.link.connection_in_turn(number).is_some() {
            self.take_turn(base, messages, owes_ack, packets, now);
        }
    }

    /// Sends the frames that are due in this turn, or rests if there are none.
    fn take_turn(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        owes_ack: bool,
        packets: usize,
        now: Duration,
    ) {
        let packet_ms = base.settings.get("ZP");
        let capacity = timing::packet_capacity(base.config.bit_rate, packet_ms);
        let Some(connection) = self.link.connection_mut() else { return };
        let train = connection.sender.train(&mut self.pool.queue, connection.peer, capacity, packets);
        let (peer, session, number) = (connection.peer, connection.session, connection.number());
        let (next, held) = connection.receiver.state();
        let deferred = std::mem::take(&mut connection.deferred);
        let (follow, last) = (train.len() as u8, train.len().checked_sub(1));
        let opens_with_message = messages.instant.waits_for_turn_to(peer);
        let sends_ack = owes_ack || opens_with_message || !deferred.is_empty();
        deferred.into_iter().for_each(|out| base.transmitter.push(out));
        if opens_with_message {
            messages.instant.transmit(base, true, follow);
        }
        if sends_ack {
            let mut frame = base.frame(FrameKind::Turn, peer);
            (frame.tag, frame.follow, frame.seq, frame.held) = (session, follow, next, held);
            let frame = messages.piggyback.attach(frame);
            let then = match last {
                Some(_) => AfterSending::Done,
                None if opens_with_message => AfterSending::Train(number),
                None => AfterSending::Acknowledged(number),
            };
            base.send(frame, timing::ACK, "ack", then);
        }
        for (index, (seq, payload)) in train.into_iter().enumerate() {
            let mut frame = base.frame(FrameKind::Packet, peer);
            (frame.tag, frame.follow, frame.seq, frame.held) =
                (session, follow - 1 - index as u8, seq, u64::from(next));
            let airtime = timing::packet(payload.len(), capacity, packet_ms);
            frame.payload = payload;
            let then = if Some(index) == last { AfterSending::Train(number) } else { AfterSending::Done };
            base.send(frame, airtime, "data", then);
        }
        if last.is_none() && !sends_ack {
            self.rest(base, now);
        }
    }

    /// Our acknowledgement has been sent without a train: the peer may continue, otherwise both rest.
    pub(crate) fn on_acknowledgement_sent(&mut self, base: &mut S2cBase, number: u64, now: Duration) {
        if let Some(connection) = self.link.connection_in_turn(number) {
            let number = connection.enter(TurnState::Receiving);
            let timeout = 2 * connection.travel() + Duration::from_secs(1);
            base.board.schedule(now + timeout, S2cTask::Rest { number });
        }
    }

    /// The peer did not continue.
    pub(crate) fn on_rest(&mut self, base: &mut S2cBase, number: u64, now: Duration) {
        if self.link.connection_in_turn(number).is_some() {
            self.rest(base, now);
        }
    }

    /// Neither modem owes an acknowledgement: waits for data, or for the idle time to pass.
    fn rest(&mut self, base: &mut S2cBase, now: Duration) {
        let idle = Duration::from_secs(u64::from(base.settings.get("ZI")));
        if let Some(connection) = self.link.connection_mut() {
            let number = connection.enter(TurnState::Idle);
            let allowance = if connection.initiator { Duration::ZERO } else { ACCEPTOR_ALLOWANCE };
            base.board.schedule(now + idle + allowance, S2cTask::Idle { number });
        }
        base.board.schedule(now, S2cTask::ServePool);
    }

    /// The idle time has passed without a turn.
    pub(crate) fn on_idle(&mut self, base: &mut S2cBase, number: u64) {
        if self.link.connection_in_turn(number).is_some_and(|connection| connection.turn() == TurnState::Idle) {
            self.send_disconnect(base);
        }
    }

    /// The train, or a probe, has been sent: the peer owes an acknowledgement.
    pub(crate) fn on_train_sent(&mut self, base: &mut S2cBase, number: u64, now: Duration) {
        if let Some(connection) = self.link.connection_in_turn(number) {
            let number = connection.enter(TurnState::AwaitingAck);
            let deadline = now + 2 * connection.travel() + ACK_ALLOWANCE;
            base.board.schedule(deadline, S2cTask::AckTimeout { number });
        }
    }

    /// The peer did not acknowledge: probes it with one packet, or gives the connection up.
    pub(crate) fn on_ack_timeout(&mut self, base: &mut S2cBase, messages: &mut Messages, number: u64, now: Duration) {
        let max_probes = base.settings.get("RC").max(1);
        let Some(connection) = self.link.connection_in_turn(number) else { return };
        if connection.on_unanswered() > max_probes {
            self.lose_connection(base, messages, now);
        } else {
            connection.enter(TurnState::Sending);
            self.take_turn(base, messages, false, 1, now);
        }
    }

    /// The peer opens its turn: its acknowledgement, and how many packets it announces.
    pub(crate) fn on_peer_turn(
        &mut self,
        base: &mut S2cBase,
        messages: &Messages,
        frame: &S2cFrame,
        signal: &ReceivedSignal,
        now: Duration,
    ) {
        if !self.on_peer_frame(frame, signal) {
            return;
        }
        self.on_acknowledged(base, frame.seq, frame.held, now);
        if frame.follow > 0 {
            self.listen_at_most(base, base.packet_time(frame.follow) + Duration::from_millis(500), now);
            return;
        }
        let connection = self.link.connection();
        let owes =
            connection.is_some_and(|connection| connection.sender.has_unacked() || !connection.deferred.is_empty());
        if self.pool.holds_record_to(frame.src) || owes || messages.instant.waits_for_turn_to(frame.src) {
            self.begin_turn_after(base, timing::TURN_AROUND.saturating_sub(timing::PROCESSING), false, now);
        } else {
            self.rest(base, now);
        }
    }

    /// A packet of the peer's train.
    pub(crate) fn on_packet(&mut self, base: &mut S2cBase, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
        if !self.on_peer_frame(frame, signal) {
            return;
        }
        self.on_acknowledged(base, u32::try_from(frame.held).unwrap_or_default(), 0, now);
        let Some(connection) = self.link.connection_mut() else { return };
        for (pid, data) in connection.receiver.accept(frame.seq, frame.payload.clone()) {
            notices::record(base, frame.src, pid, &data, signal, now);
        }
        if frame.follow == 0 {
            self.begin_turn_after(base, timing::TURN_AROUND.saturating_sub(timing::PROCESSING), true, now);
        } else {
            self.listen_at_most(base, base.packet_time(frame.follow) + Duration::from_millis(100), now);
        }
    }

    /// Whether a frame belongs to the present connection, which notes that the peer is there.
    fn on_peer_frame(&mut self, frame: &S2cFrame, signal: &ReceivedSignal) -> bool {
        let Some(connection) = self.link.connection_mut().filter(|connection| connection.owns(frame)) else {
            return false;
        };
        connection.on_peer_frame(signal);
        true
    }

    fn on_acknowledged(&mut self, base: &mut S2cBase, next: u32, held: u64, now: Duration) {
        let Some(connection) = self.link.connection_mut() else { return };
        for record in connection.sender.acknowledge(next, held) {
            self.pool.count_delivered(record.data.len());
            base.notify(format!("DELIVERED,{},{}", record.count, record.dst), now);
        }
    }
}
