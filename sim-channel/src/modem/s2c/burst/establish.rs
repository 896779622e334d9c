//! Beginning and end of a connection.

use super::BurstService;
use super::connection::{AcousticLink, Connection, TurnState};
use super::pool::BurstRecord;
use crate::modem::s2c::base::{
    AfterSending, FrameKind, ReceivedSignal, ReceiverMode, S2cBase, S2cFrame, S2cTask, timing,
};
use crate::modem::s2c::messages::Messages;
use std::time::Duration;

/// A connection whose peer was silent for this long gives way to another one.
const STALE_TIMEOUT: Duration = Duration::from_secs(15);
/// Frames that have no meaning once a connection ends or is taken over.
const CONNECTION_FRAMES: [FrameKind; 3] = [FrameKind::Request, FrameKind::Packet, FrameKind::Turn];

impl BurstService {
    /// Requests a connection or begins a turn if burst data waits for one; closes a connection to the wrong node.
    pub(crate) fn serve_pool(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        let Some(next) = self.pool.queue.front().map(|record| record.dst) else { return };
        match &self.link {
            AcousticLink::Listen if now < self.backoff_until => {
                base.board.schedule(self.backoff_until, S2cTask::ServePool);
            }
            AcousticLink::Listen if base.condition.receiver() == ReceiverMode::Listen => {
                let session = (base.board.rng.uniform() * 256.0) as u8;
                self.link = AcousticLink::Establishing { peer: next, session, attempts: 0 };
                self.request(base, messages);
            }
            AcousticLink::Online(connection) if connection.turn() == TurnState::Idle => {
                if self.pool.holds_record_to(connection.peer) {
                    self.begin_turn_after(base, Duration::ZERO, false, now);
                } else if !connection.sender.has_unacked() {
                    self.send_disconnect(base);
                }
            }
            _ => {}
        }
    }

    fn request(&mut self, base: &mut S2cBase, messages: &mut Messages) {
        let AcousticLink::Establishing { peer, session, attempts } = &mut self.link else { return };
        *attempts += 1;
        self.epoch += 1;
        let mut frame = base.frame(FrameKind::Request, *peer);
        frame.tag = *session;
        let frame = messages.piggyback.attach(frame);
        base.send(frame, timing::HEADER, "connect", AfterSending::Request(self.epoch));
    }

    /// `!RT` is the wait for a grant to begin; the grant then takes its own time.
    pub(crate) fn on_request_sent(&mut self, base: &mut S2cBase, epoch: u32, now: Duration) {
        let wait = Duration::from_millis(u64::from(base.settings.get("RT")));
        base.board.schedule(now + wait + timing::HEADER + timing::PROCESSING, S2cTask::RequestTimeout { epoch });
    }

    pub(crate) fn on_request_timeout(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        epoch: u32,
        now: Duration,
    ) {
        let AcousticLink::Establishing { peer, attempts, .. } = self.link else { return };
        if epoch != self.epoch {
            return;
        }
        if attempts > base.settings.get("RC") {
            self.link = AcousticLink::Listen;
            self.fail_records(base, messages, peer, Vec::new(), now);
        } else {
            self.request(base, messages);
        }
    }

    /// Another modem requests a connection.
    pub(crate) fn on_request(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        frame: &S2cFrame,
        signal: &ReceivedSignal,
        now: Duration,
    ) {
        let refused = match &self.link {
            // Both requested at once: the request of the higher address stands.
            AcousticLink::Establishing { peer, .. } if *peer == frame.src => base.address() > frame.src,
            AcousticLink::Establishing { .. } => true,
            AcousticLink::Online(connection) => {
                connection.peer != frame.src && now < connection.last_received_at() + STALE_TIMEOUT
            }
            AcousticLink::Listen => false,
        };
        if refused {
            return;
        }
        self.requeue();
        base.transmitter.discard(&CONNECTION_FRAMES);
        self.connect(base, frame.src, frame.tag, false, signal, now);
        let mut grant = base.frame(FrameKind::Grant, frame.src);
        grant.tag = frame.tag;
        let grant = messages.piggyback.attach(grant);
        base.send(grant, timing::HEADER, "connect", AfterSending::Done);
        self.listen_at_most(base, Duration::from_secs(3) + 2 * signal.one_way, now);
    }

