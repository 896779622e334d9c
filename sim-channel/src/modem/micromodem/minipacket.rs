//! `CCMPC`, `CAMPA`, `CAMPR`: two-way pings. `CCMUC`, `CAMUA`: 13 bits of user data. `CCTDP`, `CARDP`: the flexible data
//! protocol.

use super::base::{MicromodemBase, MicromodemTask};
use super::cycle::TURN_AROUND;
use super::packet::{Packet, PacketKind, flexible_airtime, flexible_data, flexible_mini_bytes};
use super::sentence::{NmeaSentence, from_hex, to_hex};
use super::transducer;
use super::transmitter::{PacketSignal, QueuedPacket};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
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
    transducer::report_reception(base, packet, signal, 2, now);
    let reply = Packet::new(PacketKind::PingReply, packet.dst, packet.src);
    base.board.schedule(now + TURN_AROUND, MicromodemTask::Reply(Box::new(reply)));
}

/// Reports the reply to a ping: `$CAMPR,<src>,<dst>,<one-way travel time, s>`.
pub(super) fn on_ping_reply(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    base.report(&format!("CAMPR,{},{},{:.4}", packet.src, packet.dst, signal.one_way.as_secs_f64()), now);
    transducer::report_reception(base, packet, signal, 2, now);
}

/// Reports 13 bits of user data: `$CAMUA,<src>,<dst>,<HHHH>`.
pub(super) fn on_user(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    if let Some(Some(bytes)) = packet.frames.first() {
        let bits = bytes.iter().fold(0u16, |bits, byte| bits << 8 | u16::from(*byte));
        base.report(&format!("CAMUA,{},{},{bits:04X}", packet.src, packet.dst), now);
    }
    transducer::report_reception(base, packet, signal, 2, now);
}

/// The host sends flexible data: `$CCTDP,<dst>,<rate>,<ack>,<reserved>,<hex>`.
pub(super) fn on_flexible_command(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let fields = (sentence.number::<u8>(0), sentence.number::<u8>(1), from_hex(sentence.text(4)));
    let (Some(dst), Some(rate), Some(data)) = fields else {
        return base.report_error("NMEA", 1, "CCTDP: wrong field", now);
    };
    let (ack, reserved) = (sentence.text(2), sentence.text(3));
    let sizes = flexible_mini_bytes(rate).map(|mini| (data.len().min(mini), data.len().saturating_sub(mini)));
    let fits = sizes.filter(|(_, rest)| *rest <= flexible_data(rate).0 && !data.is_empty());
    let Some((mini, rest)) = fits else {
        return base.report(&format!("CATDP,1,0,{dst},{rate},{ack},{reserved},0,0"), now);
    };
    let number = base.transmitter.next_number();
    base.report(&format!("CATDP,0,{number},{dst},{rate},{ack},{reserved},{mini},{rest}"), now);
    let mut packet = Packet::new(PacketKind::Flexible, base.address(), dst);
    (packet.rate, packet.ack) = (rate, ack == "1");
    let (head, tail) = data.split_at(mini);
    packet.frames.push(Some(head.to_vec()));
    packet.frames.extend(tail.chunks(flexible_data(rate).1).map(|frame| Some(frame.to_vec())));
    let expected = packet.frames.len() as u8;
    base.transmitter.push(QueuedPacket {
        airtime: flexible_airtime(rate, mini, rest),
        bytes: data.len(),
        packet_type: 5,
        expected,
        reported: true,
        then_request_data: false,
        packet,
    });
}

/// `$CARDP,<src>,<dst>,<rate>,<ack>,<reserved>,<mini>,<data>`, the last two empty or triples joined by `;`.
pub(super) fn on_flexible_packet(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    let base64 = base.nvram.is_on("recv.base64data");
    let (mini, data) = packet.frames.split_at(packet.frames.len().min(1));
    let (mini, data) = (triples(mini, base64), triples(data, base64));
    let Packet { src, dst, rate, ack, .. } = packet;
    base.report(&format!("CARDP,{src},{dst},{rate},{},0,{mini},{data}", u8::from(*ack)), now);
    transducer::report_reception(base, packet, signal, 5, now);
}

/// The frames as triples `crc_ok;nbytes;data`, joined by `;`.
fn triples(frames: &[Option<Vec<u8>>], base64: bool) -> String {
    let triple = |frame: &Option<Vec<u8>>| match frame {
        Some(bytes) => format!("1;{};{}", bytes.len(), if base64 { STANDARD.encode(bytes) } else { to_hex(bytes) }),
        None => "0;0;".to_string(),
    };
    frames.iter().map(triple).collect::<Vec<_>>().join(";")
}
