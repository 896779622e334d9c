//! `CACST` and `CAXST`: statistics of each reception and each transmission.

use super::base::MicromodemBase;
use super::packet::{Packet, PacketKind};
use super::signal::PacketSignal;
use super::transmitter::{QueuedPacket, SentPacket};
use std::time::Duration;

/// The field with the version of the layout, which a Micromodem 1 does not have.
fn version(base: &MicromodemBase) -> &'static str {
    if base.is_first_generation() { "" } else { "6," }
}

fn arrival_time(base: &MicromodemBase, at: Duration) -> String {
    if base.is_first_generation() { base.clock.hhmmss_fraction(at) } else { base.clock.compact(at) }
}

/// `CACST`: the last report of every reception.
pub(super) fn report_reception(
    base: &mut MicromodemBase,
    packet: &Packet,
    signal: &PacketSignal,
    packet_type: u8,
    now: Duration,
) {
    if !base.nvram.is_on("CST") {
        return;
    }
    let (version, arrived) = (version(base), arrival_time(base, signal.began));
    let Packet { src, dst, rate, .. } = packet;
    let bad = packet.frames.iter().filter(|frame| frame.is_none()).count();
    let frames = if packet.kind == PacketKind::CycleInit { 0 } else { packet.frames.len() };
    let psk_error = u8::from(bad > 0);
    let snr = signal.snr_db;
    let detector = "06,32767,45,0102,0123,07,00,00,00,00";
    let route = format!("{rate},{src:03},{dst:03},{psk_error},{packet_type},{frames},{bad}");
    let quality = format!("150,{snr:.1},{:.2},{:.2},{:.2},-01,0.00,51", snr / 2.0, snr / 2.0, -snr / 2.0);
    let (carrier, bandwidth) = (base.nvram.number("FC0"), base.nvram.number("BW0"));
    base.report(&format!("CACST,{version}0,{arrived},{detector},{route},{quality},{carrier},{bandwidth}"), now);
}

/// A packet was detected and never decoded; its `CACST` is short.
pub(super) fn report_timeout(base: &mut MicromodemBase, signal: &PacketSignal, now: Duration) {
    base.report("CAMSG,PACKET_TIMEOUT,0", now);
    if base.nvram.is_on("CST") {
        let (version, arrived) = (version(base), arrival_time(base, signal.began));
        base.report(&format!("CACST,{version}2,{arrived}"), now);
    }
}

/// `CATXF` and `CAXST`, version 6; without the version on a Micromodem 1.
pub(super) fn report_transmission(base: &mut MicromodemBase, sent: &SentPacket, now: Duration) {
    const CLOCK_MODE: u8 = 6;
    const GOOD: u8 = 0;
    const PROBE: u32 = 200;
    let QueuedPacket { packet, bytes, packet_type, expected, reported, .. } = &sent.out;
    if !reported {
        return;
    }
    base.report(&format!("CATXF,{bytes}"), now);
    if !base.nvram.is_on("XST") {
        return;
    }
    let (version, when) = (version(base), base.clock.date_and_time(sent.began));
    let (bandwidth, carrier) = (base.nvram.number("BW0"), base.nvram.number("FC0"));
    let modulation = format!("{CLOCK_MODE},{GOOD},{PROBE},{bandwidth},{carrier}");
    let route = format!("{},{},{},{}", packet.rate, packet.src, packet.dst, u8::from(packet.ack));
    let frames = packet.frames.len();
    base.report(&format!("CAXST,{version}{when},{modulation},{route},{expected},{frames},{packet_type},{bytes}"), now);
}
