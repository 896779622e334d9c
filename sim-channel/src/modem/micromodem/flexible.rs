//! `CCTDP`, `CARDP`: the flexible data protocol.

use super::base::MicromodemBase;
use super::packet::{Packet, PacketKind};
use super::rates::{flexible_airtime, flexible_data, flexible_mini_bytes};
use super::sentence::{NmeaSentence, from_hex, to_hex};
use super::signal::PacketSignal;
use super::statistics;
use super::transmitter::QueuedPacket;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::time::Duration;

/// The host sends flexible data: `$CCTDP,<dst>,<rate>,<ack>,<reserved>,<hex>`.
pub(super) fn on_command(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
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
pub(super) fn on_packet(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    let base64 = base.nvram.is_on("recv.base64data");
    let (mini, data) = packet.frames.split_at(packet.frames.len().min(1));
    let (mini, data) = (triples(mini, base64), triples(data, base64));
    let Packet { src, dst, rate, ack, .. } = packet;
    base.report(&format!("CARDP,{src},{dst},{rate},{},0,{mini},{data}", u8::from(*ack)), now);
    statistics::report_reception(base, packet, signal, 5, now);
}

/// The frames as triples `crc_ok;nbytes;data`, joined by `;`.
fn triples(frames: &[Option<Vec<u8>>], base64: bool) -> String {
    let triple = |frame: &Option<Vec<u8>>| match frame {
        Some(bytes) => format!("1;{};{}", bytes.len(), if base64 { STANDARD.encode(bytes) } else { to_hex(bytes) }),
        None => "0;0;".to_string(),
    };
    frames.iter().map(triple).collect::<Vec<_>>().join(";")
}
