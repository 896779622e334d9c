//! Beginning and end of a connection.

use super::connection::{Connection, Link, Turn};
use crate::Duration;
use crate::modem::s2c::air::After;
use crate::modem::s2c::frame::{Frame, Kind};
use crate::modem::s2c::reception::Signal;
use crate::modem::s2c::{Event, Physical, S2c, timing};

/// A connection whose peer was silent for so long does not keep others out.
const STALE: Duration = Duration::from_secs(15);

impl S2c {
    /// Looks whether burst data waits and something can be done for it.
    pub(in super::super) fn kick(&mut self, now: Duration) {
        let Some(next) = self.burst.queue.front().map(|record| record.dst) else { return };
        match &self.burst.link {
            Link::Listen if now < self.burst.backoff_until => self.board.plan(self.burst.backoff_until, Event::Kick),
            Link::Listen if self.physical == Physical::Listen => {
                let session = (self.board.chance.uniform() * 256.0) as u8;
                self.burst.link = Link::Establishing { peer: next, session, attempts: 0 };
                self.request();
            }
            Link::Online(connection) if connection.turn == Turn::Idle => {
                if self.burst.queue.iter().any(|record| record.dst == connection.peer) {
                    self.begin_turn_after(Duration::ZERO, false, now);
                } else if !connection.sender.has_unacked() {
                    self.say_goodbye();
                }
            }
            _ => {}
        }
    }

    fn request(&mut self) {
        let Link::Establishing { peer, session, attempts } = &mut self.burst.link else { return };
        *attempts += 1;
        let (peer, session) = (*peer, *session);
        self.burst.epoch += 1;
        let mut frame = self.frame(Kind::Request, peer);
        frame.tag = session;
        let frame = self.with_piggyback(frame);
        self.send(frame, timing::HEADER, "connect", After::Request(self.burst.epoch));
    }

    /// `!RT` is the wait for an answer to begin; it then takes its own time.
    pub(in super::super) fn on_request_sent(&mut self, epoch: u32, now: Duration) {
        let wait = Duration::from_millis(u64::from(self.settings.get("RT")));
        self.board.plan(now + wait + timing::HEADER + timing::PROCESSING, Event::RequestTimeout { epoch });
    }

    pub(in super::super) fn on_request_timeout(&mut self, epoch: u32, now: Duration) {
        let Link::Establishing { peer, attempts, .. } = self.burst.link else { return };
        if epoch != self.burst.epoch {
            return;
        }
        if attempts > self.settings.get("RC") {
            self.burst.link = Link::Listen;
            self.fail_records(peer, Vec::new(), now);
        } else {
            self.request();
        }
    }

    /// Somebody asks for a connection.
    pub(in super::super) fn on_request(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        match &self.burst.link {
            Link::Establishing { peer, .. } if *peer == frame.src && self.address() > frame.src => return,
            Link::Establishing { peer, .. } if *peer != frame.src => return,
            Link::Online(connection) if connection.peer != frame.src && now < connection.heard_at + STALE => return,
            _ => {}
        }
        self.requeue();
        self.air.queue.retain(|out| !matches!(out.frame.kind, Kind::Request | Kind::Packet | Kind::Turn));
        self.connect(frame.src, frame.tag, false, signal, now);
        let mut answer = self.frame(Kind::Answer, frame.src);
        answer.tag = frame.tag;
        let answer = self.with_piggyback(answer);
        self.send(answer, timing::HEADER, "connect", After::Nothing);
        self.guard_turn(Duration::from_secs(3) + 2 * signal.travel, now);
    }

    /// Our request was granted.
    pub(in super::super) fn on_answer(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        let Link::Establishing { peer, session, .. } = self.burst.link else { return };
        if (peer, session) == (frame.src, frame.tag) {
            self.connect(peer, session, true, signal, now);
            self.begin_turn_after(timing::TURN_ROUND - timing::PROCESSING, false, now);
        }
    }

    fn connect(&mut self, peer: u8, session: u8, initiator: bool, signal: &Signal, now: Duration) {
        self.burst.epoch += 1;
        let connection = Connection::new(peer, session, initiator, signal, u64::from(self.burst.epoch) << 32);
        self.burst.link = Link::Online(Box::new(connection));
        let rate = self.config.bit_rate;
        self.notify_extended(format!("BITRATE,local,{rate}"), now);
        self.notify_extended(format!("BITRATE,remote,{rate}"), now);
    }

    /// The peer has been silent for too long: everything meant for it fails.
    pub(in super::super) fn lose_connection(&mut self, now: Duration) {
        if let Link::Online(connection) = std::mem::take(&mut self.burst.link) {
            self.fail_records(connection.peer, connection.sender.into_records(), now);
        }
    }

    fn fail_records(&mut self, peer: u8, mut failed: Vec<super::Record>, now: Duration) {
        let (to_peer, others): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.burst.queue).into_iter().partition(|record| record.dst == peer);
        self.burst.queue = others.into();
        failed.extend(to_peer);
        let bytes: usize = failed.iter().map(|record| record.data.len()).sum();
        for record in failed {
            self.notify(format!("FAILED,{},{}", record.count, record.dst), now);
        }
        if bytes > 0 {
            self.burst.dropped += bytes as u64;
            self.notify(format!("DROPCNT,{bytes}"), now);
        }
        self.on_listen(now);
    }

    /// Tells the peer that the connection is over.
    pub(in super::super) fn say_goodbye(&mut self) {
        if let Some(connection) = self.burst.link.connection_mut() {
            connection.turn = Turn::Talking;
            connection.number += 1;
            let (peer, session) = (connection.peer, connection.session);
            let mut frame = self.frame(Kind::Close, peer);
            frame.tag = session;
            self.send(frame, timing::HEADER, "disconnect", After::Closed);
        }
    }

    /// Our goodbye has been said.
    pub(in super::super) fn on_closed(&mut self, now: Duration) {
        if self.is_online() {
            self.requeue();
            self.on_listen(now);
        }
    }

    /// The peer's goodbye.
    pub(in super::super) fn on_close(&mut self, frame: &Frame, now: Duration) {
        let ours = |connection: &Connection| connection.peer == frame.src && connection.session == frame.tag;
        if self.burst.link.connection().is_some_and(ours) {
            self.requeue();
            self.on_listen(now);
        }
    }

    /// The host asks for the end of the connection; what is not delivered stays in the pool.
    pub(in super::super) fn close_connection(&mut self, now: Duration) {
        self.air.queue.retain(|out| !matches!(out.frame.kind, Kind::Request | Kind::Packet | Kind::Turn));
        let farewell = self.burst.link.connection().map(|connection| (connection.peer, connection.session));
        self.requeue();
        if let Some((peer, session)) = farewell {
            let mut frame = self.frame(Kind::Close, peer);
            frame.tag = session;
            self.send(frame, timing::HEADER, "disconnect", After::Nothing);
        }
        self.on_listen(now);
    }

    /// Ends the connection here and puts what was under way back to the front of the pool.
    fn requeue(&mut self) {
        if let Link::Online(connection) = std::mem::take(&mut self.burst.link) {
            for record in connection.sender.into_records().into_iter().rev() {
                self.burst.queue.push_front(record);
            }
        }
    }

    /// No connection any more: settings that waited take effect, messages that waited go out.
    fn on_listen(&mut self, now: Duration) {
        self.settings.apply_pending();
        if self.instant.waits_for_turn {
            self.try_instant(now);
        }
        self.board.plan(now, Event::Kick);
    }
}
