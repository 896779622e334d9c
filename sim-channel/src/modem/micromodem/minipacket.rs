//! `CCMPC`, `CAMPA`, `CAMPR`: two-way pings. `CCMUC`, `CAMUA`: 13 bits of the user.

use super::packet::{Kind, Packet};
use super::rates::FSK_MINI;
use super::receive::{Signal, TURN_ROUND};
use super::sentence::Sentence;
use super::transmit::Outgoing;
use super::{Event, Micromodem};
use crate::Duration;

impl Micromodem {
    /// `$CCMPC,<src>,<dst>`
    pub(super) fn on_ping_command(&mut self, sentence: &Sentence, now: Duration) {
        let (Some(src), Some(dst)) = (sentence.number(0), sentence.number(1)) else {
            return self.complain("NMEA", 1, "CCMPC: wrong field", now);
        };
        self.tell(&sentence.echo(), now);
        self.send_mini(Packet::new(Kind::Ping, src, dst));
    }

    /// `$CCMUC,<src>,<dst>,<HHHH>`, up to 1FFF.
    pub(super) fn on_user_command(&mut self, sentence: &Sentence, now: Duration) {
        let bits = u16::from_str_radix(sentence.text(2), 16).ok().filter(|bits| *bits <= 0x1FFF);
        let (Some(src), Some(dst), Some(bits)) = (sentence.number(0), sentence.number(1), bits) else {
            return self.complain("NMEA", 1, "CCMUC: wrong field", now);
        };
        self.tell(&sentence.echo(), now);
        let mut packet = Packet::new(Kind::User, src, dst);
        packet.frames.push(Some(bits.to_be_bytes().to_vec()));
        self.send_mini(packet);
    }

    fn send_mini(&mut self, packet: Packet) {
        let bytes = packet.bytes();
        self.air.queue.push_back(Outgoing {
            packet,
            airtime: FSK_MINI,
            bytes,
            packet_type: 2,
            expected: 0,
            told: true,
            then_ask: false,
        });
    }

    /// `$CAMPA,<src>,<dst>`; the modem answers by itself.
    pub(super) fn on_ping(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        self.tell(&format!("CAMPA,{},{}", packet.src, packet.dst), now);
        self.tell_statistics(packet, signal, 2, now);
        let reply = Packet::new(Kind::PingReply, packet.dst, packet.src);
        self.board.plan(now + TURN_ROUND, Event::Reply(Box::new(reply)));
    }

    /// `$CAMPR,<src>,<dst>,<one-way travel time, s>`
    pub(super) fn on_ping_reply(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        self.tell(&format!("CAMPR,{},{},{:.4}", packet.src, packet.dst, signal.travel.as_secs_f64()), now);
        self.tell_statistics(packet, signal, 2, now);
    }

    /// `$CAMUA,<src>,<dst>,<HHHH>`
    pub(super) fn on_user(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        if let Some(Some(bytes)) = packet.frames.first() {
            let bits = bytes.iter().fold(0u16, |bits, byte| bits << 8 | u16::from(*byte));
            self.tell(&format!("CAMUA,{},{},{bits:04X}", packet.src, packet.dst), now);
        }
        self.tell_statistics(packet, signal, 2, now);
    }
}
