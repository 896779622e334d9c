//! Received data packets and acknowledgements: `CACYC`, `CARXD`, `CAACK`.

use super::base::{MicromodemBase, MicromodemTask};
use super::packet::{Packet, PacketKind};
use super::sentence::to_hex;
use super::signal::PacketSignal;
use super::statistics;
use std::time::Duration;

/// From a packet's content to the reply that the modem sends by itself.
pub(super) const TURN_AROUND: Duration = Duration::from_millis(300);

/// Reports a cycle init that was received: `$CACYC,0,<src>,<dst>,<rate>,<ack>,<nframes>`.
pub(super) fn report_cycle(base: &mut MicromodemBase, packet: &Packet, ack: bool, now: Duration) {
    let Packet { src, dst, rate, frame_count, .. } = packet;
    base.report(&format!("CACYC,0,{src},{dst},{rate},{},{frame_count}", u8::from(ack)), now);
}

/// PSK packets carry their own cycle init, which has no acknowledgement flag; FSK packets had theirs before.
pub(super) fn on_data_packet(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    if packet.rate > 0 {
        report_cycle(base, packet, false, now);
    }
    let mut good = Vec::new();
    for (number, frame) in (1u8..).zip(&packet.frames) {
        match frame {
            Some(bytes) => {
                good.push(number);
                report_frame(base, packet, number, bytes, now);
            }
            None => base.report("CAMSG,BAD_CRC,0", now),
        }
    }
    statistics::report_reception(base, packet, signal, if packet.rate == 0 { 1 } else { 3 }, now);
    let own = base.address();
    if packet.ack && own != 0 && packet.dst == own && !good.is_empty() {
        let mut ack = Packet::new(PacketKind::Ack, own, packet.src);
        ack.rate = packet.rate;
        ack.frames.push(Some(good));
        base.board.schedule(now + TURN_AROUND, MicromodemTask::Reply(Box::new(ack)));
    }
}

/// `$CARXD,<src>,<dst>,<ack>,<frame>,<hex>`, or `$CARXA` with text.
fn report_frame(base: &mut MicromodemBase, packet: &Packet, number: u8, bytes: &[u8], now: Duration) {
    let (src, dst, ack) = (packet.src, packet.dst, u8::from(packet.ack));
    let sentence = if packet.ascii {
        format!("CARXA,{src},{dst},{ack},{number},{}", String::from_utf8_lossy(bytes))
    } else {
        format!("CARXD,{src},{dst},{ack},{number},{}", to_hex(bytes))
    };
    base.report(&sentence, now);
}

/// One `$CAACK,<src>,<dst>,<frame>,1` for each frame.
pub(super) fn on_ack(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    for number in packet.frames.iter().flatten().flatten() {
        base.report(&format!("CAACK,{},{},{number},1", packet.src, packet.dst), now);
    }
    statistics::report_reception(base, packet, signal, if packet.rate == 0 { 2 } else { 4 }, now);
}