    /// The peer granted our request.
    pub(crate) fn on_grant(&mut self, base: &mut S2cBase, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
        let AcousticLink::Establishing { peer, session, .. } = self.link else { return };
        if (peer, session) == (frame.src, frame.tag) {
            self.connect(base, peer, session, true, signal, now);
            self.begin_turn_after(base, timing::TURN_AROUND - timing::PROCESSING, false, now);
        }
    }

    fn connect(
        &mut self,
        base: &mut S2cBase,
        peer: u8,
        session: u8,
        initiator: bool,
        signal: &ReceivedSignal,
        now: Duration,
    ) {
        self.epoch += 1;
        let connection = Connection::new(peer, session, initiator, signal, u64::from(self.epoch) << 32);
        self.link = AcousticLink::Online(Box::new(connection));
        let rate = base.config.bit_rate;
        base.notify_extended(format!("BITRATE,local,{rate}"), now);
        base.notify_extended(format!("BITRATE,remote,{rate}"), now);
    }

    /// The peer has been silent for too long: all records to it fail.
    pub(super) fn lose_connection(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        if let AcousticLink::Online(connection) = std::mem::take(&mut self.link) {
            self.fail_records(base, messages, connection.peer, connection.sender.into_records(), now);
        }
    }

    fn fail_records(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        peer: u8,
        mut failed: Vec<BurstRecord>,
        now: Duration,
    ) {
        failed.extend(self.pool.take_records_to(peer));
        let bytes: usize = failed.iter().map(|record| record.data.len()).sum();
        for record in failed {
            base.notify(format!("FAILED,{},{}", record.count, record.dst), now);
        }
        if bytes > 0 {
            self.pool.count_dropped(bytes);
            base.notify(format!("DROPCNT,{bytes}"), now);
        }
        self.on_listen(base, messages, now);
    }

    /// Sends the peer a disconnection, as the initiator of an idle connection does.
    pub(super) fn send_disconnect(&mut self, base: &mut S2cBase) {
        if let Some(connection) = self.link.connection_mut() {
            connection.enter(TurnState::Sending);
            let mut frame = base.frame(FrameKind::Disconnect, connection.peer);
            frame.tag = connection.session;
            base.send(frame, timing::HEADER, "disconnect", AfterSending::Closed);
        }
    }

    /// Our disconnection has been sent.
    pub(crate) fn on_disconnect_sent(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        if self.is_online() {
            self.requeue();
            self.on_listen(base, messages, now);
        }
    }

    /// The peer ends the connection.
    pub(crate) fn on_disconnect(
        &mut self,
        base: &mut S2cBase,
        messages: &mut Messages,
        frame: &S2cFrame,
        now: Duration,
    ) {
        if self.link.connection().is_some_and(|connection| connection.owns(frame)) {
            self.requeue();
            self.on_listen(base, messages, now);
        }
    }

    /// The host ends the connection; undelivered records stay in the pool.
    pub(crate) fn close(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        base.transmitter.discard(&CONNECTION_FRAMES);
        let ended = self.link.connection().map(|connection| (connection.peer, connection.session));
        self.requeue();
        if let Some((peer, session)) = ended {
            let mut frame = base.frame(FrameKind::Disconnect, peer);
            frame.tag = session;
            base.send(frame, timing::HEADER, "disconnect", AfterSending::Done);
        }
        self.on_listen(base, messages, now);
    }

    /// Ends the connection here and puts the records under way back to the front of the pool.
    fn requeue(&mut self) {
        if let AcousticLink::Online(connection) = std::mem::take(&mut self.link) {
            self.pool.put_back(connection.sender.into_records());
        }
    }

    /// The connection has ended: pending settings take effect, a waiting message is sent.
    fn on_listen(&mut self, base: &mut S2cBase, messages: &mut Messages, now: Duration) {
        base.settings.apply_pending();
        if messages.instant.waits_for_turn() {
            self.offer_air(base, messages, now);
        }
        base.board.schedule(now, S2cTask::ServePool);
    }
}
