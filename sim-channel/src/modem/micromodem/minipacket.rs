//! `CCMPC`, `CAMPA`, `CAMPR`: two-way pings. `CCMUC`, `CAMUA`: 13 bits of user data.

use super::base::{MicromodemBase, MicromodemTask};
use super::data::TURN_AROUND;
use super::packet::{Packet, PacketKind};
use super::sentence::NmeaSentence;
use super::signal::PacketSignal;
use super::statistics;
use super::transmitter::QueuedPacket;
use std::time::Duration;

/// The host orders a ping: `$CCMPC,<src>,<dst>`.
pub(super) fn on_ping_command(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let (Some(src), Some(dst)) = (sentence.number(0), sentence.number(1)) else {
        return base.report_error("NMEA", 1, "CCMPC: wrong field", now);
    };
    base.report(&sentence.echo(), now);
    base.transmitter.push(QueuedPacket::mini(Packet::new(PacketKind::Ping, src, dst)));
}

/// The host sends 13 bits: `$CCMUC,<src>,<dst>,<HHHH>`, up to 1FFF.
pub(super) fn on_user_command(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let bits = u16::from_str_radix(sentence.text(2), 16).ok().filter(|bits| *bits <= 0x1FFF);
    let (Some(src), Some(dst), Some(bits)) = (sentence.number(0), sentence.number(1), bits) else {
        return base.report_error("NMEA", 1, "CCMUC: wrong field", now);
    };
    base.report(&sentence.echo(), now);
    let mut packet = Packet::new(PacketKind::User, src, dst);
    packet.frames.push(Some(bits.to_be_bytes().to_vec()));
    base.transmitter.push(QueuedPacket::mini(packet));
}

/// Reports a ping, `$CAMPA,<src>,<dst>`, to which the modem replies by itself.
pub(super) fn on_ping(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    base.report(&format!("CAMPA,{},{}", packet.src, packet.dst), now);
    statistics::report_reception(base, packet, signal, 2, now);
    let reply = Packet::new(PacketKind::PingReply, packet.dst, packet.src);
    base.board.schedule(now + TURN_AROUND, MicromodemTask::Reply(Box::new(reply)));
}

/// Reports the reply to a ping: `$CAMPR,<src>,<dst>,<one-way travel time, s>`.
pub(super) fn on_ping_reply(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    base.report(&format!("CAMPR,{},{},{:.4}", packet.src, packet.dst, signal.one_way.as_secs_f64()), now);
    statistics::report_reception(base, packet, signal, 2, now);
}

/// Reports 13 bits of user data: `$CAMUA,<src>,<dst>,<HHHH>`.
pub(super) fn on_user(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    if let Some(Some(bytes)) = packet.frames.first() {
        let bits = bytes.iter().fold(0u16, |bits, byte| bits << 8 | u16::from(*byte));
        base.report(&format!("CAMUA,{},{},{bits:04X}", packet.src, packet.dst), now);
    }
    statistics::report_reception(base, packet, signal, 2, now);
}
