//! Hands each received frame to the service that owns the exchange.

use super::S2c;
use super::base::{AfterSending, FrameKind, QueuedFrame, ReceivedSignal, S2cFrame, timing};
use super::input::InstantFlag;
use super::receiver::notices;
use std::time::Duration;

/// Bit of an instant message's sequence number that marks the opening of a turn.
const OPENS_TURN: u32 = 0x100;

impl S2c {
    /// A frame has been decoded.
    pub(super) fn on_frame(&mut self, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
        if frame.dst != self.base.address() {
            self.on_overheard(frame, signal, now);
            return;
        }
        self.reception.note_level(signal);
        let Self { base, reception, usbl, messages, bursts } = self;
        match frame.kind {
            FrameKind::Instant => self.on_instant(frame, signal, now),
            FrameKind::InstantAck => {
                reception.note_exchange(signal);
                if messages.instant.on_ack(base, frame.src, frame.tag, now) {
                    usbl.measure(base, frame.src, signal, now);
                }
            }
            FrameKind::Synchronous => notices::synchronous(base, frame, signal, now),
            FrameKind::Request => bursts.on_request(base, messages, frame, signal, now),
            FrameKind::Grant => {
                reception.note_exchange(signal);
                bursts.on_grant(base, frame, signal, now);
            }
            FrameKind::Packet => bursts.on_packet(base, frame, signal, now),
            FrameKind::Turn => {
                reception.note_exchange(signal);
                bursts.on_peer_turn(base, messages, frame, signal, now);
                usbl.measure(base, frame.src, signal, now);
            }
            FrameKind::Disconnect => bursts.on_disconnect(base, messages, frame, now),
        }
        notices::piggyback(&mut self.base, frame, signal, now);
    }

    /// A frame for another modem.
    ///
    /// The host gets broadcast messages, and in promiscuous mode all messages. A connection between others means back-off.
    fn on_overheard(&mut self, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
        let wanted = frame.dst == 255 || self.base.settings.get("RP") == 1;
        match frame.kind {
            FrameKind::Instant if wanted => notices::instant(&mut self.base, frame, signal, now),
            FrameKind::Synchronous if wanted => notices::synchronous(&mut self.base, frame, signal, now),
            FrameKind::Request | FrameKind::Grant | FrameKind::Packet | FrameKind::Turn => {
                self.bursts.back_off(now + self.base.packet_time(frame.follow) + Duration::from_secs(3));
            }
            FrameKind::Disconnect => self.bursts.end_backoff(now),
            _ => {}
        }
    }

    /// Reports an instant message and acknowledges it: at once, or in this modem's next turn of a connection.
    fn on_instant(&mut self, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
        let Self { base, messages, bursts, .. } = self;
        notices::instant(base, frame, signal, now);
        if InstantFlag::ALL.get(usize::from(frame.tag)) != Some(&InstantFlag::Ack) {
            return;
        }
        let mut ack = base.frame(FrameKind::InstantAck, frame.src);
        ack.tag = frame.seq as u8;
        let ack = messages.piggyback.attach(ack);
        let out = QueuedFrame { frame: ack, airtime: timing::ACK, label: "ack", then: AfterSending::Done };
        if frame.seq & OPENS_TURN == 0 || !bursts.connected_to(frame.src) {
            base.transmitter.push_first(out);
        } else {
            bursts.defer(out);
            bursts.listen_at_most(base, base.packet_time(frame.follow) + Duration::from_secs(1), now);
        }
    }
}
